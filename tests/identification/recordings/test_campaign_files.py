"""Campaigns come back from their files as they were written."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import identification.recordings.campaign_files as campaign_files
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.columns import sampling_period
from identification.recordings.recording import CampaignError
from tests.identification.recordings.good_campaign import campaign_of, good_campaign, resting, switching

BLIND = Path(__file__).parents[4] / "shared" / "blind" / "round-1"
ROUNDING = {"I": 0.51e-6, "U": 0.51e-5, "p1": 0.51, "p2": 0.51, "p3": 0.51, "sigma_S": 0.51e-9}
"""Half the last decimal in the file [SI units]."""


@pytest.fixture
def folder(tmp_path):
    """A written campaign of one recording, test1.csv."""
    write_campaign(campaign_of(switching()), tmp_path)
    return tmp_path


def rewrite(folder: Path, change, encoding: str = "utf-8") -> None:
    """Change the text of test1.csv."""
    path = folder / "test1.csv"
    path.write_bytes(change(path.read_text(encoding="utf-8")).encode(encoding))


def quoted(text: str) -> str:
    """The same CSV with every cell in quotes."""
    out = io.StringIO()
    csv.writer(out, quoting=csv.QUOTE_ALL).writerows(csv.reader(io.StringIO(text)))
    return out.getvalue()


def with_column(text: str, cell: str) -> str:
    """The same CSV with a column that nobody asked for."""
    header, *rows = text.splitlines()
    return "\n".join([f"weather,{header}", *(f"{cell},{row}" for row in rows)])


def assert_close(actual, expected):
    for name, rounding in ROUNDING.items():
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), 0, rounding)


def test_a_campaign_comes_back(tmp_path):
    written = good_campaign()
    write_campaign(written, tmp_path / "new" / "folder")
    read = read_campaign(tmp_path / "new" / "folder")
    assert replace(read, recordings=(), folder=None) == replace(written, recordings=())
    assert read.folder == tmp_path / "new" / "folder"
    for one, other in zip(read.recordings, written.recordings, strict=True):
        assert (one.name, one.role, one.period) == (other.name, other.role, other.period)
        assert_close(one, other)


@pytest.mark.parametrize("rate", [500.0, 3000.0, 20000.0])
def test_any_rate_comes_back(tmp_path, rate):
    recording = switching(rate=rate)
    write_campaign(campaign_of(recording), tmp_path)
    recordings = read_campaign(tmp_path).recordings[0]
    assert recordings.period == 1 / rate
    assert_close(recordings, recording)


@pytest.mark.parametrize(("rate", "decimals"), [(500, 3), (2000, 4), (3000, 4), (2048, 4), (20000, 5)])
@pytest.mark.parametrize("samples", [100, 20000])
def test_rates_are_read_off_times_with_few_decimals(rate, decimals, samples):
    time = np.round(np.arange(samples) / rate, decimals)
    assert sampling_period("test1.csv", time) == 1 / rate


def test_consumption_is_written_only_where_there_is_some(tmp_path):
    consuming = replace(switching(name="consuming"), sigma_S=np.full(len(switching()), 2e-3))
    write_campaign(campaign_of(switching(), consuming), tmp_path)
    header = [(tmp_path / name).read_text().split("\n")[0] for name in ("test1.csv", "consuming.csv")]
    assert header[1] == f"{header[0]},sigmaS_kg_per_s"
    without, with_air = read_campaign(tmp_path).recordings
    assert not np.any(without.sigma_S)
    np.testing.assert_allclose(with_air.sigma_S, 2e-3)


def test_two_reservoir_sensors_are_averaged(folder):
    expected = read_campaign(folder).recordings[0].p1

    def split(text):
        lines = [line.split(",") for line in text.splitlines()]
        rows = [[*row, f"{float(row[3]) - 0.1:.5f}"] for row in lines[1:]]
        for row in rows:
            row[3] = f"{float(row[3]) + 0.1:.5f}"
        header = ["p1a_bar" if name == "p1_bar" else name for name in lines[0]]
        return "\n".join(",".join(row) for row in [[*header, "p1b_bar"], *rows])

    rewrite(folder, split)
    np.testing.assert_allclose(read_campaign(folder).recordings[0].p1, expected, atol=1e-3)


@pytest.mark.parametrize(
    ("change", "encoding"),
    [
        (lambda text: text.replace("\n", "\r\n"), "utf-8"),
        (lambda text: text, "utf-8-sig"),
        (lambda text: text + "\n\n", "utf-8"),
        (quoted, "utf-8"),
        (lambda text: with_column(text, '"dull, grey"'), "utf-8"),
    ],
    ids=["CRLF", "BOM", "blank end", "quoted", "another column"],
)
def test_every_form_of_csv_reads_the_same(folder, change, encoding):
    expected = read_campaign(folder).recordings[0]
    rewrite(folder, change, encoding)
    assert_close(read_campaign(folder).recordings[0], expected)


def quiet_voltage(recording):
    return replace(recording, U=np.where(recording.energised, 24.0, 0.0))


def slow_sensor(recording, lag: float):
    """p3 through a sensor of first order; the bent fall of p3 is not that of a gauge reading."""
    forget = np.exp(-recording.period / lag)
    p3 = lfilter([1 - forget], [1, -forget], recording.p3, zi=[forget * recording.p3[0]])[0]
    return replace(recording, p3=p3)


@pytest.mark.parametrize(
    "recording",
    [
        quiet_voltage(switching()),
        replace(resting(), U=np.zeros(len(resting()))),
        replace(resting(), p3=resting().p3 - 1e3),
        *(slow_sensor(switching(), lag) for lag in (0.005, 0.01, 0.02)),
    ],
    ids=["quiet U", "constant U at rest", "p3 of 0.99 bar", "5 ms lag", "10 ms lag", "20 ms lag"],
)
def test_what_real_benches_give_is_accepted(tmp_path, recording):
    write_campaign(campaign_of(recording), tmp_path)
    assert_close(read_campaign(tmp_path).recordings[0], recording)


def test_an_interrupted_writing_leaves_no_campaign_and_can_be_repeated(tmp_path, monkeypatch):
    def interrupted(path, text):
        if path.name == "validation.csv":
            raise KeyboardInterrupt
        path.write_text(text, encoding="utf-8")

    with monkeypatch.context() as patch:
        patch.setattr(campaign_files, "write_text", interrupted)
        with pytest.raises(KeyboardInterrupt):
            write_campaign(good_campaign(), tmp_path)
    with pytest.raises(CampaignError, match="cannot read"):
        read_campaign(tmp_path)
    write_campaign(good_campaign(), tmp_path)
    assert len(read_campaign(tmp_path).recordings) == 3


@pytest.mark.skipif(not BLIND.is_dir(), reason=f"the blind cases are not at {BLIND}")
def test_campaigns_of_another_simulator_are_read():
    folders = sorted(path.parent for path in BLIND.glob("*/campaign.json"))
    assert len(folders) == 12
    for folder in folders:
        campaign = read_campaign(folder)
        assert len(campaign.recordings) == 9
        assert {recording.period for recording in campaign.recordings} == {0.0005}
