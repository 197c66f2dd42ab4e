"""Ways to spoil a file, drawn from a generator: bytes for any file, values for JSON."""

import copy
import json
from typing import Any

import numpy as np

WRONG_VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 1.5, -1e300, 1e300, 10**30, float("nan"), float("inf"), "", "x", "0.005", "\0",
    "é" * 300, [], {}, [[]], [None] * 50, {"": {}}, "../../etc/passwd", "NaN", -0.0, 2**63,
)  # fmt: skip


def damaged_bytes(content: bytes, rng: np.random.Generator) -> bytes:
    """The content with bytes changed, cut off, repeated or put in."""
    kind = rng.integers(5)
    place = int(rng.integers(max(len(content), 1)))
    if kind == 0:
        return content[:place]
    if kind == 1:
        return content[:place] + rng.bytes(int(rng.integers(1, 20))) + content[place:]
    if kind == 2:
        changed = bytearray(content)
        for k in rng.integers(max(len(content), 1), size=int(rng.integers(1, 8))):
            changed[k] = int(rng.integers(256))
        return bytes(changed)
    if kind == 3:
        end = place + int(rng.integers(1, 200))
        return content[:end] + content[place:]
    return bytes([b"[", b"{", b'"', b"9", b"\xff"][int(rng.integers(5))][0:1]) * int(
        rng.integers(1, 200_000)
    )


def damaged_value(content: bytes, rng: np.random.Generator) -> bytes:
    """JSON with one value replaced, removed, repeated, or put where another belongs."""
    value = copy.deepcopy(json.loads(content))
    places = list(_places(value))
    holder, key = places[int(rng.integers(len(places)))]
    kind = rng.integers(4)
    if kind == 0:
        del holder[key]
    elif kind == 1:
        other, name = places[int(rng.integers(len(places)))]
        holder[key] = copy.deepcopy(other[name]) if other is not holder else None
    else:
        holder[key] = WRONG_VALUES[int(rng.integers(len(WRONG_VALUES)))]
    return json.dumps(value).encode()


def _places(value: Any):
    """Every (holder, key) within a value."""
    for key in list(value) if isinstance(value, dict) else range(len(value)):
        yield value, key
        if isinstance(value[key], (dict, list)):
            yield from _places(value[key])
