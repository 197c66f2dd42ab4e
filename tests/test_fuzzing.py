"""A spoilt file or option is read or refused in one sentence; nothing crashes or writes."""

import argparse
import copy
import importlib
import json
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("torch")
pytest.importorskip("jinja2")

from controllers.policy import TRAINED
from controllers.policy_files import CONTRACT_FILE, WEIGHTS_FILE, read_policy
from epv_env.common.commands import commands, main
from epv_env.common.files import Journal
from epv_env.common.options import Number, parser_of
from epv_env.plant.plantfile import Plant, load_plant, save_plant
from identification.bench.programmes import REPORT_SUITE, load_programmes, save_programmes
from identification.importing.mapping_file import read_mapping
from identification.monitor.model import MonitorModel
from identification.recordings.campaign_files import FILE_NAME, read_campaign, write_campaign
from identification.recordings.columns import REQUIRED_COLUMNS, read_columns
from tests.identification.monitor.test_monitor import white_model
from tests.identification.recordings.good_campaign import campaign_of, switching

pytestmark = pytest.mark.training
PACKAGES = [name for name in ("identification.commands", "training.commands") if find_spec(name)]

WRONG_VALUES: tuple[Any, ...] = (
    None, True, -1, 1.5, 1e300, 10**30, float("nan"), float("inf"), "", "x", "\0", "é" * 300, [], {},
    [[]], [None] * 50, {"": {}}, "../../etc/passwd", 2**63,
)  # fmt: skip


NO_NUMBERS = ("-1", "nan", "1e999", "9" * 400, "", "x")
"""What no option that takes a number takes: negative, infinite, beyond sense, or no number."""


def damaged_bytes(content: bytes, rng: np.random.Generator) -> bytes:
    """The content with bytes cut off, put in, changed, or repeated."""
    place = int(rng.integers(max(len(content), 1)))
    return [
        content[:place],
        content[:place] + rng.bytes(int(rng.integers(1, 20))) + content[place:],
        content[:place] + rng.bytes(1) + content[place + 1 :],
        content[: place + int(rng.integers(1, 200))] + content[place:],
        [b"[", b"{", b'"', b"9", b"\xff"][place % 5] * int(rng.integers(1, 200_000)),
    ][int(rng.integers(5))]


def damaged_value(content: bytes, rng: np.random.Generator) -> bytes:
    """JSON with one value removed or replaced."""
    value = copy.deepcopy(json.loads(content))
    places = list(_places(value))
    holder, key = places[int(rng.integers(len(places)))]
    if rng.random() < 0.25:
        del holder[key]
    else:
        holder[key] = WRONG_VALUES[int(rng.integers(len(WRONG_VALUES)))]
    return json.dumps(value).encode()


def _places(value: Any):
    """Every (holder, key) within a value."""
    for key in list(value) if isinstance(value, dict) else range(len(value)):
        yield value, key
        if isinstance(value[key], (dict, list)):
            yield from _places(value[key])


def _policy(folder: Path) -> None:
    source = TRAINED
    for name in (CONTRACT_FILE, WEIGHTS_FILE):
        (folder / name).write_bytes((source / name).read_bytes())


def _json(content: dict[str, Any], name: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(json.dumps(content))


def _table(folder: Path) -> None:
    names = [*REQUIRED_COLUMNS, "p1_bar"]
    rows = np.linspace(0.0, 1.0, 20 * len(names)).reshape(20, -1)
    lines = [",".join(names), *(",".join(f"{value:.6f}" for value in row) for row in rows)]
    (folder / "recording.csv").write_text("\n".join(lines) + "\n")


def _journal(folder: Path) -> None:
    journal = Journal(folder / "finished.jsonl", {"seed": 0})
    for k in range(3):
        journal.add(f"task {k}", {"value": k})


MAPPING = {
    "format": "epv-mapping/1", "environment": {"temperature_K": 293.0, "pressure_bar": 1.0},
    "channels": {"p2": {"source": "P2_raw", "unit": "mbar gauge", "factor": 1.0}},
    "recordings": {"a.mf4": {"role": "calibration", "name": "test1"}},
}  # fmt: skip

FORMATS: dict[str, tuple[Callable[[Path], object], Callable[[Path], object]]] = {
    "plant.json": (
        lambda folder: save_plant(Plant.calibrated(), folder / "plant.json"),
        lambda folder: load_plant(folder / "plant.json"),
    ),
    "next.json": (
        lambda folder: save_programmes(REPORT_SUITE, folder / "next.json"),
        lambda folder: load_programmes(folder / "next.json"),
    ),
    FILE_NAME: (lambda folder: write_campaign(campaign_of(switching()), folder), read_campaign),
    "mapping.json": (
        _json(MAPPING, "mapping.json"),
        lambda folder: read_mapping(folder / "mapping.json"),
    ),
    CONTRACT_FILE: (_policy, read_policy),
    WEIGHTS_FILE: (_policy, read_policy),
    "recording.csv": (
        _table,
        lambda folder: read_columns(
            "recording.csv", (folder / "recording.csv").read_bytes(), REQUIRED_COLUMNS
        ),
    ),
    "monitor.json": (
        lambda folder: white_model().save(folder / "monitor.json"),
        lambda folder: MonitorModel.load(folder / "monitor.json"),
    ),
    "finished.jsonl": (_journal, lambda folder: Journal(folder / "finished.jsonl", {"seed": 0})),
}
"""By the file's name: what fills a folder with a good one, and its reader."""


def refusal(read: Callable[[Path], object], folder: Path) -> str:
    """The sentence with which a reader refuses a folder's file; "still good" if it does not."""
    try:
        read(folder)
    except (ValueError, OSError) as found:
        return str(found)
    return "still good"


@pytest.mark.parametrize("name", FORMATS)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32 - 1))
def test_a_spoilt_file_is_refused_in_a_sentence(name, seed):
    write, read = FORMATS[name]
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write(folder)
        read(folder)  # what is spoilt here is good
        damage = damaged_value if name.endswith(".json") and rng.random() < 0.6 else damaged_bytes
        (folder / name).write_bytes(damage((folder / name).read_bytes(), rng))
        files = sorted(folder.iterdir())
        assert "\n" not in refusal(read, folder)
        assert sorted(folder.iterdir()) == files


def number_options(parser: argparse.ArgumentParser) -> list[str]:
    """The options of a parser that take a number."""
    return [
        action.option_strings[-1]
        for action in parser._actions
        if action.option_strings and (action.type in (int, float) or isinstance(action.type, Number))
    ]


@pytest.mark.parametrize("name", commands(PACKAGES))
def test_a_number_without_sense_is_refused_by_its_option(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    parser = parser_of(importlib.import_module(commands(PACKAGES)[name]), name)
    operands = [
        "nowhere" for action in parser._actions if not action.option_strings and action.nargs != "*"
    ]
    for option in number_options(parser):
        for value in NO_NUMBERS:
            line = [name, *operands, "--out", "fuzz-out", f"{option}={value}"]
            try:
                status = main(PACKAGES, program="epv", arguments=line)
            except SystemExit as end:
                status = end.code
            last = (capsys.readouterr().err.strip().splitlines() or [""])[-1]
            assert status == 2, (option, value)
            assert option.strip("-").replace("-", " ") in last.replace("-", " "), (option, value, last)
    assert list(tmp_path.iterdir()) == []
