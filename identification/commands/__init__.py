"""The commands of `python -m identification`: one file each, and their registry."""
