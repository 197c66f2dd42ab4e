"""Which parameters a calibration fits, between which bounds, and what is known of them before."""

import math
from collections.abc import Mapping

import msgspec

from epv_env.plant.effects.law import SYMBOLS
from epv_env.plant.parameters import ParameterError, Parameters, table
from epv_env.plant.region import CALIBRATED_SYMBOLS


class Freedom(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, forbid_unknown_fields=True):
    """How far a calibration may move one parameter."""

    bounds: tuple[float, float] | None = None
    """Least and greatest estimate [SI]; None: the parameter's domain."""
    mean: float | None = None
    """What a data sheet or an earlier measurement says [SI]; None: nothing is known."""
    sd: float | None = None
    """Standard deviation of that knowledge [SI]; given with `mean`."""


FREE_PARAMETERS: Mapping[str, Freedom] = dict.fromkeys(CALIBRATED_SYMBOLS, Freedom())
"""The report's four, within their domains and without prior knowledge."""


def check_free(free: Mapping[str, Freedom], parameters: Parameters) -> None:
    """Raises ParameterError for parameters that cannot be fitted as described.

    free: by symbol. parameters: where the calibration starts.
    """
    if not free:
        raise ParameterError("free names no parameter: leave it out, or name what is to be calibrated")
    rows = table().items()
    movable = [s for s, row in rows if row.domain and row.group != "environment" and s not in SYMBOLS]
    for symbol, freedom in free.items():
        if symbol not in movable:
            raise ParameterError(f"free.{symbol} cannot be calibrated: choose from {', '.join(movable)}")
        low, high = freedom.bounds or parameters.domain(symbol)
        _check_bounds(symbol, (low, high), parameters)
        _check_prior(symbol, freedom, (low, high))


def _check_bounds(symbol: str, bounds: tuple[float, float], parameters: Parameters) -> None:
    (low, high), (least, greatest), start = bounds, parameters.domain(symbol), parameters[symbol]
    if not least <= low < high <= greatest:
        raise ParameterError(
            f"free.{symbol}.bounds [{low:g}, {high:g}] must lie in the domain [{least:g}, "
            f"{greatest:g}]: give low < high inside, or widen the domain"
        )
    if not low <= start <= high:
        raise ParameterError(
            f"free.{symbol}.bounds [{low:g}, {high:g}] do not hold the start, parameters.{symbol} = "
            f"{start:g}: widen the bounds or start inside"
        )
    if start == 0:
        raise ParameterError(
            f"free.{symbol} starts at 0, from which a relative change leads nowhere: start elsewhere"
        )


def _check_prior(symbol: str, freedom: Freedom, bounds: tuple[float, float]) -> None:
    mean, sd, (low, high) = freedom.mean, freedom.sd, bounds
    if (mean is None) != (sd is None):
        raise ParameterError(f"free.{symbol} has one of mean and sd: give both or none")
    if mean is None or sd is None:
        return
    if not low <= mean <= high or not 0 < sd < math.inf:
        raise ParameterError(
            f"free.{symbol} has mean {mean:g} and sd {sd:g}: give a mean within the bounds "
            f"[{low:g}, {high:g}] and a positive standard deviation"
        )
