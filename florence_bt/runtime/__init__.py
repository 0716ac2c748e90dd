"""Runs missions: takes triggers, arbitrates, ticks the tree when something happened, records and explains."""
