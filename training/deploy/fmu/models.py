"""The plant and an exported policy as models for an FMU.

The plant's variables come from the parameter table, its C from the state equations. The policy is the C
file of the export, called once in every period.
"""

from collections.abc import Mapping
from textwrap import indent
from typing import Any

from epv_env.plant.channels import MEASURED_CHANNELS
from epv_env.plant.coefficients import folded
from epv_env.plant.effects.coil import OFF_VOLTAGE, coil_current
from epv_env.plant.effects.measurement import command_delays
from epv_env.plant.effects.registry import CONSTANTS, Effects, with_laws
from epv_env.plant.effects.step_limits import longest_step
from epv_env.plant.equations import Coefficients, Inputs, State, derivative
from epv_env.plant.lanes import moved
from epv_env.plant.parameters import table
from epv_env.plant.plantfile import Plant
from epv_env.plant.runge_kutta import held_still, is_held
from epv_env.plant.stepping import (
    LANDING,
    MOST_RESTITUTION,
    RELEASE_LOCATIONS,
    RELEASE_MARGIN,
    SHORTEST_STEP,
    STICK_SPEED,
    crossing,
    hermite,
    release,
    turning_point,
)
from training.deploy.c_code import CODE, TITLE, filled
from training.deploy.fmu.archive import TEMPLATES, Model, Variable
from training.deploy.fmu.c_functions import (
    HELPERS,
    NUMBER,
    TRUTH,
    PlantC,
    Symbol,
    field_texts,
    written,
)

LONGEST_STEP = 250e-6
"""Start of the parameter longest_step [s]: the integration step while a mover moves, the kernel's;
twice as long while both movers are held."""
SHORTEST_LONGEST_STEP = 1e-6
"""Least value of that parameter [s]: finer than any effect asks for."""
MOST_STEPS_PER_SECOND = 2_000_000
"""Steps in each second begun of a communication step after which the FMU gives up: twice as many as the
finest longest_step needs, so that only rebounds without end are given up."""
P1_START, P2_START = 9.5e5, 8e5
"""Pressures at the start [Pa absolute]: a reservoir that the compressor has just filled, and the
circuit at the target of the environment's episodes."""
U_START = 24.0
"""Voltage before an importer gives one [V]: the coil is on, the valve shut and at rest."""
COMMUNICATION_STEP = 1e-3
"""Communication step that modelDescription.xml proposes [s]: a fifth of the control period, so that a
policy beside the plant loses little time."""

FORCES = ("air_3", "force_PV", "force_MV")
"""Inputs that act in the extended equations only."""
NOT_NEGATIVE = ("sigma_S", "refill")
"""Inputs that are flows in one direction."""


def plant_model(plant: Plant) -> Model:
    """The model of a plant, its parameters as start values.

    Raises ExportError where the plant's code holds what has no form in C here.
    """
    variables = _variables(plant)
    return Model(
        name="Electro-pneumatic protection valve",
        identifier="epv_plant",
        description=f"Electro-pneumatic protection valve of a truck's air brake: plant {plant.name!r}.",
        variables=variables,
        sources=_sources(),
        step=COMMUNICATION_STEP,
    )


def _variables(plant: Plant) -> tuple[Variable, ...]:
    """Inputs, parameters, start values, outputs, states and time."""
    p = plant.parameters
    inputs = [
        Variable(
            name=name, kind="input", unit=unit, meaning=meaning,
            start=U_START if name == "U" else 0.0,
            low=0.0 if name in NOT_NEGATIVE else -float("inf"), discrete=name == "U",
        )
        for name, (unit, meaning) in field_texts(Inputs).items()
    ]  # fmt: skip
    parameters = [
        Variable(
            name=symbol, kind="parameter", unit=row.unit, meaning=row.meaning, start=p[symbol],
            low=p.domain(symbol)[0], high=p.domain(symbol)[1],
        )
        for symbol, row in table().items()
        if row.domain
    ]  # fmt: skip
    outputs = [
        Variable(
            name=channel.name, kind="output", unit={"bar": "Pa"}.get(channel.unit, channel.unit),
            meaning=f"what the sensor of {channel.name} is given to read, without noise",
        )
        for channel in MEASURED_CHANNELS
        if channel.reading
    ]  # fmt: skip
    states = [
        Variable(name=f"state.{name}", kind="local", unit=unit, meaning=meaning)
        for name, (unit, meaning) in field_texts(State).items()
    ]
    time = Variable(name="time", kind="time", unit="s", meaning="simulated time")
    return (*inputs, *parameters, *_settings(plant), *outputs, *states, time)


def _settings(plant: Plant) -> list[Variable]:
    """What sets the supply, the integration, and the state at the start: shut, at rest, the coil on."""
    stroke = table()["xPVmax"].domain
    assert stroke is not None
    finest, coarsest = SHORTEST_LONGEST_STEP, LONGEST_STEP
    current = U_START / plant.parameters["R"]
    rows = [
        ("V1", "m^3", 0.0, 0.0, 10.0, "volume of the reservoirs; 0: the supply does not sag"),
        ("longest_step", "s", coarsest, finest, coarsest, "integration step while a mover moves"),
        ("p1_start", "Pa", P1_START, 1e4, 2e6, "input chamber pressure at the start, absolute"),
        ("p2_start", "Pa", P2_START, 1e4, 2e6, "output chamber pressure at the start, absolute"),
        ("p3_start", "Pa", P1_START, 1e4, 2e6, "control chamber pressure at the start, absolute"),
        ("xPV_start", "m", 0.0, 0.0, stroke[1], "stroke of the piston at the start, 0 = shut"),
        ("armature_start", "1", 1.0, 0.0, 1.0, "stroke of the armature over xMVmax, 1 = pulled in"),
        ("I_start", "A", current, -2.0, 2.0, "current of the coil at the start"),
    ]
    return [
        Variable(
            name=name, kind="parameter", unit=unit, meaning=meaning, start=start, low=low, high=high
        )
        for name, unit, start, low, high, meaning in rows
    ]


def _sources() -> dict[str, str]:
    """The equations and the file that solves them."""
    translation = PlantC()
    state, inputs, coefficients, effects = map(
        translation.structure, (State, Inputs, Coefficients, Effects)
    )
    rates = translation.function(
        derivative, (state, inputs, coefficients, effects, NUMBER, NUMBER, TRUTH)
    )
    for function, types in (
        (with_laws, (state, effects, TRUTH)),
        (coil_current, (*[NUMBER] * 4, effects)),
        (longest_step, (NUMBER, state, effects, NUMBER, NUMBER)),
        (is_held, (NUMBER,) * 4),
        (held_still, (state, NUMBER, NUMBER)),
        (moved, (state, state, NUMBER)),
        (turning_point, (NUMBER,) * 2),
        (hermite, (NUMBER,) * 6),
        (crossing, (NUMBER,) * 7),
        (release, (NUMBER,) * 3),
    ):
        translation.function(function, types)
    numbers = {
        "title": TITLE,
        "rates": rates.result,
        "most_steps": MOST_STEPS_PER_SECOND,
        "landing": repr(LANDING),
        "stick_speed": repr(STICK_SPEED),
        "most_restitution": repr(MOST_RESTITUTION),
        "release_margin": repr(RELEASE_MARGIN),
        "release_locations": str(RELEASE_LOCATIONS),
        "shortest_step": repr(SHORTEST_STEP),
    }
    return {
        "equations.h": filled(
            TEMPLATES / "equations.h",
            {"helpers": HELPERS, "functions": "\n".join(translation.texts)},
        ),
        "model.h": filled(TEMPLATES / "plant.h", numbers | _formulas()),
    }


def _formulas() -> dict[str, str]:
    """C of what the parameters and inputs mean to the equations, and of what the outputs show."""
    p: dict[str, Any] = {
        symbol: Symbol(f"value[V_{symbol}]" if row.domain else repr(row.value))
        for symbol, row in table().items()
    }
    volume = Symbol("(value[V_V1] > 0.0 ? value[V_V1] : INFINITY)")
    state = State(*(Symbol(f"q->{name}") for name in State._fields))
    shown: dict[str, Any] = {
        channel.name: channel.reading(state, p) for channel in MEASURED_CHANNELS if channel.reading
    }
    start = {
        "p1": _start_of("p1"), "p2": _start_of("p2"), "p3": _start_of("p3"), "xPV": _start_of("xPV"),
        "xMV": "value[V_armature_start] * c->xMVmax", "I": _start_of("I"), "I_coil": _start_of("I"),
        "coil_heat": written(p["theta_coil"]),
    }  # fmt: skip
    sizes = [row.name for row in CONSTANTS if row.is_size]
    delay_on, delay_off = command_delays(p)
    return {
        "coefficients": _lines("c->{} = {};", folded(p, volume)._asdict()),
        "effects": _lines("effects->{} = {};", {row.name: row.value(p) for row in CONSTANTS}),
        "start": _lines("m->q.{} = {};", start),
        "inputs": _lines("u->{} = {};", {name: f"value[V_{name}]" for name in Inputs._fields}),
        "publish": _lines("value[V_{}] = {};", shown)
        + "\n"
        + _lines("value[V_state_{0}] = q->{1};", {name: name for name in State._fields}),
        "effects_act": _any("effects->", sizes),
        "forced": _any("u->", list(FORCES)),
        "off_voltage": repr(OFF_VOLTAGE),
        "delay_on": written(delay_on),
        "delay_off": written(delay_off),
    }


def _start_of(name: str) -> str:
    """The start value of a state in C."""
    return f"value[V_{name}_start]"


def _lines(form: str, values: dict[str, Any]) -> str:
    """One indented line of C for each value by name."""
    texts = {k: v if isinstance(v, str) else written(v) for k, v in values.items()}
    return indent("\n".join(form.format(name, text) for name, text in texts.items()), "    ")


def _any(prefix: str, names: list[str]) -> str:
    """A condition in C that any of these numbers is not zero."""
    return "(" + " || ".join(f"{prefix}{name} != 0.0" for name in names) + ")"


def policy_model(period: float, files: Mapping[str, str]) -> Model:
    """The model of an exported policy. period: of its control [s]. files: of the export, by name."""
    sources = {name: files[name] for name in CODE}
    sources["model.h"] = filled(TEMPLATES / "policy.h", {"period_us": round(1e6 * period)})
    return Model(
        name="Policy for an electro-pneumatic protection valve",
        identifier="epv_policy",
        description=f"Trained policy that switches the valve's coil every {1e3 * period:g} ms.",
        variables=_policy_variables(),
        sources=sources,
        step=period / 5,
    )


def _policy_variables() -> tuple[Variable, ...]:
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
