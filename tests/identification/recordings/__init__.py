"""Recordings: reading, writing, refusing."""
