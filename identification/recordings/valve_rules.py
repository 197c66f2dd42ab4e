"""The rules of recordings for a valve of one's own: its sensors, coil and control chamber."""

from dataclasses import replace
from itertools import product

from epv_env.plant.force_balance import venting_rate
from epv_env.plant.plantfile import VOLTAGE, Plant
from identification.recordings.rules import RULES, RecordingRules

VENTING_SYMBOLS = ("alphaMV", "dMVexh", "V3")
"""Parameters that decide how fast the control chamber vents."""


def rules_of(plant: Plant, rules: RecordingRules = RULES) -> RecordingRules:
    """The rules for recordings of this plant.

    The report's limits stand in the same ratios to its own coil, voltage and venting rate as they do
    here. Where the plant has own domains of what sets its venting rate, they widen the rates.
    """
    usual = venting_rate(plant.parameters)
    rates = _possible_rates(plant)
    slowest, fastest = (rate / rules.usual_venting for rate in rules.venting_rates)
    R, sensors = plant.parameters["R"], plant.sensors
    least, greatest = rules.coil_resistances
    middle = (least * greatest) ** 0.5
    return replace(
        rules,
        venting_rates=(slowest * min(rates), fastest * max(rates)),
        usual_venting=usual,
        coil_resistances=(least * R / middle, greatest * R / middle),
        operating_voltages=(
            rules.operating_voltages[0] * plant.voltage / VOLTAGE,
            sensors["U"].high * (1 + sensors["U"].accuracy),
        ),
        least_voltage=rules.least_voltage * plant.voltage / VOLTAGE,
        most_rest_current=rules.most_rest_current * sensors["I"].high / rules.sensors["I"].high,
        sensors=sensors,
    )


def _possible_rates(plant: Plant) -> list[float]:
    """Rates [1/s] at the plant's values and at all ends of its own domains of VENTING_SYMBOLS."""
    p = plant.parameters
    ends = [(p[s], *p.own_domains.get(s, ())) for s in VENTING_SYMBOLS]
    return [
        venting_rate(p.replace(**dict(zip(VENTING_SYMBOLS, values, strict=True))))
        for values in product(*ends)
    ]
