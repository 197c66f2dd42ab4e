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


@pytest.mark.parametrize("controller", ["nobody", "pulse, informed"])
def test_an_unknown_controller_is_refused(controller, tmp_path, capsys):
    arguments = [controller, "--file", str(tmp_path / "valve.gif")]
    assert main_of(WATCH, program="epv watch", arguments=arguments) == 2
    errors = capsys.readouterr().err
    assert errors.startswith(f"error: no controller {controller!r}: give PPO, hysteresis, ")
    assert errors.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_another_kind_of_film_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        main_of(WATCH, program="epv watch", arguments=["--file", str(tmp_path / "film.mp4")])
    assert "film.mp4: films are animated GIFs: give a name in .gif" in capsys.readouterr().err
