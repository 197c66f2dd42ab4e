"""The report's tables computed again, and what its printed figures say when they are checked."""
