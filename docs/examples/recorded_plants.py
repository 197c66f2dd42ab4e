"""What the examples with other people's recordings share: runs, causes and the command."""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from epv_env.common.options import writable_folder
from identification.gap.diagnosis import Diagnosis, diagnose
from identification.gap.fit.evidence import predict
from identification.gap.ode_plant import OdePlant
from identification.gap.plant import Cause, FreeParameter, Run
from identification.gap.report.gap_json import write_results
from identification.gap.report.page import sections
from identification.gap.report.sentences import verdict_sentence
from identification.report.page import write_page


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


def command(title: str, plant_of: Callable[[Path], OdePlant]) -> int:
    """Diagnose the recordings in --data: gap.json, report.html and the verdict; returns the status.

    title: of the plant, for the report. plant_of: from the folder of recordings.
    """
    parser = argparse.ArgumentParser(description=f"Why a model of {title} misses its recordings.")
    parser.add_argument("--data", type=Path, required=True, help="folder of the recordings")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of results")
    parser.add_argument("--seed", type=int, default=0, help="of resampling")
    chosen = parser.parse_args()
    diagnosis = diagnose(plant_of(chosen.data), seed=chosen.seed)
    write_down(diagnosis, chosen.out, title)
    print(held_out_errors(diagnosis))
    return 0


def write_down(diagnosis: Diagnosis, out: Path, title: str) -> None:
    """Write gap.json and report.html, and print the verdict."""
    write_results(diagnosis, out)
    heading = f"Gap between model and recordings: {title}"
    write_page(out / "report.html", title=heading, sections=sections(diagnosis))
    print(verdict_sentence(diagnosis)[1])


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
