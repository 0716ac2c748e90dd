"""``python -m florence_bt.cli``: the same as the command ``florence``."""

from florence_bt.cli import main

main()
