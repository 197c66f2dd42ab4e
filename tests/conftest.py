"""The order of the test files."""

import pytest

FIRST = ("tests/plant/test_batch.py", "tests/identification/gap/")
"""One worker compiles the kernels, which takes a minute, beside one that needs none so far."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What begins first stands first; the rest stays as it is."""

    def place(item: pytest.Item) -> int:
        return next((k for k, start in enumerate(FIRST) if item.nodeid.startswith(start)), len(FIRST))

    items.sort(key=place)
