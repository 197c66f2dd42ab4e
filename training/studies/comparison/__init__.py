"""The comparison: contenders, blocks of episodes, tables, acceptance criteria and figures."""
