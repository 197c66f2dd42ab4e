"""A monitor of a valve: it follows what a control unit reads, on line or from an operation log."""
