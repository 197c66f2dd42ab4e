"""The formats of measurement files: one file each, one line in the registry."""
