"""What equations and effects are made of: how plant code is compiled, orifice flow, the type of a value.

`fast` arithmetic (fused multiply-add, reciprocals) is safe for reproducibility because every lane of
every batch runs through the very same machine code: see lanes.LANES.

The isentropic flux (report eqs 13, 14 with m1/V1 = p1/(R T1), see docs/explanation/plant-model.md) is

    flux = pu * sqrt(2 k / ((k - 1) R T) * (r^(2/k) - r^((k+1)/k)))      [kg/(s m^2)],  r = pd/pu

limited from below at the critical ratio. The bracket vanishes linearly at r = 1, so bracket/(1 - r) is
smooth and a polynomial in 1 - r replaces both powers; `MAX_RELATIVE_ERROR` bounds what that costs.
"""

import hashlib
import linecache
import math
from itertools import count
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numba import types
from numba.extending import intrinsic, register_jitable
from numpy.polynomial import Polynomial, chebyshev

FLAGS = {"fastmath": {"nnan", "ninf", "nsz", "contract", "arcp"}, "error_model": "numpy"}

INLINED: Any = {"forceinline": True, "no_cfunc_wrapper": True, **FLAGS}
"""Options of a function that the kernels absorb."""

inlined = register_jitable(**INLINED)
"""Decorator for the small functions that the kernels absorb."""

exact = register_jitable(forceinline=True, no_cfunc_wrapper=True, error_model="numpy")
"""Decorator for functions of numbers that give what NumPy gives, to the bit: nothing is contracted."""


@intrinsic
def wide_vectors(typing_context=None):
    """Let the loops of the calling function use the machine's widest vectors.

    LLVM avoids those of 512 bits, which slowed down the clock of early processors that had them.
    """

    def code(context, builder, signature, arguments):
        # llvmlite lists no attributes with values, but writes them out.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), code


_number = count()


def generated(name: str, arguments: str, body: str, decorator=inlined, **names):
    """An inlined function from source text: one expression per field, so that no field is typed twice.

    LLVM vectorises plain indexing; a loop over the fields of a tuple would go through memory. `inspect`
    finds the text, as the export to C needs it.
    """
    text, file = f"def {name}({arguments}):\n    {body}\n", f"<{name} {next(_number)}>"
    namespace = dict(names)
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    exec(compile(text, file, "exec"), namespace)
    return decorator(namespace[name])


def replacing(kind, *fields: str):
    """Function (q, value of each of `fields` in turn) -> q with these fields replaced.

    What `q._replace` does outside of compiled code.
    """
    items = ", ".join(field if field in fields else f"q.{field}" for field in kind._fields)
    return generated("replace", f"q, {', '.join(fields)}", f"return kind({items})", kind=kind)


def source_digest(*others: Path) -> str:
    """Digest of the plant's sources and of other files.

    Numba's disk cache notices a change in a kernel's own file only. A kernel that closes over this
    digest is compiled anew when any equation it inlines has changed.
    """
    digest = hashlib.sha256()
    for path in sorted({*Path(__file__).parents[1].rglob("*.py"), *others}):
        digest.update(path.read_bytes())
    return digest.hexdigest()


ROUNDING = 1.5 * 2.0**52
"""(x + ROUNDING) - ROUNDING is np.rint(x) below 2^51, since numbers of this size have no fraction. Code
that is compiled for accelerators does not know np.rint."""


QUARTER_PI = 0.7853981633974483
"""pi/4: area of a circle over its squared diameter [-]."""


KAPPA = 1.4
"""Adiabatic exponent of air (Table 5)."""

CRITICAL_RATIO = (2 / (KAPPA + 1)) ** (KAPPA / (KAPPA - 1))
"""Pressure ratio below which the orifice chokes, 0.528."""

LAMINAR_DROP = 5e-4
"""Relative pressure drop 1 - r below which the flux is linear in the drop.

At r = 1 the square root has infinite slope, which no real orifice shows (its flow turns laminar) and
no integrator can follow. Below 0.9995 the flux is the isentropic one."""

MAX_RELATIVE_ERROR = 3e-9
"""Bound on the polynomial's relative error in flux over all r (tests/plant/test_flow.py proves it)."""

_DEGREE = 7
_LARGEST_DROP = 1 - CRITICAL_RATIO


def bracket_over_drop(drop: np.ndarray) -> np.ndarray:
    """2k/(k-1) (r^(2/k) - r^((k+1)/k)) / (1 - r) for drop = 1 - r > 0, exactly [-]."""
    ratio = 1 - np.asarray(drop)
    bracket = ratio ** (2 / KAPPA) - ratio ** ((KAPPA + 1) / KAPPA)
    return 2 * KAPPA / (KAPPA - 1) * bracket / drop


def _fit() -> tuple[float, ...]:
    """Chebyshev interpolation of `bracket_over_drop` on the subcritical range, as plain powers."""
    nodes = (chebyshev.chebpts1(_DEGREE + 1) + 1) / 2 * _LARGEST_DROP
    return tuple(Polynomial.fit(nodes, bracket_over_drop(nodes), _DEGREE).convert().coef.tolist())


_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7 = _fit()


@inlined
def mass_flux(p_a, p_b, inverse_sqrt_RT, drop_share=1.0):
    """Mass flux from side a to side b [kg/(s m^2)]; negative when p_b is the higher pressure.

    p_a, p_b: absolute pressures [Pa], positive. inverse_sqrt_RT: 1/sqrt(R T) upstream [s/m].
    drop_share: what of the drop 1 - r counts; below 1 the orifice chokes at a lower ratio than 0.528.
    """
    upstream = max(p_a, p_b)
    downstream = min(p_a, p_b)
    drop = min(drop_share * (1.0 - downstream / upstream), _LARGEST_DROP)
    bracket = _C0 + drop * (
        _C1 + drop * (_C2 + drop * (_C3 + drop * (_C4 + drop * (_C5 + drop * (_C6 + drop * _C7)))))
    )
    turbulence = min(drop * (1.0 / LAMINAR_DROP), 1.0)
    flux = upstream * inverse_sqrt_RT * math.sqrt(bracket * drop * turbulence)
    return flux if p_a > p_b else -flux


Value: TypeAlias = Any
"""A float inside the kernels and for one valve, an array of one float per valve outside."""
