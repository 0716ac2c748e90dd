"""The places of a home: hotspot files listed, checked, changed and drawn."""
