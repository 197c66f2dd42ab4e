"""One record describes a measured channel; what is missing in a record is said in one sentence."""

from dataclasses import fields, replace

import pytest

from epv_env.plant.channels import (
    CURRENT,
    MEASURED,
    MEASURED_CHANNELS,
    P2,
    SENSOR_SYMBOLS,
    SENSORS,
    VOLTAGE,
    ChannelError,
)
from epv_env.plant.parameters import table
from identification.recordings.columns import CHANNEL_OF, REQUIRED_COLUMNS, TIME_COLUMN
from identification.recordings.recording import CHANNELS, OUTPUTS, UNITS, Recording

each = pytest.mark.parametrize("channel", MEASURED_CHANNELS, ids=lambda channel: channel.name)


def test_the_order_of_channels_is_that_of_files_and_of_drawn_noise():
    assert MEASURED == ("p1", "p2", "p3", "I")
    assert SENSOR_SYMBOLS == ("b_p2", "b_p3", "g_I")
    assert OUTPUTS == ("p2", "p3", "I")
    assert CHANNELS == ("I", "U", "p1", "p2", "p3")
    assert list(SENSORS) == ["p1", "p2", "p3", "I", "U"]
    assert REQUIRED_COLUMNS == (TIME_COLUMN, "I_A", "U_V", "p2_bar", "p3_bar")
    assert list(CHANNEL_OF) == ["I_A", "U_V", "p1_bar", "p1a_bar", "p1b_bar", "p2_bar", "p3_bar"]


@each
def test_a_recording_has_a_field_for_the_channel(channel):
    names = [field.name for field in fields(Recording)]
    assert channel.name in names, f"Recording lacks a field for {channel.name}: add it"


@each
def test_the_sensor_s_parameters_have_rows(channel):
    for symbol in channel.symbols:
        assert symbol in table(), f"parameter {symbol} of channel {channel.name} has no row: add it"


@each
def test_columns_name_channel_and_unit(channel):
    for column in channel.columns:
        assert column.startswith(channel.name)
        assert column.endswith(f"_{channel.unit}")
    assert UNITS[channel.name] == (channel.unit, channel.scale)


@each
def test_a_file_keeps_a_hundredth_of_a_step(channel):
    assert 10.0**-channel.decimals <= channel.sensor.resolution / 100


@pytest.mark.parametrize(
    ("channel", "changes", "message"),
    [
        (P2, {"unit": ""}, "measured channel 'p2': unit is empty: fill it in"),
        (P2, {"columns": ()}, "columns is empty"),
        (P2, {"scale": 0.0}, "scale is 0: give the size of one bar in SI units"),
        (CURRENT, {"reading": None}, "an output or observed channel needs `reading`"),
        (VOLTAGE, {"output": True}, "'U': an output or observed channel needs `reading`"),
    ],
)
def test_an_incomplete_record_is_refused_in_one_sentence(channel, changes, message):
    with pytest.raises(ChannelError, match=message):
        replace(channel, **changes)
