"""Which causes, and which laws of theirs, are worth a fit."""
