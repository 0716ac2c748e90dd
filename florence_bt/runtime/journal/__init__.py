"""The journal: every change of every run in one SQLite file per folder of runs.

``Journal`` writes, ``JournalReader`` reads, also while a journal is being written and after a crash.
"""

from florence_bt.runtime.journal.journal import Journal, JournalParameters
from florence_bt.runtime.journal.reader import JournalReader
from florence_bt.runtime.journal.rows import JournaledEvent, JournaledRun
from florence_bt.runtime.journal.schema import JOURNAL_FILE, JournalBroken

__all__ = [
    "JOURNAL_FILE",
    "Journal",
    "JournalBroken",
    "JournalParameters",
    "JournalReader",
    "JournaledEvent",
    "JournaledRun",
]
