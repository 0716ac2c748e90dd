"""Commands on devices: calibration, and recordings of the Kinect."""
