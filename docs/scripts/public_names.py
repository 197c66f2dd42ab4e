"""Public names without a docstring, found in the source without importing it."""

from collections.abc import Iterator

import griffe

from docs.scripts.api_pages import PACKAGES, ROOT

OWN = (*PACKAGES, "typing", "abc", "object")
"""First words of base classes that do not document the methods of this project's classes."""


def undocumented_names() -> list[str]:
    """Public modules, classes, functions and methods of the packages without a docstring."""
    loaded = [griffe.load(package, search_paths=[ROOT]) for package in PACKAGES]
    return [path for module in loaded for path in undocumented(module)]


def undocumented(owner: griffe.Object | griffe.Alias) -> Iterator[str]:
    """Paths of the names below a module or class.

    A method is documented elsewhere if its class overrides one of another project's classes. A class
    may also set its `__doc__`.
    """
    for name, member in owner.members.items():
        if name.startswith("_") or member.is_alias:
            continue
        if _needs_docstring(member) and not member.has_docstring and "__doc__" not in member.members:
            yield member.path
        if member.is_module or member.is_class:
            yield from undocumented(member)


def _needs_docstring(member: griffe.Object | griffe.Alias) -> bool:
    if member.is_function and isinstance(member.parent, griffe.Class):
        return not _overrides_another_project(member.parent)
    return member.is_module or member.is_class or member.is_function


def _overrides_another_project(owner: griffe.Class) -> bool:
    """Whether a class has a base outside this project."""
    names = (base if isinstance(base, str) else base.canonical_path for base in owner.bases)
    return any(name.split(".")[0] not in OWN for name in names)
