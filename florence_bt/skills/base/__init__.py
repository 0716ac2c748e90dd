"""Skills of the base beside driving; the driver is in florence_bt.drivers.turtlebot."""
