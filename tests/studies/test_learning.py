"""The study of what learning adds: its controllers see what their model was trained on."""

import numpy as np
import pandas as pd
import pytest

from controllers.knowledge import INPUTS, ValveKnowledge
from docs.studies.learning import study
from epv_env.observation import ENTRIES
from epv_env.plant.plantfile import Plant

pytestmark = pytest.mark.training


class Recorder:
    """A model that keeps what it sees and always answers 1."""

    def predict(self, seen, deterministic):
        self.seen = np.array(seen)
        return np.ones(len(seen), dtype=int), None


@pytest.mark.parametrize(("knows", "entries"), [(False, ENTRIES), (True, INPUTS)])
def test_a_model_sees_the_readings_and_if_it_shall_what_is_learnt(knows, entries):
    model = Recorder()
    knowledge = ValveKnowledge(Plant.calibrated()) if knows else None
    greedy = study.Greedy("a model", model, knowledge)  # type: ignore[arg-type]
    greedy.reset(3)
    readings = np.random.default_rng(0).normal(size=(3, ENTRIES)).astype(np.float32)
    assert list(greedy.act(readings)) == [1, 1, 1]
    assert model.seen.shape == (3, entries)
    np.testing.assert_array_equal(model.seen[:, :ENTRIES], readings)


@pytest.mark.slow
def test_the_short_form_has_a_row_for_each_controller(tmp_path):
    assert study.main(["--quick", "--out", str(tmp_path)]) == 0
    rows = pd.read_csv(tmp_path / "learning.csv")
    assert list(rows["controller"]) == [*study.REFERENCES, *study.LEARNERS, study.WHOLE]
    assert rows["left_percent"].between(0, 100).all()
