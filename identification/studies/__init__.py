"""Studies about the methods themselves; the library imports none of them."""
