"""Runs a mission again as its journal has it: to go on after a crash, to check it, to look at its steps.

:class:`~florence_bt.runtime.replay.replay.Replay` is the one mechanism behind all of these.
"""
