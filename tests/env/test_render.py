"""The renderer: what a frame is, what it shows, and what it needs."""

import copy
import pickle
import sys

import gymnasium
import numpy as np
import pytest
from numpy.typing import NDArray

from epv_env.render import Renderer, Snapshot, canvas, geometry, strip, window

SHUT = Snapshot(
    time_s=1.0,
    p1_bar=12.5,
    p2_bar=8.4,
    p3_bar=12.5,
    target_bar=8.5,
    xPV_fraction=0.0,
    xMV_fraction=1.0,
    I_A=0.57,
    coil_on=True,
    sigma_S_g_per_s=1.0,
)
OPEN = SHUT._replace(p3_bar=5.0, xPV_fraction=1.0, xMV_fraction=0.0, I_A=0.0, coil_on=False)


@pytest.fixture(autouse=True)
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def frame(*snapshots: Snapshot) -> NDArray[np.uint8]:
    """The last frame of a fresh renderer that was shown these snapshots."""
    pytest.importorskip("pygame")
    renderer = Renderer("rgb_array", fps=60)
    images = [renderer.draw(snapshot) for snapshot in snapshots]
    renderer.close()
    assert images[-1] is not None
    return images[-1]


def pixels_of(image: NDArray[np.uint8], colour: canvas.Colour, box: canvas.Box) -> int:
    """Pixels of exactly this colour within the box."""
    left, top, right, bottom = (int(edge) for edge in box)
    return int(np.all(image[top:bottom, left:right] == colour, axis=2).sum())


def test_a_frame_is_an_rgb_image() -> None:
    image = frame(SHUT)
    assert image.shape == (window.HEIGHT, window.WIDTH, 3)
    assert image.dtype == np.uint8
    assert image.std() > 20.0


def test_the_piston_lifts_by_its_stroke() -> None:
    column = int(geometry.PV)
    rubber = [
        np.flatnonzero(np.all(image[:, column] == canvas.RUBBER, axis=1)).max()
        for image in (frame(SHUT), frame(OPEN))
    ]
    assert rubber[0] - rubber[1] == geometry.STROKE["piston"]


def test_the_badge_tells_whether_p2_is_within_the_tolerance() -> None:
    badge = (896, 16, 1130, 52)
    inside, outside = frame(SHUT), frame(SHUT._replace(p2_bar=9.1))
    assert pixels_of(inside, canvas.GOOD, badge) > 1000 > pixels_of(inside, canvas.BAD, badge)
    assert pixels_of(outside, canvas.BAD, badge) > 1000 > pixels_of(outside, canvas.GOOD, badge)


def test_reset_clears_the_strip_chart() -> None:
    pytest.importorskip("pygame")
    renderer = Renderer("rgb_array", fps=60)
    images = []
    for time_s in (1.0, 1.5, 2.0):
        images.append(renderer.draw(SHUT._replace(time_s=time_s)))
    renderer.reset()
    images.append(renderer.draw(SHUT))
    counts = [pixels_of(image, canvas.P2, strip.PRESSURES) for image in images if image is not None]
    assert counts[0] == counts[3] == 0
    assert counts[2] > counts[1] > 0


def test_human_mode_shows_a_window() -> None:
    pygame = pytest.importorskip("pygame")
    renderer = Renderer("human", fps=1000)
    assert renderer.draw(SHUT) is None
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)
    assert np.array_equal(shown, frame(SHUT))
    renderer.close()
    assert not pygame.display.get_init()


def test_drawing_goes_on_without_a_window_that_the_user_shut() -> None:
    pygame = pytest.importorskip("pygame")
    renderer = Renderer("human", fps=1000)
    renderer.draw(SHUT)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    renderer.draw(SHUT)
    assert not renderer.is_open
    assert renderer.draw(SHUT) is None
    assert not pygame.display.get_init()
    renderer.close()


def test_without_pygame_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    renderer = Renderer("rgb_array", fps=60)
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match=r"pip install -e '\.\[render\]'"):
        renderer.draw(SHUT)


def test_the_first_picture_shows_what_has_been() -> None:
    """Its charts hold every period of the episode, as those of one that was drawn all along."""
    pytest.importorskip("pygame")
    pictures = []
    for drawn in (False, True):
        env = gymnasium.make("EPValve-v0", render_mode="rgb_array", scenario="steps")
        env.reset(seed=2)
        for step in range(40):
            env.step(step // 10 % 2)
            if drawn:
                env.render()
        pictures.append(env.render())
    np.testing.assert_array_equal(*pictures)


def test_an_environment_with_a_picture_can_be_copied() -> None:
    pytest.importorskip("pygame")
    env = gymnasium.make("EPValve-v0", render_mode="rgb_array").unwrapped
    env.reset(seed=2)
    env.step(0)
    picture = env.render()
    for copied in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        np.testing.assert_array_equal(copied.render(), picture)
