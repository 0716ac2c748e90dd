"""The whole robot in one process on one manual clock, without ROS and without bytes."""
