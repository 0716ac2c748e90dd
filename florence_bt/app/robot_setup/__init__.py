"""``florence init``: makes the folder of a robot, which ``florence up FOLDER`` brings up."""
