"""A spoilt file of any format is read or refused in one sentence; no reader crashes or writes."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("safetensors")

from tests.fuzzing.damages import damaged_bytes, damaged_value
from tests.fuzzing.formats import FORMATS, outcome

SLOW = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture]

QUICK = settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=SLOW,
)


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_the_file_that_is_spoilt_here_is_good(form, tmp_path):
    form.write(tmp_path)
    form.read(tmp_path)


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
@QUICK
@given(seed=st.integers(0, 2**32 - 1))
def test_a_spoilt_file_is_refused_in_a_sentence(form, seed):
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        form.write(folder)
        good = (folder / form.file).read_bytes()
        damage = damaged_value if form.json and rng.random() < 0.6 else damaged_bytes
        (folder / form.file).write_bytes(damage(good, rng))
        files = sorted(folder.iterdir())
        assert outcome(form, folder) in ("still good", "refused")
        assert sorted(folder.iterdir()) == files
