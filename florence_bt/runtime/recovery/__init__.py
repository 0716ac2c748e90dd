"""After the mission server died: the robot is made safe, its runs are aborted, restarted or resumed."""
