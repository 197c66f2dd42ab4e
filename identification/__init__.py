"""Identification: how well a model fits recordings, and which parameters matter."""
