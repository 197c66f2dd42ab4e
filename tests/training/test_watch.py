"""The film of an episode shows the valve that the controller moves."""

import pytest
from PIL import Image

pytest.importorskip("pygame")

from epv_env.common.commands import main_of
from training.commands.watch import FRAME_PERIODS, SIZE

WATCH = "training.commands.watch"


@pytest.mark.parametrize("controller", ["hysteresis", "PWM", "PPO", "informed pulse"])
def test_a_film_has_a_frame_for_every_other_period(controller, tmp_path, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    path = tmp_path / "valve.gif"
    arguments = [controller, "--file", str(path), "--duration", "0.08"]
    assert main_of(WATCH, program="epv watch", arguments=arguments) == 0
    with Image.open(path) as film:
        periods = 4 if controller == "PWM" else 16
        assert (film.size, film.n_frames) == (SIZE, periods // FRAME_PERIODS)  # type: ignore[attr-defined]
