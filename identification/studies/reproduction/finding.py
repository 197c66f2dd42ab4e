"""One printed statement of the report, checked."""

from dataclasses import dataclass

HOLDS, SLIP, DOUBT = "holds", "slip", "doubt"
"""The printed figures agree; they contradict each other; or they are hard to believe together."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A printed value beside the same value recomputed from the report's other figures."""

    where: str
    """Table, equation or section, and the quantity."""
    printed: str
    recomputed: str
    status: str
    """HOLDS, SLIP or DOUBT."""
    remark: str = ""
    """What rule the recomputation uses, and what follows."""


def compared(
    where: str, printed: float, recomputed: float, tolerance: float, *, digits: int = 4, remark: str = ""
) -> Finding:
    """A printed number that must agree within the rounding of what it is computed from."""
    return Finding(
        where=where,
        printed=f"{printed:.{digits}f}",
        recomputed=f"{recomputed:.{digits}f}",
        status=HOLDS if abs(printed - recomputed) <= tolerance else SLIP,
        remark=remark,
    )
