"""Finds people in depth and colour pictures, follows them and recognises them again."""
