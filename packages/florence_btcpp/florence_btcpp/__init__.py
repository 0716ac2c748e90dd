"""BehaviorTree.CPP XML: missions are exported to it, and trees of other projects imported from it.

What is read: version 4 and version 3 of the format. What is written: version 4. The README has the
table of elements and says where the two worlds differ. ``export_mission`` is in :mod:`.exporter`,
``import_trees`` in :mod:`.importer`: nothing is imported here, so that ``florence --help`` is quick.
"""
