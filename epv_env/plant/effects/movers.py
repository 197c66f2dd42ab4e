"""Effects on the movers: friction of armature and piston, elastic stops, pressures on the seats."""

import math

from epv_env.plant.effects.record import Constant, Effect, Size
from epv_env.plant.primitives import QUARTER_PI, inlined

SLIDING_SPEED_MV = 0.02
"""Speed over which the armature's friction rises to its value [m/s]; it flies at 0.3 m/s."""

SLIDING_SPEED_PV = 0.02
"""The same for the piston [m/s], which moves at 0.1 m/s and more."""

STRIBECK_SPEED = 0.05
"""Speed at which half of the break-away excess of the piston's friction is left [m/s]."""

ARMATURE_FRICTION = Effect(
    name="armature_friction",
    component="armature",
    strength=("friction_MV",),
    form="−F v/√(v² + (20 mm/s)²); at rest on a stop it resists the release",
    source="Coulomb friction, Armstrong-Hélouvry 1991",
    sizes=(
        Size(
            symbol="F_MV",
            constant="friction_MV",
            unit="N",
            domain=(0, 2),
            meaning="Coulomb friction of the armature",
            trials=(0.3,),
            drawn=(0.1, 1.0),
        ),
    ),
)

PISTON_FRICTION = Effect(
    name="piston_friction",
    component="protection_valve",
    strength=("friction_PV",),
    form="as armature_friction, times 1 + S/(1 + (v/v_s)²), v_s = 50 mm/s",
    source=(
        "sliding O-ring of 25.7 mm, measured: 4.3 ± 0.8 N + (0.56 ± 0.18) N/bar; at rest 1.6–2.9 times "
        "as much over three seals (S of 0–2), seen only after a dwell; Hess and Soom 1990"
    ),
    sizes=(
        Size(
            symbol="F_PV",
            constant="friction_PV",
            unit="N",
            domain=(0, 30),
            meaning="Coulomb friction of the PV piston's seals",
            trials=(4.0, 15.0),
            drawn=(1.5, 15.0),
        ),
        Size(
            symbol="S_PV",
            constant="breakaway_PV",
            unit="1",
            domain=(0, 2),
            meaning="excess of the piston's friction at rest over that in motion",
            drawn=(0.1, 1.0),
            spread=0.5,
        ),
    ),
)

ARMATURE_BOUNCE = Effect(
    name="armature_bounce",
    component="armature",
    strength=("restitution_MV",),
    form="speed after a landing = −eMV times that before; rebounds below 5 mm/s end (stepping.py)",
    source="coefficient of restitution; docs/explanation/plant-model.md, correction 8",
    sizes=(
        Size(
            symbol="eMV",
            constant="restitution_MV",
            unit="1",
            domain=(0, 0.95),
            meaning="restitution of the armature at its stops",
            trials=(0.4, 0.8),
            drawn=(0.08, 0.75),
        ),
    ),
)

ARMATURE_PRESSURE_FORCE = Effect(
    name="armature_pressure_force",
    component="armature",
    strength=("inlet_area", "exhaust_area"),
    form="+ s π/4 (dMVin² (p1 − p3) − dMVexh² (p3 − p_env))",
    source="poppet balance: the seats' areas at s = 1",
    sizes=(
        Size(
            symbol="sFMV",
            unit="1",
            domain=(0, 1.5),
            meaning="share of the MV bores' areas on which pressures push the armature",
            trials=(0.5,),
            drawn=(0.13, 1.3),
        ),
    ),
    constants=(
        # area on which p1 - p3 pulls the armature in [m^2]
        Constant("inlet_area", lambda p: p["sFMV"] * QUARTER_PI * p["dMVin"] ** 2),
        # area on which p3 - p_env pushes it back [m^2]
        Constant("exhaust_area", lambda p: p["sFMV"] * QUARTER_PI * p["dMVexh"] ** 2),
    ),
)


@inlined
def stribeck(v, excess):
    """Friction at a speed relative to Coulomb's [-]: 1 + excess at rest, 1 if fast (Hess, Soom 1990)."""
    relative = v * (1.0 / STRIBECK_SPEED)
    return 1.0 + excess / (1.0 + relative * relative)


@inlined
def stop_friction(x, v, x_max, size):
    """Friction with which a stop's mover at rest resists its release [N]; zero elsewhere."""
    side = (1.0 if x <= 0.0 else 0.0) - (1.0 if x >= x_max else 0.0)
    return size * (side if v == 0.0 else 0.0)


@inlined
def friction(force, x, v, x_max, size, sliding_speed):
    """Net force on a mover with Coulomb friction [N]; force: without friction.

    At rest on a stop friction resists the release; else it rises to its size over the sliding speed.
    """
    sliding = v / math.sqrt(v * v + sliding_speed * sliding_speed)
    return force - size * sliding - stop_friction(x, v, x_max, size)
