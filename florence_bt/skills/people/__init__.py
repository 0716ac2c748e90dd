"""Finding a person, and where to stand politely in front of one (document, sections 3.9, 3.10 and 4)."""
