"""The report's tables computed again, and the errata among its printed figures."""
