"""The tuned classic controllers, as data: what the search found, and how it searched."""

import json
from collections.abc import Collection
from dataclasses import asdict, dataclass
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any

from controllers.base import Controller
from controllers.hysteresis import Hysteresis
from controllers.mpc import MPC
from controllers.pulse import Pulse
from controllers.pulse_table import pulse_table
from controllers.pwm import PWM
from controllers.pwm_design import design
from epv_env.common.files import write_text
from epv_env.plant.parameters import Parameters
from epv_env.plant.supply import BAR

FORMAT = "epv-controllers/1"
DESIGN_P1 = 11.5 * BAR
"""Supply pressure at which the PWM loop is designed: the middle of the reservoirs' range [Pa]."""
DESIGN_P2 = 8.0 * BAR
"""Circuit pressure at which it is designed [Pa]."""
PWM_PERIOD = 20e-3


class ControllersFileError(ValueError):
    """A file of tuned controllers cannot be used."""


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """The outcome of one search."""

    values: dict[str, float]
    """The searched quantities by name (`build`'s arguments)."""
    trials: int
    """Evaluations spent."""
    mean_return: float
    """Mean return of the best on the tuning scenarios."""
    episodes: int
    """Episodes of one evaluation."""


def build(kind: str, values: dict[str, Any], parameters: Parameters) -> Controller:
    """A controller of one KINDS from its searched quantities. Raises ValueError if they contradict."""
    if kind == "hysteresis":
        return Hysteresis(name="hysteresis", **values)
    if kind == "hysteresis, extrapolating":
        return Hysteresis(name="hysteresis, extrapolating", **values)
    if kind == "PWM":
        shaped = {name: values[name] for name in ("inner_time", "phase_margin", "integral_time")}
        chosen = design(parameters, p1=DESIGN_P1, p2=DESIGN_P2, period=PWM_PERIOD, **shaped)
        rest = {name: value for name, value in values.items() if name not in shaped}
        return PWM(design=chosen, parameters=parameters, control_period=PWM_PERIOD, **rest)
    if kind == "pulse":
        return Pulse(table=pulse_table(parameters), **values)
    if kind == "MPC":
        return MPC(parameters=parameters, threads=1, **values)
    raise ControllersFileError(f"unknown controller {kind!r}: choose one of {', '.join(KINDS)}")


KINDS = ("hysteresis", "hysteresis, extrapolating", "PWM", "pulse", "MPC")
"""The controllers that are tuned, not trained."""

SEARCHING = ("MPC",)
"""Those of them that simulate the plant as they decide: a second or more of computing per episode."""


def load_tunings(path: str | PathLike[str] | None = None) -> dict[str, Tuning]:
    """Tunings by kind, from a file or (None) those that come with the package."""
    return {kind: Tuning(**entry) for kind, entry in _content(path)["controllers"].items()}


def load_search(path: str | PathLike[str] | None = None) -> dict[str, Any]:
    """How the tunings of such a file were searched: method, budget, seed, plants."""
    return _content(path)["search"]


def _content(path: str | PathLike[str] | None) -> dict[str, Any]:
    if path is None:
        text = resources.files("controllers").joinpath("tuned.json").read_text(encoding="utf-8")
    else:
        text = Path(path).read_text(encoding="utf-8")
    content = json.loads(text)
    if content.get("format") != FORMAT:
        raise ControllersFileError(
            f"controllers file has format {content.get('format')!r}, this version reads {FORMAT!r}: "
            "tune anew with `python training/tune.py`"
        )
    return content


def save_tunings(tunings: dict[str, Tuning], path: str | PathLike[str], search: dict[str, Any]) -> None:
    """Write tunings and how they were searched, whole or not at all."""
    content = {
        "format": FORMAT,
        "search": search,
        "controllers": {kind: asdict(tuning) for kind, tuning in tunings.items()},
    }
    write_text(Path(path), json.dumps(content, indent=1) + "\n")


def tuned_controllers(
    parameters: Parameters | None = None, *, without: Collection[str] = ()
) -> list[Controller]:
    """The classic controllers as tuned, designed for a plant (None: the report's calibration)."""
    plant = parameters or Parameters.calibrated()
    tunings = load_tunings()
    return [build(kind, tunings[kind].values, plant) for kind in tunings if kind not in without]
