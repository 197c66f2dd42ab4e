"""A whole check with a stub as diagnosis: commitments first, each trial once, opened last."""

import hashlib
import json

import pytest

from identification.blind import trials
from identification.blind.bench import blind_suite
from identification.blind.sealing import LABEL_FILE, open_label, read_commitments, trial_folder
from identification.blind.trials import blind_scores, generate_trial
from identification.recordings.campaign_files import read_campaign
from tests.identification.blind import stubs

N, SEED = 2, 162
"""The first trial has no effect, the second one an effect that the diagnosis lacks."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    out = tmp_path_factory.mktemp("blind")
    check(out)
    return out


def check(out, diagnosis=stubs.says_no_gap, seed=SEED, forms="usual"):
    return blind_scores(out, trials=N, seed=seed, workers=1, diagnosis=diagnosis, forms=forms)


def files(out):
    return {path: path.stat().st_mtime_ns for path in out.glob("trials/*/**/*") if path.is_file()}


def test_the_commitment_is_the_hash_of_the_label(study):
    committed = read_commitments(study)
    for number in range(N):
        text = (trial_folder(study, number) / LABEL_FILE).read_bytes()
        assert hashlib.sha256(text).hexdigest() == committed[number]
        label = open_label(trial_folder(study, number), committed[number])
        assert label["trial"] == number
        assert len(label["salt"]) == 32


def test_the_truths_are_committed_to_before_the_first_diagnosis(study):
    first = min(path.stat().st_mtime_ns for path in study.glob("trials/*/diagnosis/seen.json"))
    last = max(path.stat().st_mtime_ns for path in study.glob(f"trials/*/{LABEL_FILE}"))
    assert last < first


def test_a_diagnosis_gets_a_campaign_and_nothing_else(study):
    for number in range(N):
        folder = trial_folder(study, number)
        seen = json.loads((folder / "diagnosis" / "seen.json").read_text())
        campaign = read_campaign(folder / "campaign")
        assert seen["campaign"] == sorted(
            ["campaign.json", *(f"{r.name}.csv" for r in campaign.recordings)]
        )
        assert (campaign.name, len(campaign.recordings)) == (f"trial-{number:04d}", len(blind_suite()))
        assert seen["without"] == json.loads((folder / LABEL_FILE).read_text())["struck"]


def test_a_rerun_repeats_nothing_and_scores_the_same(study):
    before, scores = files(study), check(study)
    assert check(study, diagnosis=stubs.fails) == scores
    assert files(study) == before
    assert [score.verdict for score in scores] == ["no_gap"] * N


def test_a_missing_diagnosis_is_repeated_and_counts_as_failed(study, capfd):
    answer = trial_folder(study, 0) / "diagnosis" / "gap.json"
    kept = answer.read_text()
    answer.unlink()
    scores = check(study, diagnosis=stubs.fails)
    assert "it did not converge" in capfd.readouterr().err
    assert [score.verdict for score in scores] == ["failed", "no_gap"]
    answer.write_text(kept)


def test_a_trial_is_the_same_whoever_makes_it(study, tmp_path):
    kind, causes = trials.trial_plan(SEED, N)[1]
    generate_trial(tmp_path, SEED, 1, kind, causes, "usual")
    folder = trial_folder(study, 1)
    for path in tmp_path.rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (folder / path.relative_to(tmp_path)).read_bytes()


def test_another_seed_and_other_forms_are_refused(study):
    with pytest.raises(ValueError, match=f"trials of seed {SEED}"):
        check(study, seed=SEED + 1)
    with pytest.raises(ValueError, match="holds trials of forms usual: give --forms usual"):
        check(study, forms="strong")


def test_a_changed_truth_is_refused(study):
    path = trial_folder(study, 1) / LABEL_FILE
    kept = path.read_bytes()
    path.write_bytes(kept.replace(b'"kind"', b'"kinD"'))
    with pytest.raises(ValueError, match=LABEL_FILE):
        check(study)
    with pytest.raises(ValueError, match="committed to before the diagnosis"):
        open_label(path.parent, read_commitments(study)[1])
    path.write_bytes(kept)
    check(study)
