"""What the examples with other people's recordings share: data, disturbances, pictures, command."""

import argparse
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from epv_env.common.command_line import writable_folder
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.fit.prediction import predict
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Cause, FreeParameter, Run
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.report.figures import comparison_figure
from identification.gap.report.gap_json import write_results
from identification.gap.report.page import sections
from identification.gap.report.sentences import verdict_sentence
from identification.report.page import write_page

NOISE_FACTORS = {"sigma=0.3": 0.3, "sigma=3": 3.0}
"""Factors by which the noise is stated too small or too large [1]."""

RIPPLE = "ripple"
DISTURBANCES = (*NOISE_FACTORS, RIPPLE)

RIPPLE_SIZE = 2.0
"""Standard deviation of the ripple [noise deviations]."""

RIPPLE_PERIODS = 10.0
"""Sampling periods in which the autocorrelation of the ripple falls to 1/e [1]."""


def disturbed(plant: OdePlant, disturbance: str, seed: int) -> OdePlant:
    """The plant with one of DISTURBANCES; its noise is the given one, or what its readings show.

    seed: of the ripple, an Ornstein-Uhlenbeck process on every channel.
    """
    noise = [channel.known_noise for channel in prepared(plant).channels]
    other = copy(plant)
    if disturbance in NOISE_FACTORS:
        factor = NOISE_FACTORS[disturbance]
        other.channels = tuple(
            replace(channel, noise=factor * known)
            for channel, known in zip(plant.channels, noise, strict=True)
        )
        return other
    rng, memory = np.random.default_rng(seed), np.exp(-1.0 / RIPPLE_PERIODS)
    runs = []
    for run in plant.runs:
        white = rng.standard_normal(run.measured.shape)
        white[:, 1:] *= np.sqrt(1.0 - memory**2)
        ripple = lfilter([1.0], [1.0, -memory], white)
        size = RIPPLE_SIZE * np.array(noise)[:, None]
        runs.append(replace(run, measured=run.measured + size * ripple))
    other.runs = tuple(runs)
    return other


def found(path: Path, source: str) -> Path:
    """The path. Raises FileNotFoundError with the data's source where it does not exist."""
    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist: get the recordings from {source}")
    return path


def run_of(
    name: str,
    period: float,
    measured: NDArray,
    inputs: dict[str, NDArray],
    held_out: bool,
    begin: int = 0,
) -> Run:
    """A recording whose readings (channels, samples) count from the sample `begin` on.

    period: of sampling [s]. inputs: by name, (samples,).
    """
    trusted = np.isfinite(measured)
    trusted[:, :begin] = False
    return Run(
        name=name,
        held_out=held_out,
        time=period * np.arange(measured.shape[1]),
        measured=measured,
        trusted=trusted,
        inputs=inputs,
    )


def cause(
    name: str,
    component: str,
    unit: str,
    trials: tuple[float, ...],
    ends: tuple[float, float],
    nominal: float = 0.0,
) -> Cause:
    """A cause with one size of the same name, which is `nominal` where the cause does not act."""
    low, high = ends
    size = FreeParameter(
        symbol=name,
        unit=unit,
        low=low,
        high=high,
        nominal=nominal,
        trials=trials,
        scale=abs(trials[0] - nominal),
    )
    return Cause(name=name, component=component, parameters=(size,))


def command(title: str, name: str, plant_of: Callable[[Path], OdePlant]) -> int:
    """Diagnose the recordings in --data: gap.json, report.html and the verdict; returns the status.

    title: of the plant, for the report. name: of its picture. plant_of: from the folder of recordings.
    """
    parser = argparse.ArgumentParser(description=f"Why a model of {title} misses its recordings.")
    parser.add_argument("--data", type=Path, required=True, help="folder of the recordings")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--seed", type=int, default=0, help="of resampling")
    parser.add_argument(
        "--without", nargs="+", default=[], metavar="CAUSE", help="causes to leave out of the catalogue"
    )
    parser.add_argument(
        "--with", nargs="+", default=[], metavar="CAUSE", dest="added",
        help="causes to make part of the model, calibrated like the rest of it",
    )  # fmt: skip
    parser.add_argument(
        "--disturb", choices=DISTURBANCES,
        help="state 0.3 or three times the noise, or add a ripple of twice the noise",
    )  # fmt: skip
    parser.add_argument("--images", type=writable_folder, help="folder of recorded-NAME.png")
    chosen = parser.parse_args()
    plant = changed(plant_of(chosen.data), without=chosen.without, added=chosen.added)
    plant = disturbed(plant, chosen.disturb, chosen.seed) if chosen.disturb else plant
    diagnosis = diagnose(plant, seed=chosen.seed)
    write_results(diagnosis, chosen.out)
    heading = f"Gap between model and recordings: {title}"
    write_page(chosen.out / "report.html", title=heading, sections=sections(diagnosis))
    if chosen.images:
        chosen.images.mkdir(parents=True, exist_ok=True)
        path = chosen.images / f"recorded-{name}.png"
        comparison_figure(diagnosis, every_channel=True).savefig(path, dpi=100, bbox_inches="tight")
    print(verdict_sentence(diagnosis)[1])
    print(held_out_errors(diagnosis))
    return 0


def held_out_errors(diagnosis: Diagnosis) -> str:
    """Root mean square errors on recordings never fitted to, of all channels together, in a sentence."""
    ranking, plant = diagnosis.ranking, diagnosis.ranking.problem.plant
    models = {"nominal": diagnosis.nominal.estimate, "recalibrated": ranking.recalibrated.estimate}
    if diagnosis.best:
        models[" + ".join(diagnosis.best.effects)] = diagnosis.best.hypothesis.estimate
    noise = np.array([channel.known_noise / channel.scale for channel in plant.channels])[:, None]
    errors = []
    for label, estimate in models.items():
        residuals = predict(ranking.problem, estimate).residuals
        held_out = [
            (noise * residual)[run.trusted]
            for residual, run in zip(residuals, plant.runs, strict=True)
            if run.held_out
        ]
        error = float(np.sqrt(np.mean(np.concatenate(held_out) ** 2)))
        errors.append(f"{label} {error:.3g} {plant.channels[0].unit}")
    return f"held-out error: {', '.join(errors)}"


def changed(plant: OdePlant, *, without: Sequence[str] = (), added: Sequence[str] = ()) -> OdePlant:
    """The plant without some causes in its catalogue, and with some as a part of its model.

    Raises ValueError for a name that is no cause of it.
    """
    names = [cause.name for cause in plant.causes]
    for unknown in {*without, *added} - set(names):
        raise ValueError(f"{unknown} is no cause of this plant: choose from {', '.join(names)}")
    parts = [
        replace(size, nominal=size.trials[0], trials=())
        for cause in plant.causes
        if cause.name in added
        for size in cause.parameters
    ]
    other = copy(plant)
    other.causes = tuple(cause for cause in plant.causes if cause.name not in {*without, *added})
    other.parameters = (*plant.parameters, *parts)
    other.nominal = plant.nominal | {part.symbol: part.nominal for part in parts}
    return other
