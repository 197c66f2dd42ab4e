"""The sensors of a bench of one's own: Table 1's, with what a plant file says otherwise."""

import math
from collections.abc import Mapping
from dataclasses import asdict, replace

from epv_env.plant.channels import CHANNEL
from epv_env.plant.data_acquisition import Sensor
from epv_env.plant.parameters import ParameterError
from epv_env.plant.sensors import SENSORS

MOST_ACCURACY = 0.2
"""Accuracy, as a fraction of the range, beyond which a sensor measures nothing [-]."""

MOST_NOISE_SHARE = 0.1
"""Noise, as a share of the range, beyond which a sensor measures nothing [-]."""


def own_sensors(changes: Mapping[str, Mapping[str, float]]) -> dict[str, Sensor]:
    """Every channel's sensor, [bar absolute, A or V]; ParameterError for one that cannot be.

    changes: fields of `Sensor` by channel that differ from Tables 1 to 3.
    """
    sensors = dict(SENSORS)
    for name, fields in changes.items():
        if name not in SENSORS:
            raise ParameterError(f"sensors: unknown channel {name!r}: known are {', '.join(SENSORS)}")
        unknown = sorted(set(fields) - set(asdict(SENSORS[name])))
        if unknown:
            raise ParameterError(
                f"sensors.{name}: unknown field {unknown[0]!r}: known are "
                f"{', '.join(asdict(SENSORS[name]))}"
            )
        sensors[name] = replace(SENSORS[name], **fields)
        _check(name, sensors[name])
    return sensors


def changed_fields(sensors: Mapping[str, Sensor]) -> dict[str, dict[str, float]]:
    """What `own_sensors` was given: the fields that differ from Tables 1 to 3, by channel."""
    changed = {
        name: {
            field: value
            for field, value in asdict(sensor).items()
            if value != asdict(SENSORS[name])[field]
        }
        for name, sensor in sensors.items()
    }
    return {name: fields for name, fields in changed.items() if fields}


def _check(name: str, sensor: Sensor) -> None:
    """Raises ParameterError for a sensor that could measure nothing."""
    place, unit = f"sensors.{name}", CHANNEL[name].unit
    for field, value in asdict(sensor).items():
        if not math.isfinite(value):
            raise ParameterError(f"{place}.{field} is {value}: give a finite number")
    if not sensor.low < sensor.high or sensor.high <= 0:
        raise ParameterError(
            f"{place} has the range [{sensor.low:g}, {sensor.high:g}] {unit}: give low < high, high > 0"
        )
    if unit == "bar" and sensor.low < 0:
        raise ParameterError(
            f"{place}.low = {sensor.low:g} bar lies below vacuum: give absolute ranges, not gauge"
        )
    if not 0 < sensor.accuracy <= MOST_ACCURACY:
        raise ParameterError(
            f"{place}.accuracy = {sensor.accuracy:g} must lie in (0, {MOST_ACCURACY:g}]: give it as a "
            "fraction of the range's end, 0.01 for 1 %"
        )
    if not 0 < sensor.noise <= MOST_NOISE_SHARE * (sensor.high - sensor.low):
        raise ParameterError(
            f"{place}.noise = {sensor.noise:g} {unit} must be positive and at most "
            f"{MOST_NOISE_SHARE:g} of the range: give its standard deviation"
        )
