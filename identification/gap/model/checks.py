"""Checks at the door: what is wrong with a plant, before a diagnosis begins."""

from collections.abc import Iterable

from identification.gap.model.grey_box import GreyBox
from identification.gap.model.parameter_checks import parameter_findings
from identification.gap.model.plant_error import PlantError
from identification.gap.model.recording_checks import recording_findings
from identification.gap.model.settings import PreparationSettings
from identification.gap.model.simulation_checks import simulation_findings
from identification.gap.model.trial_effects import effect_warnings

MEMBERS = (
    "channels", "runs", "parameters", "causes", "tolerances", "run_offsets", "outputs", "equations",
    "states", "regimes", "forced",
)  # fmt: skip
"""Members of `GreyBox`."""


def check(plant: GreyBox, settings: PreparationSettings | None = None) -> list[str]:
    """Look for mistakes in the description of a plant, in its recordings and in its simulator.

    The nominal model is simulated on every run, alone and beside another candidate. Every parameter and
    cause is tried once, on as few runs as show its effect.

    Args:
        plant: the plant.
        settings: limits of the checks; None: the defaults.

    Returns:
        Warnings, a sentence each: parameters and causes without effect, parameters that act alike.

    Raises:
        PlantError: every finding is one line that names the member, the rule and the remedy.
    """
    settings = settings or PreparationSettings()
    _refuse(
        f"{name}: the plant has no such member: add it as identification/gap/model/grey_box.py describes"
        for name in MEMBERS
        if not hasattr(plant, name)
    )
    _refuse([*recording_findings(plant, settings), *parameter_findings(plant)])
    _refuse(simulation_findings(plant, settings))
    return effect_warnings(plant, settings)


def _refuse(findings: Iterable[str]) -> None:
    """Raise an error with all findings, if there are any."""
    lines = list(findings)
    if lines:
        raise PlantError("\n".join(lines))
