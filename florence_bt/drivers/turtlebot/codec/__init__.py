"""The Open Interface as bytes: commands out, sensor packets in (REFERENCE 1.3, 1.5, 1.6)."""
