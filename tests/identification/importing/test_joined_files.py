"""Several files of one recording are joined by their times where a mapping file says so."""

import json

import numpy as np
import pytest

from identification.__main__ import main
from identification.importing.import_campaign import read_files
from identification.importing.source_file import ImportingError
from tests.identification.importing.dialects import bench, columns_of, mat5, named, text
from tests.identification.importing.timed_files import channels_of, stamps


@pytest.fixture(scope="module")
def true():
    """The validation recording of the virtual bench."""
    return bench().recordings[1]


def mapping(path, first, others, **channels):
    """A mapping file that joins the others to the first."""
    content = {
        "format": "epv-mapping/1",
        "channels": channels,
        "recordings": {first: {"join": others}},
    }
    path.write_text(json.dumps(content))
    return path


def analog_and_digital(folder, true):
    """Five analog channels, and the changes of a logic input."""
    columns = columns_of(true)
    U = columns.pop("U")[0]
    analog = text(folder / "analog.csv", columns)
    changes = np.flatnonzero(np.diff(true.energised, prepend=not true.energised[0]))
    lines = [f"{true.time[k]:.9f},{int(U[k] > 9)}" for k in changes]
    (folder / "digital.csv").write_text("\n".join(["Time [s],U", *lines, ""]))
    return [analog, folder / "digital.csv"], {"U": {"unit": "V", "factor": 24.0}}


def one_channel_a_file(folder, true):
    """A file with a column "value" for each channel."""
    time = columns_of(true)["time"]
    files = [
        text(folder / f"{name}.csv", {"time": time, "value": pair})
        for name, pair in channels_of(true).items()
    ]
    return files, {name: {"source": f"{name}.csv/value"} for name in channels_of(true)}


def two_formats(folder, true):
    """Pressures in text, current and voltage in MATLAB."""
    columns = columns_of(true)
    pressures = {n: c for n, c in columns.items() if n == "time" or n[0] == "p"}
    others = {n: c for n, c in columns.items() if n[0] != "p"}
    return [text(folder / "p.csv", pressures), mat5(folder / "ui", named(others))], {}


def points_in_time(folder, true):
    """Two files with points in time; the second begins a little later."""
    columns = columns_of(true)
    own = [f"{stamp}" for stamp in stamps(true)]
    files = []
    for name, chosen, first in (("a", ("I", "U"), 0), ("b", ("p1", "p2", "p3"), 8)):
        rows = zip(own, *(columns[n][0] for n in chosen), strict=True)
        head = ",".join(["time", *(f"{n} [{columns[n][1]}]" for n in chosen)])
        lines = [",".join(map(str, row)) for row in rows][first:]
        (folder / f"{name}.csv").write_text("\n".join([head, *lines, ""]))
        files.append(folder / f"{name}.csv")
    return files, {}


@pytest.mark.parametrize("write", [analog_and_digital, one_channel_a_file, two_formats, points_in_time])
def test_the_channels_of_several_files_make_one_recording(true, write, tmp_path):
    files, channels = write(tmp_path, true)
    first, *others = (file.name for file in files)
    path = mapping(tmp_path / "map.json", first, others, **channels)
    made = read_files(files, mapping=path, ambient_bar=1.0)
    (recording,) = made.campaign.recordings
    lead = len(true) - len(recording)
    assert recording.period == true.period
    np.testing.assert_allclose(recording.p2, true.p2[lead:], rtol=0, atol=1.0)
    np.testing.assert_array_equal(recording.energised, true.energised[lead:])
    assert list(made.provenance()["files"][0]["sources"]) == [file.name for file in files]


def test_files_that_may_belong_together_are_named_with_the_mapping_to_give(true, tmp_path, capsys):
    (analog, digital), _ = analog_and_digital(tmp_path, true)
    out = ("--out", str(tmp_path / "out"), "--ambient-bar", "1")
    assert main(["import", str(analog), str(digital), *out]) == 2
    said = capsys.readouterr().err.strip()
    assert "analog.csv has no U, which digital.csv may hold: if these are one recording, join" in said
    (tmp_path / "map.json").write_text(said.partition(" such as ")[2])
    with pytest.raises(ImportingError, match="there is no unit of U"):
        read_files([analog, digital], mapping=tmp_path / "map.json", ambient_bar=1.0)


@pytest.mark.parametrize(
    ("files", "others", "said"),
    [
        (2, ["gone.csv"], "name 'gone.csv', which is not among analog.csv, digital.csv"),
        (1, ["digital.csv"], "name 'digital.csv', which is not among analog.csv: give that file, too"),
        (2, ["analog.csv", "digital.csv"], "joins analog.csv to itself or to a file that is joined"),
    ],
)
def test_a_mapping_that_joins_what_is_not_there_is_refused(true, files, others, said, tmp_path):
    given, channels = analog_and_digital(tmp_path, true)
    path = mapping(tmp_path / "map.json", "analog.csv", others, **channels)
    with pytest.raises(ImportingError, match=said):
        read_files(given[:files], mapping=path, ambient_bar=1.0)


def test_files_without_a_time_in_common_cannot_be_joined(true, tmp_path):
    files, channels = analog_and_digital(tmp_path, true)
    lines = files[1].read_text().splitlines()
    later = [f"{float(line.split(',')[0]) + 100},{line.split(',')[1]}" for line in lines[1:]]
    files[1].write_text("\n".join([lines[0], *later, ""]))
    path = mapping(tmp_path / "map.json", "analog.csv", ["digital.csv"], **channels)
    with pytest.raises(ImportingError, match="its channels have no time in common"):
        read_files(files, mapping=path, ambient_bar=1.0)


@pytest.mark.parametrize(("clipped", "end"), [("p2", 8.0), ("I", 0.4), ("p3", 12.0)])
def test_a_refusal_names_the_measurement_file_and_its_lines(true, clipped, end, tmp_path, capsys):
    """Not those of the campaign, which a dry run does not write."""
    columns = columns_of(true)
    columns[clipped] = (np.minimum(columns[clipped][0], end), columns[clipped][1])
    path = text(tmp_path / "run.csv", columns, head="# bench 3\n\n")
    line = ["import", str(path), "--out", str(tmp_path / "out"), "--ambient-bar", "1", "--dry-run"]
    assert main(line) == 2
    first = int(np.argmax(columns[clipped][0] == end))
    found = capsys.readouterr().err
    assert f"error: {path}, lines " in found
    assert "stays at" in found
    assert int(found.partition("lines ")[2].split()[0]) >= first + 4
