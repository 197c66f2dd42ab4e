"""Cells that are no plain numbers are read where they mean one thing, and else named with their line."""

import re
from pathlib import Path

import numpy as np
import pytest

from identification.importing.import_campaign import import_text, read_files, source_table
from identification.importing.mapping_file import ChannelEntry, MappingFile
from identification.importing.source_file import ImportingError
from identification.recordings.recording import Recording
from tests.identification.importing.dialects import bench, columns_of, mat5, with_units
from tests.identification.importing.odd_files import clock

UNITS = {"time": "s", "I": "A", "U": "V", "p1": "mbar", "p2": "mbar", "p3": "mbar"}


@pytest.fixture(scope="module")
def true():
    """The validation recording of the virtual bench."""
    return bench().recordings[1]


def cells_of(true: Recording) -> dict[str, list[str]]:
    """Its cells by column, pressures in mbar to a tenth."""
    columns = columns_of(true)
    return {
        name: [f"{1e3 * v:.1f}" if name[0] == "p" else f"{v:.6f}" for v in values]
        for name, (values, _) in columns.items()
    }


def written(path: Path, cells: dict[str, list[str]], *, sep: str = ";", end: str = "\n") -> Path:
    """A table with a row of names with units; `end` follows the last row."""
    names = [f"{name} [{UNITS[name]}]" if name in UNITS else name for name in cells]
    rows = [sep.join(row) for row in zip(*cells.values(), strict=True)]
    path = path.with_suffix(".csv")
    path.write_text("\n".join([sep.join(names), *rows]) + end, encoding="utf-8")
    return path


def read(path: Path, **options):
    return read_files([path], ambient_bar=1.0, **options)


def assert_true(made, true, lost=0):
    """All samples but the last `lost` are the recording's, to the digits that were written."""
    recording = made.campaign.recordings[0]
    assert len(recording) == len(true) - lost
    assert recording.period == true.period
    np.testing.assert_allclose(recording.p2, true.p2[: len(recording)], rtol=0, atol=6.0)
    np.testing.assert_allclose(recording.I, true.I[: len(recording)], rtol=0, atol=1e-6)


def filled(made, name):
    """Missing readings of a channel that were filled."""
    return next(c.filled for c in made.files[0].channels if c.name == name)


def grouped(number: str, thousands: str, decimal: str) -> str:
    """A number with marks of thousands and another decimal sign."""
    return f"{float(number):,.1f}".replace(",", "_").replace(".", decimal).replace("_", thousands)


@pytest.mark.parametrize(("thousands", "decimal"), [(".", ","), ("'", "."), ("\u202f", ","), (" ", ".")])
def test_marks_of_thousands_are_read(true, thousands, decimal, tmp_path):
    cells = {name: [c.replace(".", decimal) for c in own] for name, own in cells_of(true).items()}
    for name in ("p1", "p2", "p3"):
        cells[name] = [grouped(cell, thousands, decimal) for cell in cells_of(true)[name]]
    assert_true(read(written(tmp_path / "run", cells)), true)


def test_quoted_numbers_with_marks_of_thousands_are_read(true, tmp_path):
    cells = cells_of(true)
    cells |= {
        name: [f'"{grouped(cell, ",", ".")}"' for cell in cells[name]] for name in ("p1", "p2", "p3")
    }
    assert_true(read(written(tmp_path / "run", cells, sep=",")), true)


@pytest.mark.parametrize(
    ("cell", "rule"),
    [
        ("12.546", "which may be 12546 or 12.546: write it with the decimal sign ',' alone"),
        ("much", "not a number"),
        ("12,5 mbar", "not a number"),
        ("12.54,6", "not a number"),
    ],
)
def test_a_cell_that_may_mean_two_things_or_none_is_named(true, cell, rule, tmp_path):
    cells = {name: [c.replace(".", ",") for c in own] for name, own in cells_of(true).items()}
    cells["p2"][99] = cell
    said = f"p2 [mbar] is {cell!r}, {rule}"
    with pytest.raises(ImportingError, match=f"{re.escape(said)}.*line 101.*mend the cell"):
        read(written(tmp_path / "run", cells))


@pytest.mark.parametrize(("mark", "decimal"), [(".", ","), (",", ".")])
def test_whole_columns_of_thousands_alone_are_not_taken_for_decimals(true, mark, decimal, tmp_path):
    cells = {name: [c.replace(".", decimal) for c in own] for name, own in cells_of(true).items()}
    for name in ("p1", "p2", "p3"):
        cells[name] = [f"{float(cell):,.0f}".replace(",", mark) for cell in cells_of(true)[name]]
    first = cells["p1"][0]
    with pytest.raises(ImportingError, match=rf"p1 .mbar. is '{first}', which may be .*\(line 2\)"):
        read(written(tmp_path / "run", cells))


@pytest.mark.parametrize("unit", ["mbar", "mbar abs", "hPa"])
def test_units_in_cells_are_read(true, unit, tmp_path):
    cells = cells_of(true)
    for name in ("p1", "p2", "p3"):
        cells[f"{name} "] = [f"{cell} {unit}" for cell in cells.pop(name)]
    path = written(tmp_path / "run", cells)
    assert_true(read(path), true)
    path.write_text(path.read_text().replace(f" {unit}", " kPa", 4).replace(" kPa", f" {unit}", 3))
    with pytest.raises(ImportingError, match=rf"kPa', not a number of the unit '{unit}' \(line 3\)"):
        read(path)


POINTS = {
    "English months": "%d-%b-%Y %H:%M:%S.%f",
    "months before days": "%B %d, %Y %H:%M:%S.%f",
    "short years": "%d %b %y %I:%M:%S.%f %p",
    "milliseconds after a colon": "%d.%m.%Y %H:%M:%S:%f",
    "days before months": "%d/%m/%Y %H:%M:%S.%f",
    "days before months, with dashes": "%d-%m-%y %H:%M:%S,%f",
    "months before days, in digits": "%m/%d/%Y %H:%M:%S.%f",
}


@pytest.mark.parametrize("kind", POINTS)
def test_points_in_time_past_midnight_are_read(true, kind, tmp_path):
    stamps = clock(true, POINTS[kind], "2026-03-04T23:59:59.9")
    cells = cells_of(true) | {"time": stamps}
    assert_true(read(written(tmp_path / "run", cells)), true)


def test_german_months_are_read(true, tmp_path):
    stamps = [s.replace("Mar", "März") for s in clock(true, "%d. %b %Y %H:%M:%S.%f")]
    assert_true(read(written(tmp_path / "run", cells_of(true) | {"time": stamps})), true)


@pytest.mark.parametrize(
    ("form", "begin"),
    [
        ("%I:%M:%S.%f", "2026-03-04T12:59:59.9"),
        ("%m/%d/%Y %I:%M:%S.%f", "2026-03-04T23:59:59.9"),
        ("%d.%m.%Y %I:%M:%S.%f", "2026-03-04T11:59:59.9"),
    ],
)
def test_twelve_hours_without_am_and_pm_go_on(true, form, begin, tmp_path):
    cells = cells_of(true) | {"time": clock(true, form, begin)}
    assert_true(read(written(tmp_path / "run", cells)), true)


@pytest.mark.parametrize(
    ("form", "fraction", "unit"),
    [("%Y/%m/%d %H:%M:%S", 1e3, "ms"), ("%H:%M:%S", 1e3, "ms"), ("%d.%m.%Y %H:%M:%S", 1e6, "µs")],
)
def test_a_column_of_milliseconds_is_added_to_the_seconds(true, form, fraction, unit, tmp_path):
    whole = clock(true, form)
    parts = [f"{int(s) * fraction / 1e6:g}" for s in clock(true, "%f")]
    cells = {"Date&Time": whole, unit: parts, **cells_of(true)}
    del cells["time"]
    assert_true(read(written(tmp_path / "run", cells)), true)


def test_a_time_in_milliseconds_beside_a_clock_is_left_as_it_is(true, tmp_path):
    cells = {"Date&Time": clock(true, "%H:%M:%S"), "t [ms]": [f"{1e3 * t:g}" for t in true.time]}
    cells |= {name: own for name, own in cells_of(true).items() if name != "time"}
    mapping = MappingFile(channels={"time": ChannelEntry(source="t")})
    assert_true(read(written(tmp_path / "run", cells), mapping=mapping), true)


@pytest.mark.parametrize("first", [46085.9999, 0.25, 1.0])
def test_days_of_a_spreadsheet_want_their_unit(true, first, tmp_path):
    cells = {"time ": [f"{first + t / 86400:.12f}" for t in true.time], **cells_of(true)}
    del cells["time"]
    path = written(tmp_path / "run", cells)
    with pytest.raises(
        ImportingError, match="time has no unit, and steps too short for seconds"
    ) as error:
        read(path)
    (tmp_path / "map.json").write_text(str(error.value).partition("for days ")[2])
    assert_true(read(path, mapping=tmp_path / "map.json"), true)


@pytest.mark.parametrize("mark", ["+++++++", "9.99999999e+37", "OL", "-OVER", "1.#INF"])
def test_over_range_readings_are_filled_or_named_with_their_lines(true, mark, tmp_path):
    cells = cells_of(true)
    cells["p1"][100:110] = 10 * [mark]  # 5 ms of a steady pressure
    made = read(written(tmp_path / "few", cells))
    assert filled(made, "p1") == 10
    assert_true(made, true)
    cells["p1"][100:120] = 20 * [mark]
    with pytest.raises(
        ImportingError, match=r"p1 .* to 0.06 s, .* lines 102 to 121 are over-range: record again"
    ):
        read(written(tmp_path / "many", cells))


def test_readings_beyond_the_range_at_an_end_are_said_to_be_left_out(true, tmp_path):
    cells = cells_of(true)
    cells["p2"][-30:] = 30 * ["OL"]
    made = read(written(tmp_path / "run", cells))
    assert_true(made, true, lost=30)
    assert "30 missing at the ends left out" in import_text(made)


@pytest.mark.parametrize("mark", ["ERR", "-9999", "no data", "******"])
def test_a_mapping_file_names_the_mark_of_a_missing_reading(true, mark, tmp_path):
    cells = cells_of(true)
    cells["p1"][100:103] = 3 * [mark]
    path = written(tmp_path / "run", cells)
    if mark != "-9999":
        with pytest.raises(ImportingError, match=re.escape('"missing": ["MARK"]')):
            read(path)
    made = read(path, mapping=MappingFile(missing=(mark,)))
    assert filled(made, "p1") == 3
    assert_true(made, true)


def test_a_mark_that_is_a_number_is_missing_in_binary_files_too(true, tmp_path):
    columns = columns_of(true)
    p1 = np.where(np.arange(len(true)) // 3 == 40, -9999.0, columns["p1"][0])
    path = mat5(tmp_path / "run", {"data": with_units({**columns, "p1": (p1, "bar")})})
    made = read(path, mapping=MappingFile(missing=("-9999",)))
    assert filled(made, "p1") == 3


BELOW = {
    "summary rows": ("\n\nMin;0;0;6;6;6\nMax;1;2;3;4;5\nMean;1;2;3;4;5\n", "{} to {} ('Min',", 2, 4),
    "a word": ("\nstopped by hand\n", "line {} ('stopped by hand')", 1, 1),
    "a cut line": ("\n0.75;0.44;18.9", "line {} ('0.75')", 1, 1),
    "a cut cell": ("\n0.75;0.44;18.9;12543.0;7000.0;700.0", "line {} may be cut off", 1, 1),
}  # fmt: skip


@pytest.mark.parametrize("kind", BELOW)
def test_what_stands_below_the_samples_is_left_out_and_said(true, kind, tmp_path):
    end, said, first, last = BELOW[kind]
    made = read(written(tmp_path / "run", cells_of(true), end=end))
    assert_true(made, true)
    lines = len(true) + 1
    assert said.format(lines + first, lines + last) in source_table(made.files[0].source)


@pytest.mark.parametrize("cell", ["12.x", "1..2", "12;"])
def test_a_wrong_cell_of_the_last_line_is_named(true, cell, tmp_path):
    cells = cells_of(true)
    cells["p2"][-1] = cell
    wrong = cell.rstrip(";")
    last = len(true) + 1
    with pytest.raises(ImportingError, match=rf"({re.escape(repr(wrong))}.*|)line {last}"):
        read(written(tmp_path / "run", cells))


@pytest.mark.parametrize("rows", [[100], [3, 4, 5], [10, 700, 1500]])
def test_rows_that_stand_twice_count_once(true, rows, tmp_path):
    cells = {
        name: [c for k, cell in enumerate(own) for c in [cell] * (1 + (k in rows))]
        for name, own in cells_of(true).items()
    }
    made = read(written(tmp_path / "run", cells))
    assert_true(made, true)
    said = f"{len(rows)} copies of lines left out, such as line {rows[0] + 3}"
    assert said in source_table(made.files[0].source)


HEADS = {
    "labels above the names of channels": (
        "Vertical Units,A,V,mbar,mbar,mbar\nVertical Scale,1,1,1,1,1\n\n"
        "Label,I,U,p1,p2,p3\nTIME,CH1,CH2,CH3,CH4,CH5"
    ),
    "names, then channels and units": (
        "Time,Current,Voltage,p1,p2,p3\nNO.,CH1,CH2,CH3,CH4,CH5\ns,A,V,mbar,mbar,mbar"
    ),
    "channels, then names": (
        "Model,X\nNo,1_1,1_2,1_3,1_4,1_5\nt,I,U,p1,p2,p3\ns,A,V,mbar,mbar,mbar"
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADS)
def test_the_names_of_several_header_rows_are_found(true, kind, tmp_path):
    path = written(tmp_path / "run", cells_of(true), sep=",")
    _, rows = path.read_text().split("\n", 1)
    path.write_text(f"{HEADS[kind]}\n{rows}")
    assert_true(read(path), true)


def test_a_column_of_words_that_nobody_needs_does_not_matter(true, tmp_path):
    cells = cells_of(true) | {"state": ["OK", "on"] * (len(true) // 2) + ["OK"] * (len(true) % 2)}
    path = written(tmp_path / "run", cells)
    assert_true(read(path), true)
    with pytest.raises(ImportingError, match=r"state is 'OK', not a number \(line 2\)"):
        read(path, mapping=MappingFile(channels={"p2": ChannelEntry(source="state", unit="bar")}))
