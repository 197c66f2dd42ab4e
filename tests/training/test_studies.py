"""The studies of controllers in their short form: result files, pictures, and the page's tables."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("stable_baselines3")

from controllers.policy import TRAINED, load_policy
from controllers.tuned import tuned
from docs.studies.common import PAGE
from docs.studies.comparison import study as comparison
from docs.studies.sim_to_real import study as sim_to_real
from epv_env.common.files import write_json
from epv_env.plant.effects.registry import CATALOGUE
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, load_plant, save_plant
from epv_env.plant.region import Alternative, Mixture, Region
from identification.bench.session import run_programme
from identification.commands import gap
from identification.gap.report.gap_json import FORMAT
from identification.recordings.campaign_files import read_campaign
from training.commands import sim_to_real as command
from training.evaluation.rollout import run_episodes

pytestmark = [pytest.mark.training, pytest.mark.slow]


def test_the_comparison(tmp_path, monkeypatch):
    both = ("adaptive pulse", "extrapolating hysteresis")
    monkeypatch.setattr(comparison, "CONTROLLERS", both)
    few = {"beyond": (4, both), "faults": (4, both[:1]), "worn": (4, both)}
    monkeypatch.setattr(comparison, "GROUPS", few)
    assert comparison.main(["--quick", "--out", str(tmp_path)]) == 0
    names = {"comparison.csv", "differences.csv", "beyond.csv", "comparison.png", PAGE}
    assert names <= {path.name for path in tmp_path.iterdir()}
    assert "| extrapolating hysteresis |" in (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "restart" in set(pd.read_csv(tmp_path / "beyond.csv")["scenario"])


def test_the_loop(tmp_path, monkeypatch):
    """With a diagnosis that is right, and the package's policy for each training."""

    def diagnosed(options):
        true = load_plant(options.campaign.parent / sim_to_real.WITHHELD)
        answer = Alternative(name="piston_friction", probability=1.0, region=true.region)
        recordings = read_campaign(options.campaign).recordings
        about = {"recordings_sha256": {r.name: r.sha256 for r in recordings if r.role != "quality"}}
        found = replace(true, diagnosis=Mixture(alternatives=(answer,)), provenance=about)
        save_plant(found, options.out / "plant.json")
        said = {"format": FORMAT, "verdict": "known", "causes": [], "ambiguity_set": [], "gap": {}}
        write_json(options.out / "gap.json", said, allow_nan=False)

    def trained(folder, *plants, **options):
        shutil.copytree(TRAINED, folder, dirs_exist_ok=True)
        return load_policy()

    monkeypatch.setattr(gap, "run", diagnosed)
    monkeypatch.setattr(command, "trained", trained)
    monkeypatch.setattr(sim_to_real, "run_programme", lambda p, each, **_: run_programme(p, each))
    assert sim_to_real.main(["--quick", "--out", str(tmp_path)]) == 0
    text = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "| piston friction | known: piston friction 1.00 | " in text
    assert len(pd.read_csv(tmp_path / "results.csv")) == len(sim_to_real.ARMS)
    assert sim_to_real.main(["--quick", "--out", str(tmp_path)]) == 0  # from the journals alone


def test_an_uneven_lag_without_unevenness_is_the_environment_s_own():
    parameters = Parameters.calibrated().replace(tau_p2=0.02)
    plant = Plant(parameters=parameters, region=Region(centre=parameters))
    policy = tuned("adaptive pulse")
    even, uneven = (sim_to_real.UnevenLag(policy, share) for share in (0.0, 0.5))
    alone, same, other = (
        run_episodes(each, seeds=range(4), duration=1.0, options={"plant": plant}).rms_bar
        for each in (policy, even, uneven)
    )
    np.testing.assert_array_equal(same, alone)
    assert np.any(other != alone)


def test_plain_randomisation_draws_one_or_two_effects_of_the_whole_catalogue():
    nominal = Parameters.calibrated()
    changed = [
        {symbol for symbol, value in each.region.centre.items() if value != nominal[symbol]}
        for each in sim_to_real.whole_catalogue().alternatives
    ]
    counts = [sum(bool(symbols & set(own)) for own in CATALOGUE.values()) for symbols in changed]
    assert set(counts) == {1, 2}
    assert all(set().union(*changed) & set(own) for own in CATALOGUE.values())
