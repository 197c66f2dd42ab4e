"""Trials diagnosed again under a disturbance, with stubs as diagnosis."""

import json

import pytest

from identification.recordings.campaign_files import read_campaign
from identification.report.page import Table
from identification.studies.blind.blind_study import blind_check
from identification.studies.blind.disturbances import told_noise
from identification.studies.blind.kinds import KIND_TITLES
from identification.studies.blind.robustness import robustness_check
from identification.studies.blind.robustness_section import (
    SAME_FIRST,
    PairOfScores,
    robustness_json,
    robustness_proportions,
    robustness_section,
)
from identification.studies.blind.score import score_trial
from identification.studies.blind.trials import trial_folder
from identification.studies.proportion import Proportion
from tests.identification.studies.blind import stubs
from tests.identification.studies.blind.hand_made import CLAMP, EDDY, NOTHING, answer, label

SEED = 162


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """One trial without an effect, judged right."""
    out = tmp_path_factory.mktemp("robustness")
    blind_check(out, trials=1, seed=SEED, workers=1, diagnosis=stubs.says_no_gap)
    return out


def disturb(out, disturbance, trials=1, diagnosis=stubs.says_no_gap):
    return robustness_check(out, disturbance, trials=trials, seed=SEED, workers=1, diagnosis=diagnosis)


def seen(out, disturbance):
    return json.loads((trial_folder(out, 0) / f"diagnosis-{disturbance}" / "seen.json").read_text())


def test_a_wrong_noise_is_told_with_the_same_recordings(study):
    disturb(study, "sigma=3")
    assert seen(study, "sigma=3")["noise"] == pytest.approx(told_noise("sigma=3"))
    assert not (trial_folder(study, 0) / "campaign-sigma=3").exists()
    content = json.loads((study / "robustness-sigma=3.json").read_text())
    assert content["shares"]["same verdict"]["hits"] == content["trials"] == 1
    assert "All answers stayed the same" in (study / "robustness-sigma=3.html").read_text()


def test_a_ripple_has_a_campaign_of_its_own_which_a_rerun_keeps(study):
    disturb(study, "ripple")
    assert seen(study, "ripple")["noise"] is None
    folder = trial_folder(study, 0) / "campaign-ripple"
    calm, rippled = (read_campaign(f) for f in (trial_folder(study, 0) / "campaign", folder))
    assert rippled.recordings[0].digest() != calm.recordings[0].digest()
    written = (folder / "campaign.json").stat().st_mtime_ns
    disturb(study, "ripple", diagnosis=stubs.fails)
    assert (folder / "campaign.json").stat().st_mtime_ns == written
    assert json.loads((study / "robustness-ripple.json").read_text())["each"][0]["verdicts"] == [
        "no_gap", "no_gap"
    ]  # fmt: skip


def test_the_study_s_own_diagnoses_and_results_stay(study):
    before = (study / "results.json").read_bytes()
    disturb(study, "sigma=0.3")
    assert (study / "results.json").read_bytes() == before
    own = json.loads((trial_folder(study, 0) / "diagnosis" / "seen.json").read_text())
    assert own["noise"] is None


def test_more_trials_than_there_are_are_refused(study):
    with pytest.raises(ValueError, match="holds 1 of 2 trials: run the study without --disturb first"):
        disturb(study, "ripple", trials=2)


def pair(truth, before, after):
    before, after = (score_trial(truth, said, None) for said in (before, after))
    return PairOfScores(before=before, after=after)


def pairs():
    """Named again, named otherwise, no longer named, and a false alarm where there was none."""
    return [
        pair(label(trial=0), answer("known", EDDY), answer("ambiguous", EDDY, CLAMP, named=2)),
        pair(label(trial=1), answer("known", EDDY), answer("known", CLAMP)),
        pair(label(trial=2), answer("known", EDDY), answer("unknown", EDDY)),
        pair({**NOTHING, "trial": 3}, answer("no_gap"), answer("known", EDDY)),
    ]


def test_shares_of_answers_that_stay():
    found = robustness_proportions(pairs())
    assert found[SAME_FIRST] == Proportion(hits=1, of=3)
    assert found["same first cause in the list"] == Proportion(hits=2, of=3)
    assert found["same verdict"] == Proportion(hits=1, of=4)
    assert found["false alarms without an effect"] == Proportion(hits=1, of=1)
    assert found["... undisturbed"] == Proportion(hits=0, of=1)
    assert found["first cause right, ties counted as wrong"] == Proportion(hits=1, of=3)
    assert found["... of it undisturbed"] == Proportion(hits=3, of=3)
    assert found["false effect held"] == Proportion(hits=1, of=4)


def test_the_order_of_effects_does_not_change_a_cause():
    both = ["eddy_current", "flyback_voltage"]
    one, other = (answer("known", (effects, 0.9, {})) for effects in (both, both[::-1]))
    assert pair(label("pair", both), one, other).same_first_cause


def test_changes_are_listed_and_counted_by_verdict():
    section = robustness_section("ripple", pairs())
    assert section.verdicts[0].status == "bad"
    assert "1 of 3" in section.verdicts[0].text
    changed = section.blocks[-1]
    assert isinstance(changed, Table)
    assert [row[0] for row in changed.rows] == ["0000", "0001", "0002", "0003"]
    assert changed.rows[3][1] == KIND_TITLES["none"]
    content = robustness_json("ripple", pairs(), seed=0)
    assert content["verdicts"]["known"] == {
        "no_gap": 0, "known": 1, "ambiguous": 1, "partial": 0, "unknown": 1, "failed": 0,
    }  # fmt: skip
    json.dumps(content, allow_nan=False)
