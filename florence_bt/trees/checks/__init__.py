"""The check of missions: names, values, keys, places, what is never reached; and the report of it."""
