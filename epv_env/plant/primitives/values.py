"""The type of a physical quantity in the plant's tuples."""

from typing import Any, TypeAlias

Value: TypeAlias = Any
"""A float inside the kernels and for one valve, an array of one float per valve outside."""
