"""The simulated hardware as a process: emulators behind real ports, simulated time."""
