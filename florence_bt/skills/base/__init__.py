"""What missions may ask of the base beside driving; the driver is in florence_bt.drivers.turtlebot."""
