"""The sensors of the measured channels, by the channel's name."""

from epv_env.plant.channels import MEASURED_CHANNELS
from epv_env.plant.data_acquisition import Sensor

SENSORS: dict[str, Sensor] = {channel.name: channel.sensor for channel in MEASURED_CHANNELS}
"""Table 1's range and accuracy, Table 2's offset and trend, Table 3's standard deviation."""
