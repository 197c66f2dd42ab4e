"""An exported policy with a memory remembers as the policy does, and gets over what is not a number."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnx")
pytest.importorskip("safetensors")

from controllers.learned import load_policy
from epv_env.observation import INDEX, P2_LAGS
from tests.training.exports import copied, parity_with, recurrent_export
from training.deploy.compiled_export import CompiledPolicy, library
from training.deploy.measurements import follow
from training.deploy.visited_states import VisitedStates, visit

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

SPOILT = 20
"""The period in which p2 is not a number."""
SHUT = {SPOILT + lag for lag in (0, *P2_LAGS)}
"""Those whose observation it enters."""


@pytest.fixture(scope="module")
def recurrent(tmp_path_factory):
    return recurrent_export(tmp_path_factory.mktemp("recurrent"))


@pytest.fixture
def copy(recurrent, tmp_path):
    """An export that a test may spoil."""
    return Path(shutil.copytree(recurrent[1], tmp_path / "copy"))


@pytest.fixture(scope="module")
def visited(recurrent):
    return visit(load_policy(recurrent[0]), first_seed=5, episodes=8, periods=250)


def decided_but_for_a_gap(policy, states: VisitedStates, *, forget: bool) -> np.ndarray:
    """What a policy decides if it sees nothing where it has to shut. forget: everything, then."""
    policy.reset(len(states.observations))
    actions = np.ones_like(states.actions)
    for k in range(states.actions.shape[1]):
        if k not in SHUT:
            actions[:, k] = policy.act(states.observations[:, k])
        elif forget:
            policy.reset(len(states.observations))
    return actions


def test_a_reading_that_is_not_a_number_shuts_the_valve_and_is_forgotten(recurrent, visited, tmp_path):
    """The policy goes on with what it remembered before."""
    policy, out = recurrent
    policy = load_policy(policy)
    observations = visited.observations.copy()
    observations[:, SPOILT, INDEX["p2_error"]] = np.nan
    code = library(["cc"], copied(out, tmp_path))
    compiled = CompiledPolicy(code=code, variant="float", cells=policy.cells)
    found = follow(compiled, replace(visited, observations=observations))
    expected = decided_but_for_a_gap(policy, visited, forget=False)
    np.testing.assert_array_equal(found, expected)
    assert np.any(expected != visited.actions)  # or the gap would not show
    assert np.any(expected != decided_but_for_a_gap(policy, visited, forget=True))


@pytest.mark.parametrize(
    ("file", "pattern", "instead"),
    [
        ("epv_float.c", r"(WEIGHT_NEW\[\d+\] = \{\s*)[^,]+,", r"\g<1>3.0f,"),
        ("epv_float.c", r"(BIAS_OLD\[\d+\] = \{\s*)[^,]+,", r"\g<1>3.0f,"),
        ("epv_float.c", r"reset \* row", "row"),
        ("epv_float.c", r"m->cell\[j\] = cell\[j\];", "m->cell[j] = 0.0f;"),
        ("epv_fixed.c", r"(FACTOR_OLD\[\d+\] = \{\s*)\d+u", r"\g<1>1u"),
        ("epv_fixed.c", r"32768 - update", "32000 - update"),
        ("parity.c", r"memset\(&given, 0, sizeof given\);", ""),
    ],
)
def test_a_spoilt_number_of_the_unit_is_caught(copy, file, pattern, instead):
    assert parity_with(copy, file, pattern, instead) == 1
