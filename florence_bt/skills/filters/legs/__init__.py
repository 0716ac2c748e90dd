"""What may be the legs of people in a laser scan: no ROS, no memory."""
