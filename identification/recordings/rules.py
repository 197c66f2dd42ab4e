"""The limits by which a recording is refused or its noise is read (docs/reference/files.md)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product

from epv_env.plant.channels import SENSORS, Sensor
from epv_env.plant.force_balance import venting_rate
from epv_env.plant.plantfile import VOLTAGE, Plant


@dataclass(frozen=True, kw_only=True)
class RecordingRules:
    """Judgements about recordings."""

    least_rate: float = 500.0
    """Least sampling rate [1/s]: a slower bench misses the armature's movement."""
    harmless_jitter: float = 1e-3
    """Part of a period by which a sample may be off; the steepest signal then moves by less than "
    "noise."""
    most_digits: int = 9
    """Most decimals of a second with which files print times."""
    least_rest: float = 0.5
    """Least duration of a quality recording [s]; statistics of less mean little."""
    least_voltage: float = 1.0
    """Least greatest voltage of a coil that is on at all [V]; noise has 0.012 V."""
    switching_noise: float = 10.0
    """Range of a voltage that switches, over the changes of nine samples in ten; noise has 3."""
    stuck_time: float = 0.02
    """A reading that stays at the end of a range for this long [s] is stuck ..."""
    stuck_samples: int = 20
    """... if it stays there for this many samples, too; noise moves a live reading."""
    choked_ratio: float = 2.2
    """Pressure over ambient above which outflow is choked (from 1.9 on), with room for noise."""
    least_discharge: int = 20
    """Samples of a discharge that show where the pressure falls to: 40 ms at 500 Hz."""
    least_fall: float = 0.25
    """Relative fall of a discharge that shows where the pressure falls to."""
    gauge_likeness: float = 0.3
    """Part of the ambient pressure within which the end of a discharge meets a pressure of reference."""
    doubled_ambient: float = 1.7
    """Pressure over ambient that a pressure whose ambient was added twice never falls below."""
    venting_rates: tuple[float, float] = (4.5, 14.0)
    """Rates of a choked discharge of p3 [1/s]. The report's valve has 7.7, and 2300 recordings of
    benches with every effect lie between 5.6 and 9.8. Outside, the times are wrong."""
    usual_venting: float = 7.7
    """Rate of a choked discharge of the report's valve [1/s]; it names the factor of wrong times."""
    operating_voltages: tuple[float, float] = (6.0, 32.32)
    """Voltages of an energised coil [V]: from half of 12 V to the sensor's end with its accuracy."""
    coil_resistances: tuple[float, float] = (8.0, 220.0)
    """Holding voltage over holding current [Ohm] of a coil of this kind; the report's has 42. Five times
    to either side leaves room for other coils, and none for a wrong unit, which is 1000 times off."""
    most_rest_current: float = 0.03
    """Current of a coil that is off [A]: three times the sensor's accuracy."""
    most_rest_voltage: float = 0.1
    """Voltage of a coil that is off, over its voltage when it is on; flyback is shorter than half."""
    decay_time: float = 0.03
    """Time after which no current flows in a coil that was switched off [s]; six time constants."""
    usual_supply: float = 10.0
    """Supply pressure [bar] that decides between units that physics allows; brakes run at 6 to 13."""
    nearly_vented: float = 1.5
    """Pressure over ambient below which a circuit counts as vented: an open supply must fill it."""
    similar_misreadings: float = 0.15
    """Decades of pressure and noise by which a second explanation may be less usual and is named too."""
    distinct_share: float = 0.2
    """Distinct readings per sample above which the readings are taken for continuous (no grid)."""
    least_codes: int = 10
    """Distinct readings that show a step; the least distance of a few may be several steps."""
    grid_error: float = 0.1
    """Distance from a grid, in its steps, within which a reading lies on it; digits are few."""
    coarse_step: float = 2.0
    """Step over Table 3's noise above which a live channel may read the same throughout: a sensor
    that is somewhat quieter than Table 3's then rarely leaves a code."""
    noise_block: float = 0.05
    """Time over which a drift passes for straight when the noise is read [s]."""
    sensors: Mapping[str, Sensor] = field(default_factory=lambda: SENSORS)
    """The bench's sensor of each channel [bar absolute, A or V]; Tables 1 to 3."""

    @property
    def pressure_margin(self) -> float:
        """Accuracy of the pressure sensors, of the worst of them [bar]."""
        return max(self.sensors[name].accuracy * self.sensors[name].high for name in ("p1", "p2", "p3"))


RULES = RecordingRules()
"""The rules of docs/reference/files.md."""


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
