"""Scenario files: tests of missions written in YAML (docs/testing.md)."""
