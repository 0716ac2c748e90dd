"""What is known of a mission before it moves a robot: every way that it can go is explored."""
