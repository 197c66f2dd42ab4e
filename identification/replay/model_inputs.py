"""What a recording imposes on the model: voltage, supply pressure, consumption and the start.

The model takes these as known, so their noise would enter its outputs. Where a simple course (a constant
voltage, a supply that loses what the circuit gains) explains a signal but for white noise, it stands in
for the signal.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_smoothing_spline
from scipy.signal import savgol_filter

from identification.noise import differences, is_white, quantisation_step, rounding_error
from identification.recordings.recording import HOLD, Recording

BLOCK = 0.02
"""Length of the blocks over which what remains of a signal must average out [s]."""

SUPPLY_RIPPLE, STEADY = 3.0, 4.0
"""Largest ripple on the reading of p1 that is taken for the sensor's [standard deviations of its white
noise], and largest ratio of its mean squares in the quarters of a recording [1], as it is there at all
times. The model would pass it on to p2 as a true pressure."""


@dataclass(frozen=True, kw_only=True)
class ModelInputs:
    """Inputs of the model for one recording."""

    period: float
    """Time between samples [s]."""
    U: NDArray
    """Coil voltage, (samples,) [V]."""
    p1: NDArray
    """Supply pressure, (samples,) [Pa absolute]."""
    sigma_S: NDArray
    """Air consumed from the circuit, (samples,) [kg/s]."""
    U_start: float
    """Voltage in the steady start, of which I(0) follows [V]."""
    p2_start: float
    """Circuit pressure in the steady start [Pa absolute]."""

    @property
    def p1_start(self) -> float:
        """Supply pressure at the first sample [Pa]."""
        return float(self.p1[0])

    def without_sensor_errors(self, p: Mapping[str, float]) -> "ModelInputs":
        """The inputs as they are where sensors have read them with offset and scale error; p: [SI]."""
        p2_start = (self.p2_start - p["b_p2"]) / (1.0 + p["g_p2"])
        return replace(self, p1=self.p1 / (1.0 + p["g_p1"]), p2_start=p2_start)


def model_inputs(recording: Recording, p: Mapping[str, float]) -> ModelInputs:
    """The inputs that the model is given for a recording; p: volumes and temperature by symbol [SI]."""
    start = slice(0, max(2, round(HOLD / recording.period)))
    # The valve is shut: what is consumed from the first sample on lacks in p2.
    consumed = (
        np.cumsum(recording.sigma_S[start] * recording.period) - recording.sigma_S[0] * recording.period
    )
    lacking = consumed * p["R_gas"] * p["T_env"] / p["V2"]
    return ModelInputs(
        period=recording.period,
        U=smooth_voltage(recording),
        p1=smooth_supply(recording, p),
        sigma_S=recording.sigma_S,
        U_start=float(np.mean(recording.U[start])),
        p2_start=float(np.mean(recording.p2[start] + lacking)),
    )


def smooth_voltage(recording: Recording) -> NDArray:
    """U with each stretch between switchings at its mean, if only noise hides that [V], (samples,)."""
    U = recording.U.copy()
    borders = np.flatnonzero(np.diff(recording.energised)) + 1
    for stretch in np.split(U, borders):  # views: assigning to one changes U
        residual = stretch - np.mean(stretch)
        if len(stretch) > 2 and is_white(residual, round(BLOCK / recording.period)):
            stretch[:] = np.mean(stretch)
    return U


def smooth_supply(recording: Recording, p: Mapping[str, float]) -> NDArray:
    """p1 without its noise [Pa], (samples,).

    Reservoirs lose the air that is drawn from them, by which p1 falls in proportion (R T / V1). Where
    this leaves more than white noise, a ripple and the rounding of coarse readings, because the supply
    has a life of its own, a smoothing spline (generalised cross-validation) takes its place.
    """
    fitted = _air_balance(recording, p)
    residual = recording.p1 - fitted
    # Readings that waver between two codes scatter by up to 1.7 rounding errors, fine steps far more.
    rounding = 1.4 * rounding_error(quantisation_step([recording.p1], fewest=1))
    coarse = np.sqrt(np.mean(residual**2)) <= rounding
    if is_white(residual, round(BLOCK / recording.period)) or coarse or _is_ripple(residual):
        return fitted
    return _spline(recording)


def without_offsets(recording: Recording, offsets: Mapping[str, float]) -> Recording:
    """The recording less its sensors' offsets by channel [SI units]."""
    corrected = {name: recording.channel(name) - offset for name, offset in offsets.items()}
    return replace(recording, **corrected)


def _air_balance(recording: Recording, p: Mapping[str, float]) -> NDArray:
    """Least squares of p1 on a constant, a line in time, and the air drawn so far.

    That is what the circuit holds and has consumed, and what has filled the control chamber [kg].
    """
    # p2 is smoothed over 10 ms before the air drawn from the supply is read off it.
    samples = min(2 * round(0.5 * 0.01 / recording.period) + 1, len(recording) // 2 * 2 - 1)
    p2, p3 = np.asarray(savgol_filter([recording.p2, recording.p3], samples, 1))
    filling = np.cumsum(np.diff(p3, prepend=p3[0]) * recording.energised)
    stored = (p["V2"] * p2 + p["V3"] * filling) / (p["R_gas"] * p["T_env"])
    drawn = stored + np.cumsum(recording.sigma_S) * recording.period
    basis = np.stack([np.ones_like(drawn), recording.time, drawn], axis=1)
    basis /= np.maximum(np.max(np.abs(basis), axis=0), np.finfo(float).tiny)
    return basis @ np.linalg.lstsq(basis, recording.p1, rcond=None)[0]


def _is_ripple(residual: NDArray) -> bool:
    """Whether a residual is a small ripple that is there at all times."""
    squares = [float(np.mean(part**2)) for part in np.array_split(residual, 4)]
    white = float(np.mean(differences(residual, 1) ** 2))
    small = sum(squares) / len(squares) <= SUPPLY_RIPPLE**2 * white
    return small and max(squares) <= STEADY * min(squares)


def _spline(recording: Recording) -> NDArray:
    """Smoothing spline through means of a few samples each, which keep it cheap.

    Its search for the least cross-validation error needs knots about 1 apart.
    """
    every = max(1, round(0.1 * BLOCK / recording.period))
    count = len(recording) // every
    means = recording.p1[: count * every].reshape(count, every).mean(axis=1)
    spline = make_smoothing_spline(np.arange(count), means - means[0])
    return spline((np.arange(len(recording)) - 0.5 * (every - 1)) / every) + means[0]
