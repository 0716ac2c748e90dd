"""The simulated sensors. They speak device units, so that emulators can put their values into bytes."""
