"""Choices that missions leave to chance."""
