"""The parts of the comparison: its contenders, blocks of episodes, tables, acceptance criteria and figures."""
