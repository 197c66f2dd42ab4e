"""How sure the estimates are (section 6.3)."""
