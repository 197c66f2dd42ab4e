"""How plant code is compiled: one place for the flags, the inlining and the cache key.

`fast` arithmetic (fused multiply-add, reciprocals) is safe for reproducibility because every lane of
every batch runs through the very same machine code: see integrate.LANES.
"""

import hashlib
from pathlib import Path

import numba
from numba import types
from numba.extending import intrinsic

FLAGS = {"fastmath": {"nnan", "ninf", "nsz", "contract", "arcp"}, "error_model": "numpy"}

inlined = numba.njit(forceinline=True, **FLAGS)
"""Decorator for the small functions that the kernels absorb."""

exact = numba.njit(forceinline=True, error_model="numpy")
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


def generated(name: str, arguments: str, body: str, decorator=inlined, **names):
    """An inlined function from source text: one expression per field, so that no field is typed twice.

    LLVM vectorises plain indexing; a loop over the fields of a tuple would go through memory.
    """
    namespace = dict(names)
    exec(f"def {name}({arguments}):\n    {body}\n", namespace)
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
