"""Runnable examples of the guide's pages."""
