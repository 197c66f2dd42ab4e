"""Times in a struct of their own, as points in time and at different rates give the campaign back."""

import json

import numpy as np
import pandas as pd
import pytest

from identification.importing.import_campaign import import_text, read_files
from identification.importing.mapping_file import ChannelEntry, MappingFile
from identification.importing.source_file import ImportingError
from identification.importing.times import points_in_time, seconds
from identification.recordings.campaign_files import read_campaign
from identification.recordings.recording import CHANNELS, CampaignError
from tests.identification.importing.dialects import bench, columns_of, import_campaign, mat5, text
from tests.identification.importing.dialects import tdms as in_groups
from tests.identification.importing.timed_files import LEAD, TWO_RATES, channels_of, structs, tdms


@pytest.fixture(scope="module")
def true():
    """The validation recording of the virtual bench."""
    return bench().recordings[1]


def treated(imported):
    """How the channels of the first file came to other times than its own."""
    channels = imported.files[0].channels
    return {c.name: c.treated for c in channels if c.treated != "as recorded"}


@pytest.mark.parametrize("kind", TWO_RATES)
def test_channels_of_two_rates_come_to_the_slower_one(kind, tmp_path):
    files = [TWO_RATES[kind](tmp_path / r.name, r) for r in bench().recordings]
    imported = import_campaign(files, tmp_path / "campaign", ambient_bar=1.0)
    assert {name: how.split()[-2] for name, how in treated(imported).items()} == {
        "I": "low-pass", "U": "entry",
    }  # fmt: skip
    campaign = read_campaign(tmp_path / "campaign")
    for made, true in zip(campaign.recordings, bench().recordings, strict=True):
        assert made.period == 2 * true.period
        for name in ("U", "p1", "p2", "p3"):
            atol = 1e-5 if name == "U" else 1.0
            np.testing.assert_allclose(made.channel(name), true.channel(name)[::2], rtol=0, atol=atol)


def jittering(path, true, size):
    """The recording at times that are off by up to `size` [s], imported."""
    columns = columns_of(true)
    off = np.random.default_rng(2).uniform(-size, size, len(true))
    return read_files([text(path, {**columns, "time": (true.time + off, "s")})], ambient_bar=1.0)


@pytest.mark.parametrize("size", [5e-7, 4e-6])
def test_times_within_rounding_of_the_grid_leave_every_value_as_it_is(true, size, tmp_path):
    made, plain = (jittering(tmp_path / "a.csv", true, each) for each in (size, 0.0))
    assert treated(made) == {}
    assert made.campaign.recordings[0].period == true.period
    for name in CHANNELS:
        same = plain.campaign.recordings[0].channel(name)
        np.testing.assert_array_equal(made.campaign.recordings[0].channel(name), same)


def test_a_voltage_at_jittering_times_is_held_and_the_rest_said_to_be_filtered(true, tmp_path):
    made = jittering(tmp_path / "a.csv", true, 1e-4)
    U = made.campaign.recordings[0].U
    assert np.all(np.isin(U, made.files[0].channels[1].values))  # no value between or beyond
    shown = import_text(made)
    assert shown.count("at other times, low-pass filtered") == 4
    assert shown.count("at other times, held from the entry before") == 1


def test_a_command_logged_on_change_holds_from_one_entry_to_the_next(true, tmp_path):
    U = np.where(true.energised, 24.0, 0.0)
    kept = np.concatenate([[True], np.diff(U) != 0.0])
    assert np.count_nonzero(kept) > 2
    columns = {**columns_of(true), "U": (np.where(kept, U, np.nan), "V")}
    path = text(tmp_path / "a.csv", columns)
    path.write_text(path.read_text().replace("nan", ""))
    made = read_files([path], ambient_bar=1.0)
    np.testing.assert_array_equal(made.campaign.recordings[0].U, U)
    np.testing.assert_allclose(made.campaign.recordings[0].p3, true.p3, rtol=0, atol=1.0)


@pytest.mark.parametrize("waveform", [False, True])
def test_channels_that_start_apart_stay_in_step(true, waveform, tmp_path):
    path = tdms(tmp_path / true.name, true, waveform=waveform, lead=LEAD)
    made = read_files([path], ambient_bar=1.0).campaign.recordings[0]
    for name in CHANNELS:
        atol = 1.0 if name.startswith("p") else 1e-5
        np.testing.assert_allclose(made.channel(name), true.channel(name)[LEAD:], rtol=0, atol=atol)


def test_a_mapping_file_names_each_channels_times(true, tmp_path):
    columns = {
        "time": (true.time, "s"),
        **channels_of(true),
        "time of p": (true.time + true.period * LEAD, "s"),
    }
    path = text(tmp_path / "validation.csv", columns)
    with pytest.raises(ImportingError, match=r"'time \[s\]' or 'time of p \[s\]' may hold the times"):
        read_files([path])
    content = {
        "format": "epv-mapping/1",
        "channels": {
            "time": {"source": "time"},
            **{name: {"source": name, "time": "time of p"} for name in ("p1", "p2", "p3")},
        },
    }
    (tmp_path / "map.json").write_text(json.dumps(content))
    made = read_files([path], mapping=tmp_path / "map.json", ambient_bar=1.0).campaign.recordings[0]
    np.testing.assert_allclose(made.p3, true.p3[:-LEAD], rtol=0, atol=1.0)
    np.testing.assert_allclose(made.I, true.I[LEAD:], rtol=0, atol=1e-5)


def test_a_mapping_file_gives_the_unit_of_times_in_structs(true, tmp_path):
    content = {name: {**one, "time": one["time"] * 1e3} for name, one in structs(true).items()}
    path = mat5(tmp_path / "validation", content)
    with pytest.raises(ImportingError, match=r"give the right unit of time in a mapping file"):
        read_files([path])
    mapping = {"format": "epv-mapping/1", "channels": {"time": {"source": "time", "unit": "ms"}}}
    (tmp_path / "map.json").write_text(json.dumps(mapping))
    made = read_files([path], mapping=tmp_path / "map.json", ambient_bar=1.0).campaign.recordings[0]
    assert made.period == true.period


def points(*texts):
    """Seconds since the first of some points in time, and that one."""
    return seconds(points_in_time(pd.Series(texts, dtype=object)))


def test_points_in_time_are_read_to_the_nanosecond_and_zones_are_taken_off():
    same = [
        "2026-03-01T12:00:00.000000001Z",
        "20260301T140000,000000001+0200",
        "2026-03-01 08:30:00.000000001-03:30",
    ]
    values, begin = points(*same)
    assert begin == np.datetime64("2026-03-01T12:00:00.000000001", "ns")
    np.testing.assert_array_equal(values, 0.0)
    values, begin = points("2026-03-01T12:00", None, "2026-03-01T12:00:00.5")
    np.testing.assert_array_equal(values, [0.0, np.nan, 0.5])
    assert begin == np.datetime64("2026-03-01T12:00")


def test_channels_with_and_without_a_known_begin_are_not_put_side_by_side(true, tmp_path):
    waveform = {"wf_increment": true.period, "wf_start_offset": 0.0}
    begun = {**waveform, "wf_start_time": np.datetime64("2026-03-01T12:00:00", "us")}
    path = in_groups(tmp_path / "a", channels_of(true), first=waveform, second=begun)
    channels = {name: ChannelEntry(source=f"first/{name}") for name in channels_of(true)}
    mapping = MappingFile(channels=channels | {"I": ChannelEntry(source="second/I")})
    with pytest.raises(ImportingError, match="export all with the same kind of time"):
        read_files([path], mapping=mapping)


@pytest.mark.parametrize(("name", "end"), [("p2", 8.0), ("I", 0.4), ("p3", 12.0)])
def test_a_clipped_channel_is_named_before_the_filter_hides_it(true, name, end, tmp_path):
    columns = columns_of(true)
    columns[name] = (np.minimum(columns[name][0], end), columns[name][1])
    off = np.random.default_rng(2).uniform(-1e-4, 1e-4, len(true))
    path = text(tmp_path / "a.csv", columns | {"time": (true.time + off, "s")})
    with pytest.raises(
        CampaignError, match=rf"a.csv, {name} .*, lines \d+ to \d+: {name} stays at {end:g}"
    ):
        read_files([path], ambient_bar=1.0)
