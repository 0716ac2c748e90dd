"""The mission language: from the text of a file to a tree of behaviours."""
