"""BehaviorTree.CPP XML: missions are exported to it, and trees of other projects imported from it.

What is read: version 4 and version 3 of the format. What is written: version 4. The README has the
table of elements and says where the two worlds differ.
"""

from florence_btcpp.exporter import Exported, export_mission
from florence_btcpp.importer import Imported, import_trees

__all__ = ["Exported", "Imported", "export_mission", "import_trees"]
