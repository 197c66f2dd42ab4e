"""A whole check with a stub as diagnosis: commitments first, each trial once, opened last."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from docs.studies.blind import study
from docs.studies.blind.study import COMMITMENTS, LABEL, QUICK_SUITE, generate_trial, main, open_label
from docs.studies.blind.truth import trial_plan
from epv_env.common.files import write_text
from identification.recordings.campaign_files import read_campaign

pytestmark = pytest.mark.slow

N, SEED = 2, 162
"""The first trial has no effect, the second one an effect that the diagnosis lacks."""
NO_GAP = {"verdict": "no_gap", "where": {"component": {}}, "causes": [], "seconds": 0.5}


def says_no_gap(campaign, out, *, without, report):
    """Finds nothing, and leaves a note of what it was told."""
    seen = {"campaign": sorted(path.name for path in campaign.iterdir()), "without": list(without)}
    write_text(out / "seen.json", json.dumps(seen))
    write_text(out / "gap.json", json.dumps(NO_GAP))


def fails(campaign, out, **told):
    raise RuntimeError("it did not converge")


@contextmanager
def stub(diagnosis) -> Iterator[None]:
    """The study in this process, with another diagnosis."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "diagnose_campaign", diagnosis)
        patch.setattr(study, "in_processes", lambda f, jobs, what: [f(*job) for job in jobs])
        yield


def check(folder, diagnosis=says_no_gap):
    with stub(diagnosis):
        return study.scores(folder, trials=N, seed=SEED, forms="usual", suite=QUICK_SUITE)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """Results of the short form."""
    out = tmp_path_factory.mktemp("blind")
    with stub(says_no_gap):
        assert main(["--quick", "--seed", str(SEED), "--out", str(out)]) == 0
    return out


@pytest.fixture
def folder(out):
    return out / f"usual-{SEED}"


def trials(folder):
    return [folder / f"{number:04d}" for number in range(N)]


def hashes(folder):
    return [line.split()[0] for line in (folder / COMMITMENTS).read_text().splitlines()]


def test_the_commitment_is_the_hash_of_the_label_and_made_before_the_first_diagnosis(folder):
    for number, (trial, committed) in enumerate(zip(trials(folder), hashes(folder), strict=True)):
        assert hashlib.sha256((trial / LABEL).read_bytes()).hexdigest() == committed
        label = open_label(trial, committed)
        assert (label["trial"], len(label["salt"])) == (number, 32)
    first = min(path.stat().st_mtime_ns for path in folder.glob("*/diagnosis/seen.json"))
    assert max(path.stat().st_mtime_ns for path in folder.glob(f"*/{LABEL}")) < first


def test_a_diagnosis_gets_a_campaign_and_nothing_else(folder):
    plan = trial_plan(SEED, N)
    for number, trial in enumerate(trials(folder)):
        seen = json.loads((trial / "diagnosis" / "seen.json").read_text())
        campaign = read_campaign(trial / "campaign")
        assert seen["campaign"] == sorted(["campaign.json", *(f"{p.name}.csv" for p in QUICK_SUITE)])
        assert (campaign.name, len(campaign.recordings)) == (f"trial-{number:04d}", len(QUICK_SUITE))
        assert seen["without"] == (list(plan[number][1]) if number else [])


def test_a_rerun_repeats_nothing_and_scores_the_same(folder):
    def files():
        return {path: path.stat().st_mtime_ns for path in folder.glob("*/**/*") if path.is_file()}

    before, scores = files(), check(folder)
    assert check(folder, diagnosis=fails) == scores
    assert files() == before
    assert [score["verdict"] for score in scores] == ["no_gap"] * N


def test_a_missing_diagnosis_is_repeated_and_counts_as_failed(folder, capfd):
    answer = trials(folder)[0] / "diagnosis" / "gap.json"
    kept = answer.read_text()
    answer.unlink()
    scores = check(folder, diagnosis=fails)
    assert "it did not converge" in capfd.readouterr().err
    assert [score["verdict"] for score in scores] == ["failed", "no_gap"]
    answer.write_text(kept)


def test_a_trial_is_the_same_whoever_makes_it(folder, tmp_path):
    generate_trial(tmp_path, SEED, 1, *trial_plan(SEED, N)[1], "usual", QUICK_SUITE)
    for path in tmp_path.rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (trials(folder)[1] / path.relative_to(tmp_path)).read_bytes()


def test_a_changed_truth_is_refused(folder):
    path, committed = trials(folder)[1] / LABEL, hashes(folder)[1]
    kept = path.read_bytes()
    path.write_bytes(kept.replace(b'"kind"', b'"kinD"'))
    with pytest.raises(ValueError, match=LABEL):
        check(folder)
    with pytest.raises(ValueError, match="committed to before the diagnosis"):
        open_label(path.parent, committed)
    path.write_bytes(kept)
    check(folder)


def test_the_short_form_writes_results_and_page(out):
    found = json.loads((out / "results-usual.json").read_text(encoding="utf-8"))
    assert [trial["number"] for trial in found["each"]] == [0, 1]
    assert f"Seed {SEED}, 2 trials." in (out / "README.md").read_text(encoding="utf-8")
