"""Skills and called missions that follow a script."""
