"""The missions of this package: one YAML file each."""
