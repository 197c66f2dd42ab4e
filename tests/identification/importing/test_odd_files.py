"""Files as tools and people leave them: read right, or refused with the remedy."""

import json
import re
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from identification.importing.binary_files import read_matlab, read_parquet
from identification.importing.import_campaign import read_files, read_source, source_table
from identification.importing.mapping_file import ChannelEntry, MappingFile
from identification.importing.source_file import ImportingError, SourceChannel, SourceFile
from tests.identification.importing.dialects import bench, columns_of, mat5, tdms, text
from tests.identification.importing.odd_files import (
    NAMES,
    READ,
    REFUSED,
    UNITS,
    interval,
    mdf_groups,
    nan,
    nulls,
    texts,
)


@pytest.fixture(scope="module")
def true():
    """The validation recording of the virtual bench."""
    return bench().recordings[1]


@pytest.mark.parametrize("kind", READ)
def test_the_files_of_many_tools_give_the_recording(true, kind, tmp_path):
    path = READ[kind](tmp_path / "run", true)
    made = read_files([path], ambient_bar=1.0).campaign.recordings[0]
    np.testing.assert_allclose(made.p2, true.p2, rtol=0, atol=1.0)
    assert made.period == true.period


@pytest.mark.parametrize("kind", ["matrix", "cells"])
def test_a_matrix_of_signals_times_samples_has_a_channel_per_signal(true, kind, tmp_path):
    signals = [values for values, _ in columns_of(true).values()]
    cells = np.empty(len(signals), dtype=object)
    cells[:] = signals
    path = mat5(tmp_path / "run", {"ans": signals if kind == "matrix" else cells})
    pairs = enumerate(zip(NAMES, UNITS, strict=True), start=1)
    channels = {n: ChannelEntry(source=f"ans({i})", unit=unit) for i, (n, unit) in pairs}
    made = read_files([path], mapping=MappingFile(channels=channels), ambient_bar=1.0).campaign
    np.testing.assert_allclose(made.recordings[0].p2, true.p2, rtol=0, atol=1.0)


@pytest.mark.parametrize("write", [lambda at, r: mdf_groups(at, r, invalid=slice(100, 131)), nulls, nan])
def test_readings_that_a_format_marks_as_invalid_are_missing(true, write, tmp_path):
    path = write(tmp_path / "run", true)
    channel = next(c for c in read_source(path).channels if c.name.startswith("p2"))
    assert np.count_nonzero(np.isnan(channel.values)) == 31
    with pytest.raises(ImportingError, match=r"readings 1\d\d to 1\d\d are empty or .* is not filled$"):
        read_files([path], ambient_bar=1.0)


def test_a_file_that_was_cut_within_its_last_cell_loses_that_line(true, tmp_path):
    path = text(tmp_path / "run.csv", columns_of(true))
    whole = path.read_text()
    for cut, lost in ((0, 0), (1, 0), (4, 1), (10, 1)):
        path.write_text(whole[: len(whole) - cut])
        made = read_files([path], ambient_bar=1.0)
        assert len(made.campaign.recordings[0]) == len(true) - lost
        said = f"line {len(true) + 1} may be cut off in its last cell and is left out" in source_table(
            made.files[0].source
        )
        assert said == bool(lost)


def test_all_names_of_two_groups_are_in_one_mapping(true, tmp_path):
    path = tdms(tmp_path / "run", columns_of(true), first={}, second={})
    with pytest.raises(ImportingError, match="p2 may be 'first/p2' or 'second/p2'") as error:
        read_files([path], ambient_bar=1.0)
    (tmp_path / "map.json").write_text(str(error.value).partition(" such as ")[2])
    made = read_files([path], mapping=tmp_path / "map.json", ambient_bar=1.0).campaign
    np.testing.assert_allclose(made.recordings[0].p2, true.p2, rtol=0, atol=1e-6)


def test_a_channel_without_readings_is_shown_as_empty():
    channel = SourceChannel(name="p2", unit="bar", values=np.zeros(0), time=np.zeros(0))
    source = SourceFile(path=Path("run.mf4"), format="MDF", sha256="", channels=(channel,))
    assert "p2  bar empty" in source_table(source)


def test_one_name_in_two_groups_is_chosen_by_its_group(true, tmp_path):
    path = mdf_groups(tmp_path / "run", true, second=4)
    with pytest.raises(ImportingError, match="p2 may be 'group 0/p2' or 'group 1/p2'"):
        read_files([path], ambient_bar=1.0)
    for group, period in ((0, true.period), (1, 4 * true.period)):
        mapping = MappingFile(channels={"p2": ChannelEntry(source=f"group {group}/p2")})
        made = read_files([path], mapping=mapping, ambient_bar=1.0).campaign.recordings[0]
        assert made.period == period


def test_units_alone_are_a_mapping_and_the_error_shows_it(true, tmp_path):
    path = text(tmp_path / "run.csv", columns_of(true), bracket=False)
    with pytest.raises(ImportingError, match="there is no unit of") as error:
        read_files([path], ambient_bar=1.0)
    (tmp_path / "map.json").write_text(str(error.value).partition(" such as ")[2])
    made = read_files([path], mapping=tmp_path / "map.json", ambient_bar=1.0).campaign.recordings[0]
    units = {"I": {"unit": "A"}, "U": {"unit": "V"}, **{p: {"unit": "bar"} for p in NAMES[3:]}}
    (tmp_path / "map.json").write_text(json.dumps({"format": "epv-mapping/1", "channels": units}))
    same = read_files([path], mapping=tmp_path / "map.json", ambient_bar=1.0).campaign.recordings[0]
    np.testing.assert_array_equal(made.p2, same.p2)


def test_a_whole_bench_can_be_gauge(true, tmp_path):
    columns = {n: (v - (u == "bar"), u) for n, (v, u) in columns_of(true).items()}
    path = text(tmp_path / "run.csv", columns)
    made = read_files([path], ambient_bar=1.0, gauge=True).campaign.recordings[0]
    np.testing.assert_allclose(made.p2, true.p2, rtol=0, atol=1.0)


@pytest.mark.parametrize(
    ("name", "role"), [("run_valid", "validation"), ("Validierung3", "validation"),
                       ("invalid_run", "calibration"), ("run_Invalid", "calibration")],
)  # fmt: skip
def test_only_a_name_of_validation_holds_a_file_out(true, name, role, tmp_path):
    path = text(tmp_path / f"{name}.csv", columns_of(true))
    assert read_files([path], ambient_bar=1.0).campaign.recordings[0].role == role


@pytest.mark.parametrize(
    ("write", "fault"),
    [(texts, "p2 [bar] is 'high', not a number (line 1)"),
     (lambda at, r: mat5(at, {**interval(r), "p2_bar": 1j * r.p2}), "p2_bar holds complex numbers")],
)  # fmt: skip
def test_a_series_without_numbers_that_is_needed_is_refused(true, write, fault, tmp_path):
    with pytest.raises(ImportingError, match=re.escape(fault)):
        read_files([write(tmp_path / "run", true)], ambient_bar=1.0)


@pytest.mark.parametrize("kind", REFUSED)
def test_the_rest_is_refused_with_the_remedy(true, kind, tmp_path):
    write, message = REFUSED[kind]
    with pytest.raises(ImportingError, match=message):
        read_files([write(tmp_path / "run", true)], ambient_bar=1.0)


def packed_matlab(path):
    """A compressed matrix (type 15, then 14) of 2**28 numbers, of which only the head is there."""
    head = struct.pack("<4I", 6, 8, 6, 0) + struct.pack("<2I2i", 5, 8, 1, 2**28)
    name = struct.pack("<2H4s", 1, 2, b"p2")
    packed = zlib.compress(struct.pack("<2I", 14, 2**31) + head + name + bytes(1000))
    begin = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x0100, b"IM")
    path.write_bytes(begin + struct.pack("<2I", 15, len(packed)) + packed)


def packed_hdf5(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("p2_bar", (1, 2**28), "f8", chunks=(1, 2**20), compression="gzip")


def packed_parquet(path):
    part = pa.table({"p2_bar": np.zeros(2**24)})
    with pq.ParquetWriter(path, part.schema, compression="zstd") as file:
        for _ in range(9):
            file.write_table(part)


@pytest.mark.parametrize(
    ("write", "read"),
    [(packed_matlab, read_matlab), (packed_hdf5, read_matlab), (packed_parquet, read_parquet)],
)
def test_a_small_file_that_unpacks_to_gigabytes_is_refused_at_once(write, read, tmp_path):
    write(tmp_path / "bomb")
    assert (tmp_path / "bomb").stat().st_size < 2**22
    with pytest.raises(ImportingError, match="unpacks to more than 1,073,741,824 bytes"):
        read(tmp_path / "bomb")
