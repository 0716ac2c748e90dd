"""The errors that DB makes the emulated scanner pretend, so that hosts can be tested.

Source: protocol manual C-42-03320B, 8.10 (REFERENCE 4.6). The manual's annex with the statuses was not at
hand: here an error that is being checked is 21 and trouble is 50, the first of their ranges.
"""

from __future__ import annotations

CHECKING, TROUBLE, RESUMED = "21", "50", "98"

AT_ONCE = ("01", "02")
"""Trouble from now on; 01 was made for hosts that speak SCIP 1.1."""

IN_A_STREAM = {"03": (CHECKING, RESUMED), "04": (CHECKING, TROUBLE), "05": (TROUBLE,)}
"""What comes in the place of scans, once a stream has sent enough of them."""

SCANS_BEFORE = 20

USUAL = "10"
"""Ends it."""


class PretendedError:
    """Which error is pretended, and how far it has come.

    Attributes:
        mode: The argument of DB, None for no error.
    """

    def __init__(self) -> None:
        self.mode: str | None = None
        self._trouble = False
        self._scans = 0

    @property
    def trouble(self) -> bool:
        """Whether the laser cannot be used now."""
        return self.mode in AT_ONCE or self._trouble

    def set(self, digits: str) -> str:
        """Obey DB.

        Args:
            digits: Its argument.

        Returns:
            The status.
        """
        if digits == USUAL:
            status = "03" if self.mode is None else "00"
            self.mode, self._trouble = None, False
            return status
        if digits not in AT_ONCE and digits not in IN_A_STREAM:
            return "01"
        if digits == self.mode:
            return "02"
        self.mode, self._trouble, self._scans = digits, False, 0
        return "00"

    def begin_stream(self) -> None:
        """A stream begins: count its scans anew."""
        self._scans = 0

    def instead_of_scan(self) -> str | None:
        """The status that is sent in the place of the next scan of a stream, None to send the scan."""
        if self.trouble:
            return TROUBLE
        statuses = IN_A_STREAM.get(self.mode or "", ())
        place = self._scans - SCANS_BEFORE
        self._scans += 1
        if not 0 <= place < len(statuses):
            return None
        self._trouble = statuses[place] == TROUBLE
        return statuses[place]
