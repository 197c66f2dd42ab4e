"""The plants that others recorded: direct fits by hand reach the errors that are known for them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from docs.examples.recorded_plants import command
from docs.examples.thermal_lab import thermal_lab
from docs.examples.toy_car import toy_car
from identification.gap.ode_plant import OdePlant

ROOT = Path(__file__).parents[1]
RECORDED = ROOT.parent / "shared" / "recorded"
PLANTS: dict[str, tuple[Callable[[Path], OdePlant], Path]] = {
    "thermal_lab": (thermal_lab, RECORDED / "tclab"),
    "toy_car": (toy_car, RECORDED / "dart_car" / "20_step_input_data_rubbery_floor"),
}
MADE: dict[str, OdePlant] = {}


def plant(name: str) -> OdePlant:
    made, folder = PLANTS[name]
    if not folder.exists():
        pytest.skip(f"{folder} is absent: the recordings of others are no part of the project")
    if name not in MADE:
        MADE[name] = made(folder)
    return MADE[name]


def held_out_error(own: OdePlant, effects: tuple[str, ...]) -> float:
    """Root mean square error on held-out readings after a direct fit that begins at the first trials."""
    sizes = {s.symbol: s for s in own.parameters}
    begin = {s: p.nominal for s, p in sizes.items()}
    for cause in own.causes:
        if cause.name in effects:
            sizes |= {s.symbol: s for s in cause.parameters}
            begin |= {s.symbol: s.trials[0] for s in cause.parameters}
    low, high, scale = (
        np.array([getattr(p, field) for p in sizes.values()]) for field in ("low", "high", "scale")
    )

    def errors(vector, held_out: bool):
        runs = [r for r, run in enumerate(own.runs) if run.held_out == held_out]
        values = {s: np.array([v]) for s, v in zip(sizes, vector * scale, strict=True)}
        simulated = zip(runs, own.outputs(values, runs), strict=True)
        return np.concatenate(
            [(y[..., 0] - own.runs[r].measured)[own.runs[r].trusted] for r, y in simulated]
        )

    found = least_squares(
        errors,
        np.array(list(begin.values())) / scale,
        bounds=(low / scale, high / scale),
        args=(False,),
        diff_step=1e-5,
    )
    return float(np.sqrt(np.mean(errors(found.x, True) ** 2)))


@pytest.mark.parametrize(
    ("name", "effects", "known"),
    [
        ("thermal_lab", (), 5.40),
        ("thermal_lab", ("heater_coupling", "sensor_lag"), 1.05),
        ("toy_car", (), 0.378),
        ("toy_car", ("dead_zone", "rolling_friction"), 0.092),
    ],
)
def test_a_direct_fit_reaches_the_known_error(name, effects, known):
    assert held_out_error(plant(name), effects) == pytest.approx(known, rel=0.06)


def test_a_missing_folder_is_told_with_the_source_of_the_data(monkeypatch, tmp_path):
    options = ["--data", str(tmp_path / "none"), "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", ["toy_car", *options])
    with pytest.raises(FileNotFoundError, match=r"get the recordings from github\.com/"):
        command("a toy car", toy_car)
