"""Scenario files: tests of missions written in YAML (docs/manual/testing.md)."""
