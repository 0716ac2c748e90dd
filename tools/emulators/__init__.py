"""Emulated devices alone, for any client; nothing in the package uses them."""
