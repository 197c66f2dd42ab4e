"""Recordings of the virtual bench for diagnoses whose truth is known, and parts of the catalogue."""

from functools import cache

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import DIAGNOSIS_SUITE
from identification.bench.session import measured_campaign, run_programme
from identification.recordings.recording import Campaign
from identification.valve_gap.causes import catalogue


@cache
def campaign(*names: str, **effect: float) -> Campaign:
    """These programmes of the diagnosis suite, measured on the calibrated valve with an effect.

    A record at rest tells the sensors' offsets, which would pass for small gaps: else there are none.
    """
    truth = Parameters.calibrated().replace(**effect)
    programmes = [programme for programme in DIAGNOSIS_SUITE if programme.name in names]
    truths = [run_programme(truth, programme) for programme in programmes]
    return measured_campaign(truths, truth, seed=3, offsets=None if "rest" in names else {})


MANY = (
    "command_delay", "flyback_voltage", "coil_heating", "piston_friction", "seat_leak",
    "supply_restriction", "flow_force", "output_chamber_heat", "pressure_sensor_lag",
    "pressure_sensor_gain", "current_sensor_gain", "parameter:cPV",
)  # fmt: skip
"""Causes of all parts of the valve. With one more they are too many for a search from each trial of each
pair, which takes five times as long."""


def all_but(*kept: str) -> list[str]:
    """What is left out of the catalogue by a test that asks about a few causes: it takes less time."""
    return sorted({cause.name for cause in catalogue(Parameters.calibrated())} - set(kept))
