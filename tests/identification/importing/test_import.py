"""Files of benches in many dialects become the same campaign; what is unclear is refused."""

import sys

import numpy as np
import pytest

from identification.__main__ import main
from identification.importing.common_grid import resampled
from identification.importing.source_file import ImportingError
from identification.importing.units import parsed_unit
from identification.recordings.campaign_files import read_campaign
from identification.recordings.recording import CampaignError
from tests.identification.importing.dialects import (
    DIALECTS,
    assert_same_recordings,
    bench,
    columns_of,
    import_campaign,
    text,
)
from tests.identification.importing.timed_files import SAME_RATE


@pytest.mark.parametrize("write", [*DIALECTS.values(), *SAME_RATE.values()], ids=[*DIALECTS, *SAME_RATE])
def test_every_dialect_and_kind_of_time_gives_the_same_campaign(write, tmp_path):
    files = [write(tmp_path / r.name, r) for r in bench().recordings]
    import_campaign(files, tmp_path / "campaign", ambient_bar=1.0)
    assert_same_recordings(read_campaign(tmp_path / "campaign"), bench())


def test_resampling_neither_delays_nor_folds():
    """A chirp of 10 Hz to 5 kHz at jittering times: kept below 350 Hz, gone above 500 Hz."""
    rng = np.random.default_rng(3)
    time = (np.arange(40_000) + rng.uniform(-0.2, 0.2, 40_000)) / 20_000
    sweep = 10 + (5000 - 10) * time / 2
    chirp = np.sin(2 * np.pi * (10 * time + (5000 - 10) * time**2 / 4))
    grid = 0.001 + np.arange(1990) / 1000
    made = resampled(time, chirp, grid)
    frequency = np.interp(grid, time, sweep)
    true = np.sin(2 * np.pi * (10 * grid + (5000 - 10) * grid**2 / 4))
    inside, outside = (frequency > 20) & (frequency < 300), frequency > 560
    assert np.max(np.abs(made - true)[inside]) < 0.01  # a delay of 10 microseconds would show
    assert np.max(np.abs(made[outside])) < 0.005
    late = np.sin(2 * np.pi * (10 * (grid - 1e-5) + (5000 - 10) * (grid - 1e-5) ** 2 / 4))
    assert np.max(np.abs(late - true)[inside]) > 0.01


def test_a_dry_run_shows_everything_and_writes_nothing(tmp_path, capsys):
    path = text(tmp_path / "test1.csv", columns_of(bench().recordings[0]))
    assert main(["import", str(path), "--out", str(tmp_path / "out"), "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert "2000 Hz" in shown
    assert "nothing is written" in shown
    assert sorted(p.name for p in tmp_path.iterdir()) == ["test1.csv"]


@pytest.mark.parametrize("ending", ["g", " g", "(g)", " (g)", " gauge", " rel.", "-ü"])
@pytest.mark.parametrize(("unit", "size"), [("bar", 1e5), ("Psi", 6894.757293), ("kgf/cm2", 98066.5)])
def test_references_of_pressures_are_read(unit, size, ending):
    found = parsed_unit(unit + ending)
    assert found is not None
    assert (found.quantity, found.reference) == ("pressure", "gauge")
    assert found.size == pytest.approx(size)


@pytest.mark.parametrize(
    ("text", "quantity", "size", "reference"),
    [
        ("bar", "pressure", 1e5, ""),
        ("kPa(a)", "pressure", 1e3, "absolute"),
        ("[bar (abs)]", "pressure", 1e5, "absolute"),
        ("Torr", "pressure", 133.322368, ""),
        ("N/mm²", "pressure", 1e6, ""),
        ("Volts", "voltage", 1.0, ""),
        ("mVDC", "voltage", 1e-3, ""),
        ("A DC", "current", 1.0, ""),
        ("MPA", "pressure", 1e6, ""),
        ("Amps", "current", 1.0, ""),
        ("Seconds", "time", 1.0, ""),
    ],
)
def test_units_are_read_as_data_sheets_spell_them(text, quantity, size, reference):
    found = parsed_unit(text)
    assert found is not None
    assert (found.quantity, found.reference) == (quantity, reference)
    assert found.size == pytest.approx(size)


@pytest.mark.parametrize("text", ["MBar", "kBar", "min^9999999", "m^9^9^9", "m^(9^9^9)", "bar" * 9])
def test_what_is_no_unit_is_none_and_found_so_at_once(text):
    assert parsed_unit(text) is None


def test_wrong_inputs_are_refused_and_nothing_written(tmp_path):
    good = columns_of(bench().recordings[0])
    gauge = {n: (v, f"{u} gauge" if u == "bar" else u) for n, (v, u) in good.items()}
    with pytest.raises(ImportingError, match="is gauge pressure: give the environment"):
        import_campaign([text(tmp_path / "a.csv", gauge)], tmp_path / "out")
    with pytest.raises(ImportingError, match="there is no unit of I, U, p1"):
        import_campaign([text(tmp_path / "b.csv", good, bracket=False)], tmp_path / "out")
    mbar = {n: (v, "mbar" if u == "bar" else u) for n, (v, u) in good.items()}
    with pytest.raises(CampaignError, match=r"falls to 0\.01\d+ bar, below the ambient 1 bar"):
        import_campaign([text(tmp_path / "c.csv", mbar)], tmp_path / "out")
    rows = (tmp_path / "c.csv").read_text().splitlines(keepends=True)
    (tmp_path / "d.csv").write_text("".join(rows[:300] + rows[320:]))
    with pytest.raises(ImportingError, match="no samples from"):
        import_campaign([tmp_path / "d.csv"], tmp_path / "out")
    (tmp_path / "e.mat").write_bytes(b"not MATLAB")
    with pytest.raises(ImportingError, match=r"damaged or no MATLAB file"):
        import_campaign([tmp_path / "e.mat"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_missing_package_is_named_in_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "asammdf", None)
    (tmp_path / "a.mf4").write_bytes(b"MDF     4.10")
    with pytest.raises(
        ImportingError, match=r"need the package asammdf.*pip install -e '\.\[bench-files\]'"
    ):
        import_campaign([tmp_path / "a.mf4"], tmp_path / "out")
