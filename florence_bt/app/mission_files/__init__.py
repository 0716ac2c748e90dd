"""Commands on mission files: check, test, draw, list, import and export."""
