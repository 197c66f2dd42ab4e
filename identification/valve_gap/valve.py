"""The valve behind the grey-box protocol: replayed recordings, and what may be wrong with the model."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects.law import ARGUMENTS, placed
from epv_env.plant.effects.registry import PLACES
from epv_env.plant.free_parameters import FREE_PARAMETERS
from epv_env.plant.plantfile import Plant
from identification.calibration.problem import calibration_problem
from identification.gap.plant import Cause, Channel, NuisanceParameter, Run, StateTrace
from identification.gap.prepare.screened import Finding, screen
from identification.readings_noise import rounding_error
from identification.recordings.noise import coarse_step_warnings, noise_of
from identification.recordings.recording import OUTPUTS, UNITS, Campaign, Recording
from identification.replay.model_inputs import model_inputs
from identification.replay.replay import P2_SHIFT, SHIFTS, Replay, measured_outputs
from identification.valve_gap import causes
from identification.valve_gap.equations import (
    EQUATIONS,
    forced_changes,
    law_traces,
    modelled,
    regimes,
    traces,
)

TIME_SCALE = 5e-3
"""How long the fastest transients last [s]: the armature's flight, the decay of the current."""

CURRENT_TRANSIENT = 2e-3
"""Time between samples [s] in which the current has risen or fallen as good as whole."""

PARAMETER_SCATTER = 3e-3
"""Relative standard deviation, between units, of the parameters that are not calibrated [-]."""

P2_START = NuisanceParameter(symbol=P2_SHIFT, sd=500.0, step=1e3)
"""Circuit pressure at the start of a recording, less the mean of the hold [Pa]."""
P3_ZERO = NuisanceParameter(symbol="p3_zero", sd=500.0, step=1e3)
"""Zero of the sensor of p3 on the day of a recording [Pa]."""
I_ZERO = NuisanceParameter(symbol="I_zero", sd=4e-4, step=1e-3)
"""Zero of the current sensor on the day of a recording [A]."""


class Valve:
    """`GreyBox` for a campaign."""

    def __init__(
        self,
        campaign: Campaign,
        plant: Plant | None = None,
        without: Sequence[str] = (),
        noise: Mapping[str, float] | None = None,
        offsets: Sequence[NuisanceParameter] = (),
    ):
        """Prepare a campaign for the diagnosis.

        Args:
            campaign: its calibration and validation recordings.
            plant: the nominal parameters, and those that calibration fits; None: Table 10's four.
            without: names of causes to leave out.
            noise: standard deviation of the readings by channel [Pa, A], where it is known better than
                from the recordings; the others are estimated from them.
            offsets: what else has a value of its own in each recording.

        Raises:
            ValueError: the catalogue does not have a cause of `without`, or `noise` has another channel
                or a value that is not positive.
        """
        self.time_scale = TIME_SCALE
        given = _checked_noise(noise or {})
        start, free = (plant.parameters, plant.free) if plant else (None, FREE_PARAMETERS)
        campaign, found = _screened(campaign)
        problem = calibration_problem(campaign, start=start, free=free)
        self.plant = plant or Plant.calibrated()
        self.base = problem.vector.reference
        self.recordings = (*problem.calibration, *problem.validation)
        self.channels = tuple(
            Channel(
                name=name,
                unit=UNITS[name][0],
                scale=UNITS[name][1],
                noise=given.get(name) or noise_of(self.recordings, name),
            )
            for name in OUTPUTS
        )
        self.runs = tuple(as_run(recording, found) for recording in self.recordings)
        self.screened = tuple(replace(own, file=f"{own.file}.csv") for own in found)
        self.parameters = tuple(causes.calibrated(problem.vector))
        self.causes = causes.catalogue(self.base, without, free)
        self.tolerances = tuple(
            NuisanceParameter(symbol=symbol, sd=scatter, centre=self.base[symbol], step=scatter)
            for symbol in causes.PARAMETER_COMPONENTS
            if symbol not in free
            for scatter in [PARAMETER_SCATTER * self.base[symbol]]
        )
        self.warnings = coarse_step_warnings(problem.steps)
        # The mean of a hold does not average out coarse steps.
        start_error = np.hypot(P2_START.sd, rounding_error(problem.steps.get("p2", 0.0)))
        self.run_offsets = (replace(P2_START, sd=float(start_error)), P3_ZERO, I_ZERO, *offsets)
        self.equations = EQUATIONS
        self.law_arguments = tuple(ARGUMENTS)
        self.replay = Replay([model_inputs(r, self.base) for r in self.recordings], self.base)

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
        return traces(modelled(self.replay.drives[run], self._one(values, run)))

    def law_states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.law_states`: traces by name, values (samples,) [SI]."""
        return law_traces(modelled(self.replay.drives[run], self._one(values, run)))

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: boolean (samples,) by regime; values: (n,) or (n, runs) by symbol [SI]."""
        p = self._one(values, run)
        energised = self.recordings[run].energised
        return regimes(modelled(self.replay.drives[run], p), p, energised)

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """`GreyBox.forced`: changes (3, samples, m) of OUTPUTS [Pa, Pa, A]."""
        return forced_changes(self.replay.drives[run], self._one(values, run), forcing)

    def law_values(
        self, number: int, cause: Cause, argument: str, low: float, high: float, growth: NDArray
    ) -> dict[str, float]:
        """`GreyBox.law_values`; growth: (knots,)."""
        return placed(number, PLACES[cause.name], argument, low, high, tuple(growth))

    def _one(self, values: Mapping[str, NDArray], run: int) -> dict[str, float]:
        """Plant parameters of the first candidate in a run."""
        first = {s: v[0] for s, v in values.items() if s in self.base}
        return {**self.base, **{s: float(v[run] if np.ndim(v) else v) for s, v in first.items()}}


def _screened(campaign: Campaign) -> tuple[Campaign, tuple[Finding, ...]]:
    """The campaign with straight lines across its faulty readings, and these."""
    channels = [Channel(name=name, unit=UNITS[name][0], scale=UNITS[name][1]) for name in OUTPUTS]
    raw = [as_run(recording) for recording in campaign.recordings]
    for run, recording in zip(raw, campaign.recordings, strict=True):
        if recording.period > CURRENT_TRANSIENT:  # a switching looks like a wild reading
            run.trusted[OUTPUTS.index("I")] = False
    runs, found = screen(raw, channels)
    recordings = tuple(
        replace(recording, **dict(zip(OUTPUTS, run.measured, strict=True)), **run.inputs)
        for recording, run in zip(campaign.recordings, runs, strict=True)
    )
    return replace(campaign, recordings=recordings), found


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


def _checked_noise(noise: Mapping[str, float]) -> Mapping[str, float]:
    """The noise [SI] by channel as given. Raises ValueError for what is no noise of a channel."""
    for name, deviation in noise.items():
        if name not in OUTPUTS or not 0 < deviation < np.inf:
            raise ValueError(
                f"noise: {deviation:g} for {name!r}: give a positive standard deviation [Pa, A] for "
                f"channels among {', '.join(OUTPUTS)}"
            )
    return noise
