"""The subcommands of `python -m identification`, one file each."""
