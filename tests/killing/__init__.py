"""Long commands killed at random moments: `python -m tests.killing`."""
