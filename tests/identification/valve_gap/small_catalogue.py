"""A part of the catalogue, for tests that do not ask about the other causes: it takes less time."""

from epv_env.plant.parameters import Parameters
from identification.valve_gap.causes import catalogue

KEPT = {
    "eddy_current", "coil_heating", "seat_leak", "flow_force", "pressure_sensor_lag",
    "current_sensor_gain", "parameter:cPV",
}  # fmt: skip

LEFT_OUT = sorted({cause.name for cause in catalogue(Parameters.calibrated())} - KEPT)
"""The causes that `Valve` and `diagnose_campaign` are to leave out."""
