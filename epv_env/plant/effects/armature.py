"""Effects on the armature besides friction: elastic stops and the pressures on its seats."""

from epv_env.plant.effects.record import Constant, Effect, Size
from epv_env.plant.primitives import QUARTER_PI

ARMATURE_BOUNCE = Effect(
    name="armature_bounce",
    component="armature",
    form="speed after a landing = −eMV times that before; rebounds below 5 mm/s end (integrate.py)",
    source="coefficient of restitution; docs/explanation/plant-model.md, correction 8",
    sizes=(
        Size(
            symbol="eMV",
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
