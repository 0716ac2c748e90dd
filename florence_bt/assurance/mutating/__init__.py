"""Small changes of a mission, and who notices them: the check, its scenarios, its properties, or nobody."""
