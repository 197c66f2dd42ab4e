"""The bench's right-hand side: the plant's equations with deviating and other forms of the effects."""

import hashlib
from collections.abc import Collection
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects.coil import coil_current
from epv_env.plant.effects.registry import Effects
from epv_env.plant.equations import State, derivative
from epv_env.plant.lanes import coefficients_at, effects_at, inputs_at, state_at, store_state
from epv_env.plant.primitives import FLAGS, replacing, source_digest
from identification.bench.hybrid_automaton import RightHandSide
from identification.studies.blind import deviating_forms, other_forms
from identification.studies.blind.deviating_forms import IRON_TIME_CONSTANT, deviating_sizes, film_rate
from identification.studies.blind.other_forms import (
    INSTANT_DROP,
    LANGEVIN,
    OTHER_FORMS,
    instant_drop,
    langevin_current_rate,
    langevin_size,
)

_with_supply_drop = replacing(State, "supply_drop")
_with_saturation = replacing(Effects, "saturation")
_with_rates = replacing(State, "vMV", "coil_heat", "I", "supply_drop")


def _digest() -> str:
    """Of every source that the kernels inline: Numba's cache sees changes of this file only."""
    digest = hashlib.sha256(source_digest().encode())
    for module in (deviating_forms, other_forms):
        digest.update(Path(module.__file__ or "").read_bytes())
    return digest.hexdigest()


def _compile(digest: str):
    """Rates and terminal currents as compiled functions; a changed digest compiles them anew."""

    @numba.njit(cache=True, **FLAGS)
    def rates_and_forces(y, u, c, e, free_PV, free_MV, d, instant, langevin):
        out = np.empty(y.size + 2)
        if digest == "":
            return out
        q, inputs = state_at(y.reshape(-1, 1), 0, 0), inputs_at(u.reshape(-1, 1), 0, 0)
        valve, fitted = coefficients_at(c, 0, 0), effects_at(e, 0, 0)
        if instant:
            q = _with_supply_drop(q, instant_drop(q, inputs, valve, fitted, d))
        deviating = deviating_sizes(q, inputs, valve, fitted, d)
        size = langevin_size(q, valve, deviating) if langevin else deviating.saturation
        sizes = _with_saturation(deviating, size)
        rates, force_PV, force_MV = derivative(q, inputs, valve, sizes, free_PV, free_MV, True)
        slowed = rates.vMV - d * film_rate(q, valve) * q.vMV * free_MV
        cooled = rates.coil_heat - d * q.coil_heat / IRON_TIME_CONSTANT
        current = rates.I
        if langevin:
            current = langevin_current_rate(q, valve, deviating, size, current)
        dropping = 0.0 if instant else rates.supply_drop
        store_state(out.reshape(-1, 1), 0, 0, _with_rates(rates, slowed, cooled, current, dropping))
        out[-2], out[-1] = force_PV, force_MV
        return out

    @numba.njit(cache=True, **FLAGS)
    def currents(states, u, c, e, d):
        out = np.empty(states.shape[1])
        if digest == "":
            return out
        valve, fitted = coefficients_at(c, 0, 0), effects_at(e, 0, 0)
        for k in range(out.size):
            q, inputs = state_at(states, 0, k), inputs_at(u, 0, k)
            sizes = deviating_sizes(q, inputs, valve, fitted, d)
            out[k] = coil_current(inputs.U, q.I, valve.R, q.coil_heat, sizes)
        return out

    return rates_and_forces, currents


_rates_and_forces, _terminal_currents = _compile(_digest())


def right_hand_side(form_deviation: float, forms: Collection[str] = ()) -> RightHandSide:
    """The plant with effects of the bench's forms, for `simulate_reference`.

    Args:
        form_deviation: share by which the forms deviate [-].
        forms: effects that have their other form.

    Raises:
        ValueError: an effect has no other form.
    """
    strange = sorted(set(forms) - set(OTHER_FORMS))
    if strange:
        raise ValueError(
            f"{strange[0]} has no other form: choose among {', '.join(OTHER_FORMS)}, or add the form to "
            "other_forms.py"
        )
    instant, langevin = INSTANT_DROP in forms, LANGEVIN in forms

    def rates_and_forces(y, u, c, e, free_PV, free_MV):
        return _rates_and_forces(y, u, c, e, free_PV, free_MV, form_deviation, instant, langevin)

    return rates_and_forces


def terminal_currents(
    states: NDArray, inputs: NDArray, c: NDArray, e: NDArray, form_deviation: float
) -> NDArray:
    """Currents at the coil's terminals [A], (samples,), where eddy currents deviate as well.

    Args:
        states: fields of State [SI], (fields, samples).
        inputs: fields of Inputs [SI], (fields, samples).
        c: coefficients of one valve, as `coefficients` gives them.
        e: sizes of its effects, as `effect_constants` gives them.
        form_deviation: relative deviation of the forms [-].
    """
    return _terminal_currents(states, inputs, c, e, form_deviation)
