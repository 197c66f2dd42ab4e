"""The valve behind the grey-box protocol: the model on recorded inputs, beside what was read."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.parameters import Parameters
from identification.gap.plant import Cause, Channel, FreeParameter, NuisanceParameter, Run, StateTrace
from identification.gap.prepare.screened import Finding
from identification.noise import rounding_error
from identification.recordings.recording import OUTPUTS, UNITS, Recording
from identification.replay.equations import EQUATIONS, forced_changes, modelled, regimes, traces
from identification.replay.model_inputs import model_inputs
from identification.replay.replay import P2_SHIFT, SHIFTS, Replay, measured_outputs

P2_START = NuisanceParameter(symbol=P2_SHIFT, sd=500.0, step=1e3)
"""Circuit pressure at the start of a recording, less the mean of the hold [Pa]."""
P3_ZERO = NuisanceParameter(symbol="p3_zero", sd=500.0, step=1e3)
"""Zero of the sensor of p3 on the day of a recording [Pa]."""
I_ZERO = NuisanceParameter(symbol="I_zero", sd=4e-4, step=1e-3)
"""Zero of the current sensor on the day of a recording [A]."""


class ReplayedValve:
    """`GreyBox` for recordings of a valve, without causes and tolerances: what a calibration fits."""

    causes: tuple[Cause, ...] = ()
    tolerances: tuple[NuisanceParameter, ...] = ()

    def __init__(
        self,
        recordings: Sequence[Recording],
        base: Parameters,
        parameters: Sequence[FreeParameter],
        noise: Mapping[str, float],
        p2_step: float = 0.0,
        faulty: Sequence[Finding] = (),
    ):
        """Replay recordings that are free of their sensors' offsets.

        Args:
            recordings: what was read.
            base: values of the parameters that a fit does not change [SI].
            parameters: what is calibrated.
            noise: standard deviation of the readings by channel [SI].
            p2_step: coarse step of the readings of p2 [Pa]; 0 for none.
            faulty: readings that do not count.
        """
        self.recordings, self.base = tuple(recordings), base
        self.parameters = tuple(parameters)
        self.channels = tuple(
            Channel(name=name, unit=UNITS[name][0], scale=UNITS[name][1], noise=noise[name])
            for name in OUTPUTS
        )
        self.runs = tuple(as_run(recording, faulty) for recording in recordings)
        # The mean of a hold does not average out coarse steps.
        start_error = float(np.hypot(P2_START.sd, rounding_error(p2_step)))
        self.run_offsets: tuple[NuisanceParameter, ...] = (
            replace(P2_START, sd=start_error),
            P3_ZERO,
            I_ZERO,
        )
        self.equations = EQUATIONS
        self.replay = Replay([model_inputs(r, base) for r in recordings], base)

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: per run an array (3, samples, n) of OUTPUTS [Pa, Pa, A]."""
        plant = {s: v for s, v in values.items() if s in self.base}
        n = max(np.shape(v)[0] for v in values.values())
        start = {s.symbol: np.zeros((n, len(self.runs))) for s in self.run_offsets}
        for symbol in start:
            if symbol in values:
                given = np.asarray(values[symbol])
                start[symbol] = start[symbol] + (given[:, None] if given.ndim == 1 else given)
        shifts = {s: start[s] for s in SHIFTS if s in start}
        found = self.replay.outputs({**plant, **shifts}, runs)
        for run, output in zip(runs, found, strict=True):
            for channel, symbol in (("p3", "p3_zero"), ("I", "I_zero")):
                output[OUTPUTS.index(channel)] += start[symbol][:, run]
        return found

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.states`: traces by name, values (samples,) [SI]."""
        return traces(modelled(self.replay.drives[run], self.one(values, run)))

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: boolean (samples,) by regime; values: (n,) or (n, runs) by symbol [SI]."""
        p = self.one(values, run)
        energised = self.recordings[run].energised
        return regimes(modelled(self.replay.drives[run], p), p, energised)

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """`GreyBox.forced`: changes (3, samples, m) of OUTPUTS [Pa, Pa, A]."""
        return forced_changes(self.replay.drives[run], self.one(values, run), forcing)

    def one(self, values: Mapping[str, NDArray], run: int) -> dict[str, float]:
        """Plant parameters of the first candidate in a run [SI]."""
        first = {s: v[0] for s, v in values.items() if s in self.base}
        return {**self.base, **{s: float(v[run] if np.ndim(v) else v) for s, v in first.items()}}


def as_run(recording: Recording, faulty: Sequence[Finding] = ()) -> Run:
    """A recording as the grey-box protocol has it: signals (3, samples) of OUTPUTS [Pa, Pa, A].

    faulty: readings that do not count, of this and of other recordings.
    """
    measured = measured_outputs(recording)
    trusted = np.ones(measured.shape, dtype=bool)
    switched = np.flatnonzero(np.diff(recording.energised)) + 1
    # An eddy current makes the coil's current jump here: the sample may show either value.
    trusted[OUTPUTS.index("I"), switched] = False
    for own in faulty:
        if own.file == recording.name and own.channel in OUTPUTS:
            trusted[OUTPUTS.index(own.channel), list(own.samples)] = False
    return Run(
        name=recording.name,
        held_out=recording.role == "validation",
        time=recording.time,
        measured=measured,
        trusted=trusted,
        inputs={"U": recording.U, "p1": recording.p1, "sigma_S": recording.sigma_S},
    )
