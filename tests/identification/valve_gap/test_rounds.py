"""Rounds of experiments: when they end, that nothing is recorded twice, and one run of the command."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from epv_env.plant.plantfile import Plant
from identification.__main__ import main
from identification.bench.programmes import Programme, save_programmes
from identification.bench.session import run_bench
from identification.gap.verdict import AMBIGUOUS, KNOWN, NO_GAP
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import CampaignError
from identification.report_2003 import Case
from identification.valve_gap import rounds as module
from identification.valve_gap.rounds import Bench, Round, rounds

SHORT = Programme(
    name="short", role="calibration", case=Case(name="short", openings=(0.03,), duration=0.2, first=0.06)
)
BENCH = Bench(truth=Plant.calibrated(), seed=5)


class Answers:
    """Stands for the diagnosis: its n-th answer for a campaign of n recordings, and a proposal."""

    def __init__(self, *answers: tuple[str, float]):
        self.answers = answers

    def __call__(self, campaign: Path, out: Path) -> Any:
        verdict, probability = self.answers[len(read_campaign(campaign).recordings) - 1]
        save_programmes([SHORT], out / "next.json")
        causes = [SimpleNamespace(probability=probability)]
        return SimpleNamespace(
            conclusion=SimpleNamespace(verdict=verdict, causes=causes),
            ranking=SimpleNamespace(no_cause=probability if verdict == NO_GAP else 0.0),
        )


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """Holds a campaign of one recording; `recorded` in it counts what the bench records."""
    write_campaign(run_bench([SHORT], BENCH.truth.parameters, seed=1), tmp_path / "campaign")
    (tmp_path / "out").mkdir()

    def counted(suite, *args, **options):
        with (tmp_path / "recorded").open("a") as stream:
            stream.write(suite[0].name + "\n")
        return run_bench(suite, *args, **options)

    monkeypatch.setattr(module, "run_bench", counted)
    return tmp_path


def ran(folder: Path, most: int, *answers: tuple[str, float], bench: Bench = BENCH) -> list[Round]:
    return list(rounds(folder / "campaign", folder / "out", most, bench, Answers(*answers)))


@pytest.mark.parametrize(
    ("answers", "added"),
    [
        ([(KNOWN, 0.96)], 0),
        ([(NO_GAP, 0.96)], 0),
        ([(NO_GAP, 0.6), (KNOWN, 0.9), (KNOWN, 0.95)], 2),
        ([(AMBIGUOUS, 0.97), (AMBIGUOUS, 0.97), (AMBIGUOUS, 0.97)], 2),
    ],
)
def test_they_end_when_one_answer_is_certain_or_all_are_spent(folder, answers, added):
    found = ran(folder, 2, *answers)
    assert [each.added for each in found] == list(range(added + 1))
    assert len(read_campaign(found[-1].campaign).recordings) == added + 1


def test_they_end_where_nothing_is_proposed(folder):
    nothing = rounds(
        folder / "campaign", folder / "out", 2, BENCH, Answers((KNOWN, 0.5)), lambda out: None
    )
    assert [each.added for each in nothing] == [0]


def test_nothing_is_recorded_twice(folder):
    doubt = (AMBIGUOUS, 0.5)
    ran(folder, 1, doubt, doubt)
    assert [each.added for each in ran(folder, 2, doubt, doubt, doubt)] == [1, 2]
    assert (folder / "recorded").read_text().split() == ["short_round_1", "short_round_2"]
    first, second, third = read_campaign(folder / "out" / "campaign-2").recordings
    assert first.digest() == read_campaign(folder / "campaign").recordings[0].digest()
    assert len({each.digest() for each in (first, second, third)}) == 3  # noise of their own


def test_recordings_of_another_campaign_are_refused(folder):
    ran(folder, 1, (AMBIGUOUS, 0.5), (AMBIGUOUS, 0.5))
    (folder / "campaign").rename(folder / "old")
    write_campaign(run_bench([SHORT], BENCH.truth.parameters, seed=2), folder / "campaign")
    with pytest.raises(CampaignError, match="give another --out"):
        ran(folder, 1, (AMBIGUOUS, 0.5), (AMBIGUOUS, 0.5))


def test_rounds_need_the_bench(tmp_path, capsys):
    assert main(["gap", str(tmp_path), "--out", str(tmp_path / "out"), "--rounds", "1"]) == 2
    assert "--rounds and --bench go together" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_adds_what_it_proposed(tmp_path):
    """Three short recordings leave a leaking seat in doubt."""
    programmes, truth = tmp_path / "programmes.json", str(tmp_path / "truth.json")
    held_out = Programme(name="held_out", role="validation", case=SHORT.case)
    save_programmes([SHORT, held_out], programmes)
    campaign, out = str(tmp_path / "campaign"), tmp_path / "out"
    recorded = ["--programme", str(programmes), "--effect", "seat_leak=2e-8", "--truth", truth]
    assert main(["bench", *recorded, "--out", campaign]) == 0
    assert main(["gap", campaign, "--out", str(out), "--rounds", "1", "--bench", truth]) == 0
    names = [recording.name for recording in read_campaign(out / "campaign-1").recordings]
    assert names[:2] == ["short", "held_out"]
    assert names[2].startswith("next_")
    assert json.loads((out / "gap.json").read_text())["format"] == "epv-gap/3"
