"""Leaks: seats of magnet and protection valve that do not close, and the circuit."""

from epv_env.plant.effects.record import Constant, Effect, Size
from epv_env.plant.primitives import inlined


def _magnet_seat_leak(seat: str, end: str) -> Effect:
    """The leak of a seat of the magnet valve; end: of its symbols."""
    area, share = f"A_{end}", f"wA_{end}"
    return Effect(
        name=f"{seat}_seat_leak",
        component="control_chamber",
        strength=(f"leak_{seat}",),
        form="effective area of the seat from A, shut, to the bore's and w A",
        source="seat leakage, up to a tenth of the bores",
        sizes=(
            Size(
                symbol=area,
                constant=f"leak_{seat}",
                unit="m^2",
                domain=(0, 4e-8),
                meaning=f"effective area of the shut MV {seat}",
                trials=(4e-9,),
                drawn=(2e-9, 2e-8),
            ),
            Size(
                symbol=share,
                unit="1",
                domain=(0, 1),
                meaning="share of this leak beside the seat: it goes on while the seat is open",
                spread=0.5,
            ),
        ),
        constants=(Constant(f"beside_{seat}", lambda p: p[share], is_size=False),),
    )


INLET_SEAT_LEAK = _magnet_seat_leak("inlet", "in")
EXHAUST_SEAT_LEAK = _magnet_seat_leak("exhaust", "exh")

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
def opened(area, bore, leak, beside):
    """Effective area of a MV seat that does not close fully [m^2].

    The open seat takes the leak over, up to the bore's area, but for the share `beside` of it [-].
    """
    return area + leak * (1.0 - (1.0 - beside) * (area / bore))
