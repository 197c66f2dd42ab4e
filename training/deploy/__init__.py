"""A trained policy as files for an electronic control unit; the command is training/export.py."""
