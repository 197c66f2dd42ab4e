"""Global sensitivity of the total error: all parameters change at once (Sobol).

Each parameter is uniform over half the change of Tables 8 and 9: +-5 %, a1 over half its domain. With
+-10 % of all parameters at once, 1 % of the valves no longer pull their armature in at the study's
18.9 V, and those few, 90 % off, would dominate the variance; over the domains it is far more of them.
Samples and estimators are SALib's (Iwanaga, Usher and Herman, 2022; Saltelli et al. 2010).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from SALib.analyze import sobol as sobol_analysis
from SALib.sample import sobol as sobol_sample

from identification.sensitivity.one_at_a_time import changed_values, total_errors

RESAMPLES = 1000
"""Draws of the bootstrap intervals."""

SPAN = 0.5
"""Part of the change of Tables 8 and 9 over which the parameters vary together."""

BATCH = 512
"""Valves simulated together; the record of 512 takes 100 MB."""

Model = Callable[[NDArray], NDArray]
"""Parameter sets (samples, parameters) [SI] -> outputs (samples,)."""


@dataclass(frozen=True, kw_only=True)
class SobolIndices:
    """Sobol's indices: shares of the output's variance, (parameters,) each."""

    symbols: tuple[str, ...]
    first: NDArray
    """Explained by the parameter alone."""
    first_half_width: NDArray
    """Of the bootstrap 95 % interval."""
    total: NDArray
    """Lost if the parameter were known: alone and together with others."""
    total_half_width: NDArray
    """Of the bootstrap 95 % interval."""


def ranges(nominal: Mapping[str, float], symbols: Sequence[str]) -> NDArray:
    """Least and greatest value of each parameter [SI], (parameters, 2)."""
    rows = [changed_values(symbol, nominal[symbol]) for symbol in symbols]
    centre = np.array([[nominal[symbol]] for symbol in symbols])
    return centre + SPAN * (np.array(rows) - centre)


def total_error_model(nominal: Mapping[str, float], symbols: Sequence[str]) -> Model:
    """Total error (eq. 21) against the nominal model in percent, as a function of parameter sets."""

    def model(samples: NDArray) -> NDArray:
        pieces = [samples[at : at + BATCH] for at in range(0, len(samples), BATCH)]
        return np.concatenate([_errors(nominal, symbols, piece) for piece in pieces])

    return model


def _errors(nominal: Mapping[str, float], symbols: Sequence[str], samples: NDArray) -> NDArray:
    p = {symbol: np.full(1 + len(samples), value) for symbol, value in nominal.items()}
    for symbol, column in zip(symbols, samples.T, strict=True):
        p[symbol][1:] = column
    return 100 * total_errors(p)


def sobol_indices(
    model: Model,
    symbols: Sequence[str],
    bounds: NDArray,
    *,
    samples: int,
    seed: int,
) -> SobolIndices:
    """Sobol's first-order and total indices: samples x (parameters + 2) evaluations.

    samples: a power of two. bounds: (parameters, 2) [SI].
    """
    problem = {"num_vars": len(symbols), "names": list(symbols), "bounds": bounds.tolist()}
    drawn = sobol_sample.sample(problem, samples, calc_second_order=False, seed=seed)
    indices = sobol_analysis.analyze(
        problem,
        model(drawn),
        calc_second_order=False,
        num_resamples=RESAMPLES,
        seed=np.random.SeedSequence(seed),  # SALib takes the number 0 for "no seed"
    )
    return SobolIndices(
        symbols=tuple(symbols),
        first=np.asarray(indices["S1"]),
        first_half_width=np.asarray(indices["S1_conf"]),
        total=np.asarray(indices["ST"]),
        total_half_width=np.asarray(indices["ST_conf"]),
    )
