"""The parts of a robustness sweep: what is swept, the tasks, where they run, tables and figures."""
