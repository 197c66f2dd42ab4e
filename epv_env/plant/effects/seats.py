"""Leaks: seats of magnet and protection valve that do not close, and the circuit."""

from epv_env.plant.effects.record import Effect, Size
from epv_env.plant.primitives import inlined

INLET_SEAT_LEAK = Effect(
    name="inlet_seat_leak",
    component="control_chamber",
    strength=("leak_inlet",),
    form="effective area of the seat from A, shut, to the bore's",
    source="seat leakage, up to a tenth of the bores",
    sizes=(
        Size(
            symbol="A_in",
            constant="leak_inlet",
            unit="m^2",
            domain=(0, 4e-8),
            meaning="effective area of the shut MV inlet",
            trials=(4e-9,),
            drawn=(2e-9, 2e-8),
        ),
    ),
)

EXHAUST_SEAT_LEAK = Effect(
    name="exhaust_seat_leak",
    component="control_chamber",
    strength=("leak_exhaust",),
    form="effective area of the seat from A, shut, to the bore's",
    source="seat leakage, up to a tenth of the bores",
    sizes=(
        Size(
            symbol="A_exh",
            constant="leak_exhaust",
            unit="m^2",
            domain=(0, 4e-8),
            meaning="effective area of the shut MV exhaust",
            trials=(4e-9,),
            drawn=(2e-9, 2e-8),
        ),
    ),
)

SEAT_LEAK = Effect(
    name="seat_leak",
    component="output_chamber",
    strength=("leak_PV",),
    form="p1 into p2 through the shut PV seat",
    source="seat leakage, up to 0.1 % of the seat",
    sizes=(
        Size(
            symbol="A_PV",
            constant="leak_PV",
            unit="m^2",
            domain=(0, 1e-6),
            meaning="effective area of the shut PV seat",
            trials=(2e-8,),
            drawn=(1e-8, 2e-7),
        ),
    ),
)

CIRCUIT_LEAK = Effect(
    name="circuit_leak",
    component="output_chamber",
    strength=("leak_circuit",),
    form="p2 to ambient",
    source="leak tests of brake circuits",
    sizes=(
        Size(
            symbol="A_circuit",
            constant="leak_circuit",
            unit="m^2",
            domain=(0, 1e-6),
            meaning="effective area of the circuit's leak to ambient",
            trials=(2e-8,),
            drawn=(1e-8, 2e-7),
        ),
    ),
)


@inlined
def opened(area, bore, leak):
    """Effective area of a MV seat that does not close fully [m^2]: from the leak, shut, to the bore."""
    return area + leak * (1.0 - area / bore)
