"""An exported policy as a model for an FMU: the C file of the export, called once in every period."""

from pathlib import Path
from string import Template

import msgspec

from epv_env.common.files import JSONFileError, read_json
from training.deploy.deployment_contract import FORMAT
from training.deploy.fmu.files import TEMPLATES
from training.deploy.fmu.variables import Model, Variable
from training.deploy.quantisation import ExportError

CODE = ("epv_float.h", "epv_float.c")
"""Files of an export that an FMU is made of."""


class _Observation(msgspec.Struct):
    """What is read of the contract's observation."""

    control_period_s: float


class _Contract(msgspec.Struct):
    """What is read of contract.json."""

    observation: _Observation


def policy_model(folder: Path) -> Model:
    """The model of the policy in a folder that `training/export.py` wrote.

    Raises ExportError if the folder is not one, or was written by another version.
    """
    period = _contract(folder).observation.control_period_s
    sources = {name: _text(folder / name) for name in CODE}
    template = Template((TEMPLATES / "policy.h").read_text(encoding="utf-8"))
    return Model(
        name="Policy for an electro-pneumatic protection valve",
        identifier="epv_policy",
        description=f"Trained policy that switches the valve's coil every {1e3 * period:g} ms.",
        variables=_variables(),
        sources=sources | {"model.h": template.substitute(period_us=round(1e6 * period))},
        step=period / 5,
    )


def _variables() -> tuple[Variable, ...]:
    """Readings, the supply's voltage, and the decision."""
    pressures = {
        "p1": (9.5e5, "measured supply pressure, absolute"),
        "p2": (8e5, "measured circuit pressure, absolute"),
        "p3": (9.5e5, "measured control pressure, absolute"),
        "p2_target": (8e5, "wanted circuit pressure, absolute"),
    }
    return (
        *(
            Variable(name=name, kind="input", unit="Pa", start=start, low=0.0, high=1e7, meaning=meaning)
            for name, (start, meaning) in pressures.items()
        ),
        Variable(
            name="I", kind="input", unit="A", start=0.57, low=-10.0, high=10.0, meaning="coil current"
        ),
        Variable(
            name="U_on", kind="parameter", unit="V", start=24.0, low=0.0, high=60.0,
            meaning="voltage of the coil while it is on",
        ),
        Variable(
            name="coil", kind="output", unit="1", discrete=True,
            meaning="1: the coil is on and the valve shuts, 0: off",
        ),
        Variable(name="U", kind="output", unit="V", discrete=True, meaning="voltage of the coil"),
        Variable(name="time", kind="time", unit="s", meaning="simulated time"),
    )  # fmt: skip


def _contract(folder: Path) -> _Contract:
    """The fields of contract.json that count here, checked. Raises ExportError."""
    path = folder / "contract.json"
    remedy = "export the policy again, or give a folder that training/export.py wrote"
    try:
        contract = read_json(path, _Contract, version=FORMAT, remedy=remedy)
    except JSONFileError as error:
        raise ExportError(str(error)) from None
    if not 1e-4 <= contract.observation.control_period_s <= 1.0:
        raise ExportError(f"{path} has no control period of 0.1 ms to 1 s: export the policy again")
    return contract


def _text(path: Path) -> str:
    """A file's text. Raises ExportError."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ExportError(
            f"cannot read {path}: {error}; give a folder that training/export.py wrote"
        ) from None
