"""Recordings of a bench: in memory, as files, and the rules they keep."""
