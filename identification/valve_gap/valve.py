"""A campaign as the diagnosis knows it: screened recordings, and what may be wrong with the model."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from epv_env.plant.effects.law import ARGUMENTS, placed
from epv_env.plant.effects.registry import PLACES
from epv_env.plant.free_parameters import FREE_PARAMETERS
from epv_env.plant.plantfile import Plant
from identification.calibration.problem import calibration_problem
from identification.gap.plant import Cause, Channel, NuisanceParameter, StateTrace
from identification.gap.prepare.screened import Finding, screen
from identification.recordings.noise import coarse_step_warnings, noise_of
from identification.recordings.recording import OUTPUTS, UNITS, Campaign
from identification.replay.equations import law_traces, modelled
from identification.replay.valve import ReplayedValve, as_run
from identification.valve_gap import causes

TIME_SCALE = 5e-3
"""How long the fastest transients last [s]: the armature's flight, the decay of the current."""

CURRENT_TRANSIENT = 2e-3
"""Time between samples [s] in which the current has risen or fallen as good as whole."""

PARAMETER_SCATTER = 3e-3
"""Relative standard deviation, between units, of the parameters that are not calibrated [-]."""


class Valve(ReplayedValve):
    """`GreyBox` for a campaign, with the catalogue of causes."""

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
        recordings = (*problem.calibration, *problem.validation)
        super().__init__(
            recordings,
            problem.vector.reference,
            problem.vector.free_parameters(),
            {name: given.get(name) or noise_of(recordings, name) for name in OUTPUTS},
            problem.steps.get("p2", 0.0),
            found,
        )
        self.plant = plant or Plant.calibrated()
        self.screened = tuple(replace(own, file=f"{own.file}.csv") for own in found)
        self.causes = causes.catalogue(self.base, without, free)
        self.tolerances = tuple(
            NuisanceParameter(symbol=symbol, sd=scatter, centre=self.base[symbol], step=scatter)
            for symbol in causes.PARAMETER_COMPONENTS
            if symbol not in free
            for scatter in [PARAMETER_SCATTER * self.base[symbol]]
        )
        self.warnings = coarse_step_warnings(problem.steps)
        self.run_offsets = (*self.run_offsets, *offsets)
        self.law_arguments = tuple(ARGUMENTS)

    def law_states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.law_states`: traces by name, values (samples,) [SI]."""
        return law_traces(modelled(self.replay.drives[run], self.one(values, run)))

    def law_values(
        self, number: int, cause: Cause, argument: str, low: float, high: float, growth: NDArray
    ) -> dict[str, float]:
        """`GreyBox.law_values`; growth: (knots,)."""
        return placed(number, PLACES[cause.name], argument, low, high, tuple(growth))


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


def _checked_noise(noise: Mapping[str, float]) -> Mapping[str, float]:
    """The noise [SI] by channel as given. Raises ValueError for what is no noise of a channel."""
    for name, deviation in noise.items():
        if name not in OUTPUTS or not 0 < deviation < np.inf:
            raise ValueError(
                f"noise: {deviation:g} for {name!r}: give a positive standard deviation [Pa, A] for "
                f"channels among {', '.join(OUTPUTS)}"
            )
    return noise
