"""Recordings and plant made ready: screened, checked, noise known."""
