"""Bad recordings are refused in one sentence: file, place, rule and remedy; nothing is written."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import CampaignError
from tests.identification.recordings.good_campaign import campaign_of, good_campaign, resting, switching

Change = Callable[[Path], None]
"""Damages a good campaign: test1.csv (calibration), validation.csv, rest.csv (quality)."""


@cache
def good_files() -> dict[str, bytes]:
    """Content of the files of a good campaign, by name."""
    with TemporaryDirectory() as folder:
        write_campaign(good_campaign(), folder)
        return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


@pytest.fixture
def folder(tmp_path):
    for name, content in good_files().items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


def text(change: Callable[[str], str], file: str = "test1.csv") -> Change:
    """Changes a file's text."""

    def apply(folder: Path) -> None:
        path = folder / file
        path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")

    return apply


def rows(change: Callable[[list[list[str]]], object], file: str = "test1.csv") -> Change:
    """Changes the cells of a file's lines, in place; the header is row 0."""

    def apply(content: str) -> str:
        cells = [row.split(",") for row in content.splitlines()]
        change(cells)
        return "\n".join(",".join(row) for row in cells)

    return text(apply, file)


def cell(column: str, line: int, value: str) -> Change:
    """Puts a text into one cell of test1.csv; the header is line 1."""
    return rows(lambda cells: cells[line - 1].__setitem__(cells[0].index(column), value))


def column(name: str, change: Callable[[NDArray], NDArray], file: str = "test1.csv") -> Change:
    """Changes a column's numbers."""

    def apply(cells: list[list[str]]) -> None:
        place = cells[0].index(name)
        values = change(np.array([row[place] for row in cells[1:]], dtype=float))
        for row, value in zip(cells[1:], values, strict=True):
            row[place] = f"{value:.6f}"

    return rows(apply, file)


def held(name: str, samples: slice, value: float, file: str = "test1.csv") -> Change:
    """Puts one value into some samples of a column."""

    def apply(values: NDArray) -> NDArray:
        values[samples] = value
        return values

    return column(name, apply, file)


def manifest(change: Callable[[dict], object]) -> Change:
    """Changes what campaign.json says, in place."""

    def apply(content: str) -> str:
        decoded = json.loads(content)
        change(decoded)
        return json.dumps(decoded)

    return text(apply, "campaign.json")


def entry(**fields: object) -> Change:
    """Changes the campaign's second recording."""
    return manifest(lambda content: content["recordings"][1].update(fields))


def environment(**fields: object) -> Change:
    """Changes the campaign's ambient conditions."""
    return manifest(lambda content: content["environment"].update(fields))


def without_column(cells: list[list[str]], name: str) -> None:
    place = cells[0].index(name)
    for row in cells:
        del row[place]


def with_column(cells: list[list[str]], name: str) -> None:
    for number, row in enumerate(cells):
        row.append("12.0" if number else name)


def linked(folder: Path) -> None:
    """test1.csv lies elsewhere."""
    target = folder.parent / f"{folder.name}-outside.csv"
    (folder / "test1.csv").rename(target)
    (folder / "test1.csv").symlink_to(target)


def late(pressure: NDArray) -> NDArray:
    """It settles only after the beginning."""
    return pressure - 0.8 * (np.arange(len(pressure)) < 50)


def jittered(time: NDArray) -> NDArray:
    return time + np.where(np.arange(len(time)) % 7 == 3, 1e-4, 0.0)


CSV_FILES = [  # damage, place, rule, remedy
    (rows(lambda c: without_column(c, "p2_bar")), "line 1", "missing p2_bar", "name these columns"),
    (text(lambda t: t.replace(",", ";")), "line 1", "missing time_s, I_A", "separated by commas"),
    (text(lambda t: ""), "line 1", "missing time_s", "name these columns"),
    (rows(lambda c: with_column(c, "I_A")), "line 1", "'I_A' stands twice", "keep one"),
    (rows(lambda c: with_column(c, "p1a_bar")), "line 1", "p1_bar and p1a_bar", "both p1a_bar and"),
    (text(lambda t: t.replace("p1_bar", "p", 1)), "line 1", "p1 is given by no", "give p1_bar, or"),
    (cell("I_A", 7, "much"), "line 7", "I_A is 'much', not a finite number", "'.' as decimal sign"),
    (cell("I_A", 7, '"0,55"'), "line 7", "I_A is '0,55', not a finite number", "'.' as decimal sign"),
    (cell("I_A", 7, "0_5"), "line 7", "I_A is '0_5', not a finite number", "give one"),
    (cell("I_A", 7, "0,55"), "line 7", r"Expected \d fields in line 7, saw \d", "'.' as decimal sign"),
    (cell("p3_bar", 8, "-inf"), "line 8", "p3_bar is '-inf', not a finite number", "cut the recording"),
    (cell("U_V", 1301, ""), "line 1301", "U_V is empty, not a finite number", "cut the recording"),
    (cell("U_V", 9, '"24.0'), "line 8", "not CSV", "give every column one cell"),
    (text(lambda t: t.replace("\n", "\n\n", 3)), "line 2", "time_s is empty", "cut the recording"),
    (text(lambda t: t[: t.rindex(",")]), "line 1302", "_bar is empty", "cut the recording"),
    (column("time_s", lambda t: t + 0.1), "line 2", "starts at 0.1 and must start at 0", "subtract"),
    (column("time_s", lambda t: t[::-1] - t[-1]), "line 3", "0 to -0.0005 and must increase", "sort"),
    (column("time_s", lambda t: np.round(t, 3)), "line 3", "0 to 0 and must increase", "more digits"),
    (rows(lambda c: c.pop(600)), "line 601", "0.299 to 0.3 and must be uniform", "cut the recording"),
    (column("time_s", lambda t: t + 0.0002 * (t > 0.3)), "line 603", "uniform sampling has", "resample"),
    (column("time_s", jittered), "line ", "rounding to the printed digits does not", "resample"),
    (rows(lambda c: c.__delitem__(slice(1, None))), "line 2", "ends after 0 samples", "for longer"),
    (rows(lambda c: c.__delitem__(slice(81, None))), "line 81", "needs at least 81", "for longer"),
    (held("I_A", slice(None), 0.5), "lines 2 to 1302", "I_A is 0.5 throughout", "check its sensor"),
    (held("p3_bar", slice(None), 16), "lines 2 to 1302", "p3_bar is 16 throughout", "check its sensor"),
    (column("p2_bar", lambda p: 1e2 * p), "p2 rises to 8", "beyond the sensor", "check unit"),
    (column("p3_bar", lambda p: p - p.min()), "p3 falls to", "below the ambient", "sensor of p3_bar"),
    (cell("p2_bar", 40, "16.3"), "line 40", r"p2_bar is 16.3, outside .*\[1, 16\]", "check unit and"),
    (cell("I_A", 40, "1.02"), "line 40", r"I_A is 1.02, outside .*\[-1, 1\]", "check unit and scaling"),
    (held("p2_bar", slice(300, 400), 16.256), "lines 302 to 401", "p2_bar stays at 16.256", "record"),
    (held("p3_bar", slice(300, 341), 1.0), "lines 302 to 342", "p3_bar stays at 1, its least", "record"),
    (held("U_V", slice(None), 0), "lines 2 to 1302", "U_V never switches", "the role quality"),
    (column("U_V", lambda U: 24 + U / 2400), "lines 2 to 1302", "U_V never switches", "record a switch"),
    (held("U_V", slice(70, 90), 0), "line 72", "U_V is 0 V at 35 ms, .* at least 40 ms", "record from"),
    (column("U_V", lambda U: 24 - U), "a current of", "A flows while the coil is off", "check unit"),
    (column("p2_bar", late), "lines 2 to 81", "p2_bar changes by 0.[0-9]*", "bench settle"),
]  # fmt: skip

OTHER_ROLES = [
    ("validation.csv", held("U_V", slice(None), 24, "validation.csv"), "lines 2 to 1302", "U_V never"),
    ("validation.csv", held("U_V", slice(5, 9), 0, "validation.csv"), "line 7", "start energised"),
    ("rest.csv", held("p1_bar", slice(None), 1, "rest.csv"), "lines 2 to 1001", "p1_bar is 1 through"),
    ("rest.csv", rows(lambda c: c.__delitem__(slice(1000, None)), "rest.csv"), "line 1000", "at least"),
]  # fmt: skip

MANIFESTS = [  # damage, message
    (text(lambda t: t[:-9], "campaign.json"), "is not JSON in UTF-8 .*line 2.*, or write the file as"),
    (text(lambda t: "[]", "campaign.json"), "has format None, this version reads 'epv-campaign/1'"),
    (manifest(lambda c: c.update(format="epv-campaign/2")), "has format 'epv-campaign/2', this version"),
    (manifest(lambda c: c.pop("name")), "field 'name' is missing: give the folder"),
    (manifest(lambda c: c.update(name=3)), "name: expected str, found int: give the folder"),
    (manifest(lambda c: c.update(recordings=[])), "recordings is empty: name at least one file"),
    (environment(temperature_K=True), "temperature_K: expected float, found bool"),
    (environment(temperature_K=20), r"T_env = 20 K is outside its domain \[233, 353\].*: give a value"),
    (environment(pressure_bar=101325), r"p_env = .* Pa is outside its domain .*: give a value inside"),
    (environment(pressure_bar=float("nan")), "is not JSON .*NaN is no number.*: give"),
    (environment(pressure_bar=10**400), "a whole number of 401 digits"),
    (manifest(lambda c: c["recordings"].append("x.csv")), "recordings.3.: expected object, found str"),
    (entry(role="test"), "recording 2: unknown role 'test': choose one of calibration, valid"),
    (entry(file="./test1.csv"), "recording 2: test1.csv is named twice, .*: name each file once"),
    (entry(file="sub/test1.csv"), "recording 2: test1.csv is named twice, .*once, and rename"),
    (entry(file="../test1.csv"), "recording 2: file '../test1.csv' leaves the folder: "),
    (entry(file="a\0.csv"), "recording 2: file .* leaves the folder: copy it there"),
    (linked, "recording 1: file 'test1.csv' leaves the folder: copy it there"),
]  # fmt: skip


def refusal(folder: Path) -> str:
    """The sentence with which a campaign is refused; reading leaves the folder as it was."""
    before = {path: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(CampaignError) as caught:
        read_campaign(folder)
    assert {path: path.read_bytes() for path in folder.iterdir()} == before
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_the_campaign_that_is_damaged_here_is_good(folder):
    assert len(read_campaign(folder).recordings) == 3


@pytest.mark.parametrize(
    ("damage", "place", "rule", "remedy"), CSV_FILES, ids=[f"{case[1]}: {case[2]}" for case in CSV_FILES]
)
def test_a_bad_recording_is_refused(folder, damage, place, rule, remedy):
    damage(folder)
    sentence = f"^{re.escape(str(folder / 'test1.csv'))}[,:] {place}.*{rule}.*: .*{remedy}"
    assert re.search(sentence, refusal(folder)), refusal(folder)


@pytest.mark.parametrize(
    ("file", "damage", "place", "rule"),
    OTHER_ROLES,
    ids=[f"{case[0]}: {case[3]}" for case in OTHER_ROLES],
)
def test_rules_hold_in_the_other_roles(folder, file, damage, place, rule):
    damage(folder)
    sentence = f"^{re.escape(str(folder / file))}, {place}.*{rule}.*: "
    assert re.search(sentence, refusal(folder)), refusal(folder)


@pytest.mark.parametrize(("damage", "message"), MANIFESTS, ids=[case[1] for case in MANIFESTS])
def test_a_bad_campaign_json_is_refused(folder, damage, message):
    damage(folder)
    sentence = f"^{re.escape(str(folder / 'campaign.json'))}.*{message}"
    assert re.search(sentence, refusal(folder)), refusal(folder)


def test_a_missing_campaign_json_is_refused(folder):
    (folder / "campaign.json").unlink()
    assert re.search(r"cannot read .*campaign\.json .No such.*: give the folder", refusal(folder))


def test_a_missing_recording_is_refused(folder):
    (folder / "rest.csv").unlink()
    assert re.search(r"rest.csv cannot be read \(No such file.*: add the file, or", refusal(folder))


def test_a_recording_in_another_encoding_is_refused(folder):
    content = (folder / "test1.csv").read_bytes().replace(b"\n", b",\xb0C\n")
    (folder / "test1.csv").write_bytes(content)
    assert re.search("test1.csv, line 1: a byte is not UTF-8: save the file", refusal(folder))


def renamed(name: str):
    return replace(switching(), name=name)


@pytest.mark.parametrize(
    ("campaign", "message"),
    [
        (campaign_of(), "recordings is empty"),
        (campaign_of(switching(), switching()), "recording 2: test1.csv is named twice"),
        (campaign_of(renamed("../test1")), "leaves the folder"),
        (campaign_of(renamed("sub/test1")), "'sub/test1' does not name a file: give it a name without"),
        (campaign_of(renamed("")), "'' does not name a file"),
        (campaign_of(replace(switching(), role="test")), "unknown role 'test'"),
        (campaign_of(replace(resting(), role="calibration")), "rest.csv, .* U_V never switches"),
        (campaign_of(resting(), replace(switching(), p1=switching().p1[1:])), "p1_bar has shape"),
        (campaign_of(replace(switching(), I=switching().I * np.nan)), "I_A has .* not finite"),
        (replace(good_campaign(), temperature=20.0), "T_env = 20 K is outside its domain"),
    ],
)
def test_nothing_is_written_of_a_bad_campaign(tmp_path, campaign, message):
    with pytest.raises(CampaignError, match=message):
        write_campaign(campaign, tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_a_campaign_is_not_written_over_another(folder):
    with pytest.raises(CampaignError, match="exists already: write to another folder"):
        write_campaign(campaign_of(switching(name="another")), folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == good_files()
