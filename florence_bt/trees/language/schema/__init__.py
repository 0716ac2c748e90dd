"""JSON Schema of mission files, so that editors complete and check them while they are written.

Made from the vocabulary of the language, the declarations of the skills and the known missions. What a schema
cannot say (whether a key has a value, whether a branch is ever reached) is left to ``florence check``.
"""

from florence_bt.trees.language.schema._data import as_data
from florence_bt.trees.language.schema._mission import DRAFT, make_schema

__all__ = ["DRAFT", "as_data", "make_schema"]
