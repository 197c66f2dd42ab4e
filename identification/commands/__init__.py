"""The commands of `python -m identification`: a module each (epv_env/common/commands.py)."""
