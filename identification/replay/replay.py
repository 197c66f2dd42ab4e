"""The model on recorded inputs: every recording and every candidate of the parameters in one batch.

In reports: tables of the errors, and the responses over time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from epv_env.plant.channels import readings
from epv_env.plant.effects.registry import effect_constants, kernel_of
from epv_env.plant.equations import Inputs, State
from epv_env.plant.parameters import Parameters
from epv_env.plant.simulate import energised
from epv_env.plant.valves import Valves
from identification.recordings.recording import OUTPUTS, UNITS, Recording
from identification.replay.model_inputs import ModelInputs, model_inputs
from identification.report.page import Picture, Table, over_time
from identification.report_2003 import partial_error, relative_error, total_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST_BATCH = 1_500_000
"""Samples times valves that are simulated at once: about 40 MB of outputs."""

P2_SHIFT, FLOW_SHIFT, FLOW_RAMP = SHIFTS = "p2_start", "consumption", "consumption_ramp"
"""What a candidate may change of a recording: p2 at the start [Pa], the air consumed [kg/s], and its
change from the first sample to the last [kg/s], about the middle."""


class Replay:
    """Simulates recordings under candidate parameters."""

    def __init__(self, drives: Sequence[ModelInputs], base: Parameters):
        """base: values of the parameters that the candidates do not change [SI]."""
        self.drives = list(drives)
        self.base = base

    def outputs(
        self,
        candidates: Mapping[str, NDArray],
        which: Sequence[int] | None = None,
    ) -> list[NDArray]:
        """Model outputs of n candidates for each recording.

        Args:
            candidates: values by symbol [SI], (n,), or (n, recordings) where recordings differ;
                SHIFTS are added to what the recordings have.
            which: indices of the recordings, None for all.

        Returns per recording an array (3, samples, n) of OUTPUTS [Pa, Pa, A]; NaN where a candidate
        cannot be integrated.
        """
        chosen = range(len(self.drives)) if which is None else which
        n = max(np.shape(value)[0] for value in candidates.values())
        each = {shift: np.zeros(n) for shift in SHIFTS}
        each |= {s: np.asarray(value) for s, value in candidates.items()}
        largest = {s: v if v.ndim == 1 else np.max(np.abs(v), axis=1) for s, v in each.items()}
        kernel = np.broadcast_to(kernel_of(effect_constants({**self.base, **largest})), n)
        needed = np.unique(kernel)
        if len(needed) == 1:
            return self._outputs(each, n, chosen)
        answers = [np.empty((len(OUTPUTS), len(self.drives[r].U), n)) for r in chosen]
        for part in (kernel == number for number in needed):
            own = self._outputs({s: v[part] for s, v in each.items()}, int(np.sum(part)), chosen)
            for whole, some in zip(answers, own, strict=True):
                whole[:, :, part] = some
        return answers

    def _outputs(self, each: Mapping[str, NDArray], n: int, chosen: Sequence[int]) -> list[NDArray]:
        """`outputs` of candidates that one kernel can simulate."""
        answers: list[NDArray] = []
        for group in self._groups(n, chosen):
            # Values (n,) or (n, all recordings) in the order of the batch's lanes.
            lanes = {
                s: np.tile(v, len(group)) if v.ndim == 1 else v[:, group].T.ravel()
                for s, v in each.items()
            }
            drives, p = [self.drives[r] for r in group], {**self.base, **lanes}
            answers += _simulate(drives, p, n)
        return answers

    def _groups(self, n: int, chosen: Sequence[int]) -> list[list[int]]:
        """Consecutive recordings that fit into one batch together."""
        groups: list[list[int]] = [[]]
        longest = 0
        for index in chosen:
            longest = max(longest, len(self.drives[index].U))
            if groups[-1] and longest * n * (len(groups[-1]) + 1) > LARGEST_BATCH:
                groups.append([])
                longest = len(self.drives[index].U)
            groups[-1].append(index)
        return groups


def measured_outputs(recording: Recording) -> NDArray:
    """OUTPUTS of a recording, (3, samples) [Pa, Pa, A]."""
    return np.stack([recording.channel(output) for output in OUTPUTS])


@dataclass(frozen=True, kw_only=True)
class Response:
    """One recording and the model's response to its inputs."""

    recording: Recording
    measured: NDArray
    """OUTPUTS, (3, samples) [Pa, Pa, A]."""
    model: NDArray
    """OUTPUTS of the model, (3, samples) [Pa, Pa, A]."""

    @property
    def errors(self) -> dict[str, float]:
        """Eq. 19 by output, as fractions."""
        time = self.recording.time
        pairs = zip(OUTPUTS, self.measured, self.model, strict=True)
        return {output: float(relative_error(y, model, time)) for output, y, model in pairs}

    @property
    def partial(self) -> float:
        """Eq. 20, as a fraction."""
        return float(partial_error([np.array(error) for error in self.errors.values()]))


def responses(recordings: Sequence[Recording], parameters: Parameters) -> list[Response]:
    """The model's responses from each recording's steady start; nothing is fitted. parameters: [SI]."""
    replay = Replay([model_inputs(recording, parameters) for recording in recordings], parameters)
    one = {"R": np.array([parameters["R"]])}
    return [
        Response(recording=recording, measured=measured_outputs(recording), model=model[:, :, 0])
        for recording, model in zip(recordings, replay.outputs(one), strict=True)
    ]


def total_response_error(responses: Sequence[Response]) -> float:
    """Eq. 21, as a fraction."""
    return float(total_error([np.array(response.partial) for response in responses]))


def _simulate(drives: list[ModelInputs], tiled: dict[str, ArrayLike], n: int) -> list[NDArray]:
    """One batch: lane r n + j is candidate j on recording r.

    tiled: parameters and shifts by lane.
    """
    p2_shift, flow_shift, flow_ramp = (np.asarray(tiled.pop(shift)) for shift in SHIFTS)
    p1, U, p2 = (
        np.repeat([getattr(drive, name) for drive in drives], n, axis=0)
        for name in ("p1_start", "U_start", "p2_start")
    )
    # What was recorded is what the sensors read.
    supply = 1.0 / (1.0 + np.asarray(tiled["g_p1"]))
    p2 = (p2 - tiled["b_p2"]) / (1.0 + np.asarray(tiled["g_p2"]))
    initial = energised(tiled, p1=p1 * supply, p2=p2 + p2_shift, U=U)
    valves = Valves.started(n * len(drives), tiled, initial)
    inputs, duration = _inputs(drives)
    steps = len(duration)
    outputs = np.empty((len(OUTPUTS), 1 + steps, valves.n))
    outputs[:, 0] = _read(valves.state, tiled)
    # A delayed voltage needs the whole record at once; else states stay in the processor's cache.
    together = steps if np.any(tiled["t_delay"]) else 100
    for first in range(0, steps, max(together, 1)):
        part = slice(first, first + together)
        own = {name: np.repeat(field[part], n, axis=1) for name, field in inputs.items()}
        own["p1_slope"] = own["p1_slope"] * supply
        own["sigma_S"] = own["sigma_S"] + flow_shift + flow_ramp * own.pop("course")
        every = Inputs(**own)
        states = valves.record(every, np.repeat(duration[part], n, axis=1))
        outputs[:, 1 + first : 1 + first + together] = _read(states, tiled)
    return [outputs[:, : len(drive.U), r * n : (r + 1) * n] for r, drive in enumerate(drives)]


def _read(state: State, p: Mapping[str, ArrayLike]) -> NDArray:
    """OUTPUTS as the sensors see them, (3, samples, lanes)."""
    read = readings(state, p)
    return np.stack([read[output] for output in OUTPUTS])


def _inputs(drives: list[ModelInputs]) -> tuple[dict[str, NDArray], NDArray]:
    """Inputs, course from -1/2 to 1/2, and length of each period, (longest - 1, recordings) each.

    They are 0 past a recording's end.
    """
    steps = max(len(drive.U) for drive in drives) - 1
    table = np.zeros((5, steps, len(drives)))
    for r, drive in enumerate(drives):
        own = slice(0, len(drive.U) - 1)
        table[0, own, r] = drive.U[:-1]
        table[1, own, r] = drive.sigma_S[:-1]
        table[2, own, r] = np.diff(drive.p1) / drive.period
        table[3, own, r] = np.linspace(-0.5, 0.5, len(drive.U))[:-1]
        table[4, own, r] = drive.period
    U, sigma_S, p1_slope, course, period = table
    return {
        "U": U,
        "sigma_S": sigma_S,
        "p1_slope": p1_slope,
        "refill": 0.0 * U,
        "course": course,
    }, period


def error_table(responses: Sequence[Response], caption: str) -> Table:
    """Eqs 19 and 20 by recording, and eq. 21 over all."""
    rows = [
        [response.recording.name, *map(percent, response.errors.values()), percent(response.partial)]
        for response in responses
    ]
    if len(responses) > 1:
        rows.append(["all (eps_total)", "", "", "", percent(total_response_error(responses))])
    return Table(
        columns=["Case", *(f"eps_{output} [%]" for output in OUTPUTS), "eps_partial [%]"],
        rows=rows,
        caption=f"{caption} Mean distance of model and recording, in percent of the recording's mean.",
    )


def errors_as_json(responses: Sequence[Response]) -> Mapping[str, Any]:
    """The same in percent, with the field names of the report's tables."""
    errors: dict[str, Any] = {
        response.recording.name: {
            **{f"eps_{output}": 100 * error for output, error in response.errors.items()},
            "eps_partial": 100 * response.partial,
        }
        for response in responses
    }
    return {**errors, "eps_total": 100 * total_response_error(responses)}


def percent(fraction: float) -> str:
    """A fraction as the report prints errors, in percent."""
    return f"{100 * fraction:.4f}"


def response_figure(response: Response) -> "Figure":
    """Voltage, and the measured outputs with the model's over them (Figures 10 to 14)."""
    rows = {"U [V]": {"voltage": response.recording.U}}
    for output, measured, model in zip(OUTPUTS, response.measured, response.model, strict=True):
        unit, size = UNITS[output]
        rows[f"{output} [{unit}]"] = {"measured": measured / size, "model": model / size}
    return over_time(response.recording.time, rows, [0.6, 1.0, 1.0, 1.0])


def worst_picture(responses: Sequence[Response]) -> Picture:
    """The response with the greatest partial error (eq. 20)."""
    worst = max(responses, key=lambda response: response.partial)
    caption = f"The recording with the greatest error: {worst.recording.name}."
    return Picture(figure=response_figure(worst), caption=caption)
