"""Studies: each folder holds a script, its page (README.md) and its results, side by side."""
