"""The old name of :mod:`florence_bt.mission_testing`."""

raise ImportError("florence_bt.testing is called florence_bt.mission_testing now")
