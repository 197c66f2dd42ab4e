"""The parts of the comparison: its plan, scores, bars, tables and figures."""
