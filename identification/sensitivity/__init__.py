"""Which parameters matter, and which the data cannot tell apart (section 5)."""
