"""Rare episodes: what is proved, bounded and searched."""
