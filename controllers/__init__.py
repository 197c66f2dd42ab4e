"""Controllers of the valve, classic and learned, behind one protocol."""
