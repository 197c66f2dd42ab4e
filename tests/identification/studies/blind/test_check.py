"""A whole check with a stub as diagnosis: commitments first, each trial once, opened last."""

import hashlib
import json

import pytest

from identification.recordings.campaign_files import read_campaign
from identification.studies.blind import trials
from identification.studies.blind.bench import blind_suite
from identification.studies.blind.blind_study import blind_check
from identification.studies.blind.commitments import LABEL_FILE, RECORDINGS_FILE, open_commitment
from identification.studies.blind.settings import STRONG
from identification.studies.blind.trials import (
    COMMITMENTS_FILE,
    STUDY_FILE,
    check_study,
    generate_trial,
    read_commitments,
    trial_folder,
)
from tests.identification.studies.blind import stubs

N, SEED = 2, 162
"""The first trial has no effect, the second one an effect that the diagnosis lacks."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    out = tmp_path_factory.mktemp("blind")
    check(out)
    return out


def check(out, diagnosis=stubs.says_no_gap, seed=SEED):
    return blind_check(out, trials=N, seed=seed, workers=1, diagnosis=diagnosis)


def files(out):
    return {path: path.stat().st_mtime_ns for path in out.glob("trials/*/**/*") if path.is_file()}


def test_the_commitment_is_the_hash_of_the_label(study):
    committed = read_commitments(study / COMMITMENTS_FILE)
    for number in range(N):
        text = (trial_folder(study, number) / LABEL_FILE).read_bytes()
        assert hashlib.sha256(text).hexdigest() == committed[number]
        label, _ = open_commitment(trial_folder(study, number), committed[number])
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
    before, results = files(study), (study / "results.json").read_text()
    check(study, diagnosis=stubs.fails)
    assert files(study) == before
    assert (study / "results.json").read_text() == results
    assert "Verdicts" in (study / "results.html").read_text()


def test_a_missing_diagnosis_is_repeated_and_counts_as_failed(study, capfd):
    answer = trial_folder(study, 0) / "diagnosis" / "gap.json"
    kept = answer.read_text()
    answer.unlink()
    check(study, diagnosis=stubs.fails)
    assert "it did not converge" in capfd.readouterr().err
    content = json.loads((study / "results.json").read_text())
    assert content["shares"]["failed"]["hits"] == 1
    answer.write_text(kept)


def test_a_trial_is_the_same_whoever_makes_it(study, tmp_path):
    kind, causes = trials.trial_plan(SEED, N)[1]
    generate_trial(tmp_path, SEED, 1, kind, causes)
    folder = trial_folder(study, 1)
    for path in tmp_path.rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (folder / path.relative_to(tmp_path)).read_bytes()


def test_another_seed_is_refused(study):
    with pytest.raises(ValueError, match=f"trials of seed {SEED}"):
        check(study, seed=SEED + 1)


def test_other_forms_are_refused(study):
    with pytest.raises(ValueError, match="holds trials of forms usual: give --forms usual"):
        blind_check(study, trials=N, seed=SEED, workers=1, diagnosis=stubs.says_no_gap, settings=STRONG)


def test_a_study_from_before_there_were_strong_forms_goes_on(tmp_path):
    (tmp_path / STUDY_FILE).write_text('{"seed": 3}\n')
    check_study(tmp_path, seed=3, forms="usual")
    assert json.loads((tmp_path / STUDY_FILE).read_text()) == {"seed": 3, "forms": "usual"}


@pytest.mark.parametrize("name", [LABEL_FILE, RECORDINGS_FILE])
def test_a_changed_truth_is_refused(study, name):
    path = trial_folder(study, 1) / name
    kept = path.read_bytes()
    path.write_bytes(kept.replace(b'"kind"', b'"kinD"') if name == LABEL_FILE else kept + b" ")
    with pytest.raises(ValueError, match=name):
        check(study)
    path.write_bytes(kept)
    check(study)
