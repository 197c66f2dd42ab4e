"""Which extra of this package brings a package that is missing."""

import re
from importlib.metadata import PackageNotFoundError, requires

DISTRIBUTION = "epv-valve"

OTHER_NAMES = {"PIL": "pillow"}
"""Names on the package index of modules that are called otherwise."""


def missing_package(module: str, *, preferred: str = "") -> str | None:
    """A sentence that says how to install what a module needs; None if no extra brings it.

    module: as it is imported, such as "stable_baselines3.common". preferred: of several extras.
    """
    top = module.partition(".")[0]
    extras = _extras_of(OTHER_NAMES.get(top, top))
    if not extras:
        return None
    extra = preferred if preferred in extras else extras[0]
    return f"this needs the package {top}, which is not installed: {how_to_install(extra)}"


def how_to_install(extra: str) -> str:
    """The command that installs an extra; no package index has this package."""
    return f"pip install -e '.[{extra}]' in a clone of {DISTRIBUTION}"


def _extras_of(package: str) -> list[str]:
    """The extras that ask for a package of the index, the one with the fewest packages first."""
    try:
        needed = requires(DISTRIBUTION) or []
    except PackageNotFoundError:
        return []
    sizes: dict[str, int] = {}
    found = []
    for line in needed:
        name = re.match(r"[\w.-]+", line)
        extra = re.search(r"""extra == ['"]([\w-]+)['"]""", line)
        if not name or not extra:
            continue
        sizes[extra[1]] = sizes.get(extra[1], 0) + 1
        if _normal(name[0]) == _normal(package) and extra[1] not in found:
            found.append(extra[1])
    return sorted(found, key=lambda extra: sizes[extra])


def _normal(name: str) -> str:
    """A name as the index compares names."""
    return re.sub(r"[-_.]+", "-", name).lower()
