"""Leaks: seats of magnet and protection valve that do not close, and the circuit."""

from epv_env.plant.effects.record import Constant, Effect, Size
from epv_env.plant.primitives import inlined


def _leak(name: str, component: str, size: Size, constant: str, form: str, source: str) -> Effect:
    """A leak of an effective area."""
    row = Constant(
        name=constant, meaning=f"{size.meaning} [m^2]", value=lambda p, symbol=size.symbol: p[symbol]
    )
    return Effect(
        name=name, component=component, form=form, source=source, sizes=(size,), constants=(row,),
        strength=(constant,),
    )  # fmt: skip


INLET_SEAT_LEAK = _leak(
    "inlet_seat_leak",
    "control_chamber",
    Size(
        symbol="A_in",
        unit="m^2",
        domain=(0, 4e-8),
        meaning="effective area of the shut MV inlet",
        trials=(4e-9,),
        drawn=(2e-9, 2e-8),
    ),
    constant="leak_inlet",
    form="effective area of the seat from A, shut, to the bore's",
    source="seat leakage, up to a tenth of the bores",
)

EXHAUST_SEAT_LEAK = _leak(
    "exhaust_seat_leak",
    "control_chamber",
    Size(
        symbol="A_exh",
        unit="m^2",
        domain=(0, 4e-8),
        meaning="effective area of the shut MV exhaust",
        trials=(4e-9,),
        drawn=(2e-9, 2e-8),
    ),
    constant="leak_exhaust",
    form="effective area of the seat from A, shut, to the bore's",
    source="seat leakage, up to a tenth of the bores",
)

SEAT_LEAK = _leak(
    "seat_leak",
    "output_chamber",
    Size(
        symbol="A_PV",
        unit="m^2",
        domain=(0, 1e-6),
        meaning="effective area of the shut PV seat",
        trials=(2e-8,),
        drawn=(1e-8, 2e-7),
    ),
    constant="leak_PV",
    form="p1 into p2 through the shut PV seat",
    source="seat leakage, up to 0.1 % of the seat",
)

CIRCUIT_LEAK = _leak(
    "circuit_leak",
    "output_chamber",
    Size(
        symbol="A_circuit",
        unit="m^2",
        domain=(0, 1e-6),
        meaning="effective area of the circuit's leak to ambient",
        trials=(2e-8,),
        drawn=(1e-8, 2e-7),
    ),
    constant="leak_circuit",
    form="p2 to ambient",
    source="leak tests of brake circuits",
)


@inlined
def opened(area, bore, leak):
    """Effective area of a MV seat that does not close fully [m^2]: from the leak, shut, to the bore."""
    return area + leak * (1.0 - area / bore)
