"""A third of the catalogue, for tests that do not ask about the other causes: it takes less time."""

from epv_env.plant.parameters import Parameters
from identification.valve_gap.causes import catalogue

KEPT = {
    "command_delay", "eddy_current", "flyback_voltage", "coil_heating", "piston_friction", "seat_leak",
    "supply_restriction", "flow_force", "output_chamber_heat", "pressure_sensor_lag",
    "pressure_sensor_gain", "current_sensor_gain", "parameter:cPV",
}  # fmt: skip

LEFT_OUT = sorted({cause.name for cause in catalogue(Parameters.calibrated())} - KEPT)
"""The causes that `Valve` and `diagnose_campaign` are to leave out."""
