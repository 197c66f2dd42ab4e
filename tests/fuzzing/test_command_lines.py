"""A command line that cannot work ends with status 2, without a traceback and without a file."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("torch")
pytest.importorskip("statsmodels")

from epv_env.common.commands import commands
from tests.fuzzing.command_lines import NEEDED, left_files, status_of, wrong_line
from tests.fuzzing.option_values import NO_VALUES, number_options, refusal, says
from training.console.command import COMMANDS, IDENTIFICATION

pytestmark = pytest.mark.training


WITHOUT_NUMBERS = {"bode", "export-fmu"}
"""Commands whose options are all words and paths."""

SLOW = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture]


def test_the_list_has_every_command_of_the_identification():
    own = [name for name, entry in COMMANDS.items() if entry.module == IDENTIFICATION]
    assert set(own) == set(commands(["identification.commands"]))
    assert set(NEEDED) == set(COMMANDS)


@settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    suppress_health_check=SLOW,
)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_wrong_command_line_is_refused(seed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("work")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        name, arguments = wrong_line(np.random.default_rng(seed))
        assert status_of(name, arguments) == 2, (name, arguments)
    assert left_files(folder) == []


def test_every_option_that_takes_a_number_is_known():
    found = number_options()
    assert {name for name, _ in found} == set(COMMANDS) - WITHOUT_NUMBERS
    assert {("import", "--temperature-K"), ("regret", "--episodes"), ("tradeoff", "--prices")} <= set(
        found
    )


@pytest.mark.parametrize("value", NO_VALUES, ids=lambda value: value[:6] or "empty")
def test_a_number_without_sense_is_refused_by_its_option(value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, option in number_options():
        status, sentence = refusal(name, option, value)
        assert status == 2, (name, option)
        assert says(sentence, option), (name, option, sentence)
    assert left_files(tmp_path) == []
