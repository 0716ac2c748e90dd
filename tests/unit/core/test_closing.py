"""A process whose end hangs ends all the same."""

import subprocess
import sys

HANGS = """
import threading
from florence_bt.core.closing import ending_anyway
with ending_anyway({after_s}):
    {what}
print("out of it")
"""


def ended(what, after_s):
    program = HANGS.format(after_s=after_s, what=what)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=600)


def test_what_hangs_is_ended_with_its_stack():
    done = ended("threading.Event().wait()", 0.05)
    assert done.returncode == 1 and "line 5" in done.stderr and not done.stdout


def test_what_holds_the_lock_of_python_is_ended_too():
    done = ended("__import__('ctypes').PyDLL(None).pause()", 0.05)
    assert done.returncode == 1 and not done.stdout


def test_what_comes_to_its_end_goes_on():
    done = ended("pass", 600.0)
    assert (done.returncode, done.stdout, done.stderr) == (0, "out of it\n", "")
