"""Missions drawn as text, as Mermaid and as SVG."""
