"""What the recordings of a bench are checked against: its sensors, its coil and its control chamber."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product

from epv_env.plant.channels import SENSORS, Sensor
from epv_env.plant.force_balance import venting_rate
from epv_env.plant.plantfile import VOLTAGE, Plant

VENTING_SYMBOLS = ("alphaMV", "dMVexh", "V3")
"""Parameters that decide how fast the control chamber vents."""


@dataclass(frozen=True, kw_only=True)
class RecordingRules:
    """What a bench and its valve allow; the defaults are those of the report's."""

    sensors: Mapping[str, Sensor] = field(default_factory=lambda: SENSORS)
    """Sensor of each channel [bar absolute, A or V]; Tables 1 to 3."""
    operating_voltages: tuple[float, float] = (6.0, 32.32)
    """Voltages of an energised coil [V]: from half of 12 V to the sensor's end with its accuracy."""
    coil_resistances: tuple[float, float] = (8.0, 220.0)
    """Holding voltage over holding current [Ohm] of a coil of this kind; the report's has 42. Five times
    to either side leaves room for other coils, and none for a wrong unit, which is 1000 times off."""
    venting_rates: tuple[float, float] = (4.5, 14.0)
    """Rates of a choked discharge of p3 [1/s]. The report's valve has 7.7, and 2300 recordings of
    benches with every effect lie between 5.6 and 9.8. Outside, the times are wrong."""
    usual_venting: float = 7.7
    """Rate of a choked discharge of the valve [1/s]; it names the factor of wrong times."""

    @property
    def pressure_margin(self) -> float:
        """Accuracy of the pressure sensors, of the worst of them [bar]."""
        return max(self.sensors[name].margin for name in ("p1", "p2", "p3"))


RULES = RecordingRules()
"""Those of the report's bench (docs/reference/files.md)."""


def rules_of(plant: Plant) -> RecordingRules:
    """The rules for recordings of another plant.

    The report's limits stand in the same ratios to its own coil, voltage and venting rate as they do
    here. Where the plant has own domains of what sets its venting rate, they widen the rates.
    """
    p = plant.parameters
    ends = [(p[s], *p.own_domains.get(s, ())) for s in VENTING_SYMBOLS]
    rates = [
        venting_rate(p.replace(**dict(zip(VENTING_SYMBOLS, values, strict=True))))
        for values in product(*ends)
    ]
    slowest, fastest = (rate / RULES.usual_venting for rate in RULES.venting_rates)
    R, voltage = p["R"], plant.sensors["U"]
    least, greatest = RULES.coil_resistances
    middle = (least * greatest) ** 0.5
    return RecordingRules(
        sensors=plant.sensors,
        operating_voltages=(
            RULES.operating_voltages[0] * plant.voltage / VOLTAGE,
            voltage.high * (1 + voltage.accuracy),
        ),
        coil_resistances=(least * R / middle, greatest * R / middle),
        venting_rates=(slowest * min(rates), fastest * max(rates)),
        usual_venting=venting_rate(p),
    )
