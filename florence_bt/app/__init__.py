"""The only place that chooses real, simulated or mocked parts, and that starts and ends processes."""
