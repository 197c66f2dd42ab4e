"""Random numbers that depend on a key and a counter alone: Philox4x32-10.

Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3 (2011). A thread that knows its
counter needs no state and no other thread. Whole numbers are np.uint64 throughout: numba turns a mixture
of signed and unsigned ones into floats.
"""

import math

import numpy as np

from epv_env.plant.primitives import exact

_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_HALF, _LOW = np.uint64(32), np.uint64(0xFFFFFFFF)
ROUNDS = 10


@exact
def philox(key, a, b, c, d):
    """Four random whole numbers of 32 bits for a key of 64 bits and a counter of four times 32 bits."""
    k0, k1 = key & _LOW, key >> _HALF
    for _ in range(ROUNDS):
        first, second = _M0 * a, _M1 * c
        a, b = (second >> _HALF) ^ b ^ k0, second & _LOW
        c, d = (first >> _HALF) ^ d ^ k1, first & _LOW
        k0, k1 = (k0 + _W0) & _LOW, (k1 + _W1) & _LOW
    return a, b, c, d


@exact
def _uniform(x):
    """A number within (0, 1) from 32 bits."""
    return (float(x) + 0.5) * 2.0**-32


@exact
def _normals(length, angle, factor):
    """Two normal numbers from 64 bits (Box and Muller 1958)."""
    radius, turn = factor * math.sqrt(-2.0 * math.log(_uniform(length))), math.tau * _uniform(angle)
    return radius * math.cos(turn), radius * math.sin(turn)


@exact
def draw_normals(key, a, b, c, d, factor, drawn):
    """Write four standard normal numbers times a factor into drawn (4,)."""
    x, y, z, w = philox(key, np.uint64(a), np.uint64(b), np.uint64(c), np.uint64(d))
    drawn[0], drawn[1] = _normals(x, y, factor)
    drawn[2], drawn[3] = _normals(z, w, factor)
