"""`epv log`: a simulated valve's log, with an effect from a drive on."""

import numpy as np
import pytest

from epv_env.common.commands import main_of
from identification.recordings.log_files import read_log

pytestmark = pytest.mark.training


def log(*words: object) -> int:
    """Run `epv log` under a simple controller, two drives of a second unless the words say otherwise."""
    line = ["--controller", "hysteresis", "--drives", 2, "--duration", 1.0, *words]
    return main_of("training.commands.log", program="epv log", arguments=[str(word) for word in line])


def test_an_effect_acts_from_its_drive_on(tmp_path):
    assert log("--out", tmp_path / "as-it-is") == 0
    assert log("--out", tmp_path / "late", "--effect", "command_delay", "--from-drive", 2) == 0
    same, other = (
        [drive.p3 for drive in read_log(tmp_path / name).drives] for name in ("as-it-is", "late")
    )
    np.testing.assert_array_equal(same[0], other[0])
    assert len(same[1]) == len(other[1]) == 200
    assert np.any(same[1] != other[1])
