"""The renderer: composes the frame, and hands it out as an array or shows it in a window."""

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from epv_env.render import canvas as c
from epv_env.render.canvas import Canvas, load_pygame
from epv_env.render.geometry import Snapshot
from epv_env.render.section import draw_section, draw_section_background
from epv_env.render.strip import Strip, draw_strip_background
from epv_env.reward import BAND_BAR

if TYPE_CHECKING:
    import pygame

WIDTH, HEIGHT = 1280, 720  # size of the frame [px]
CARDS = ((20, 68, 664, 704), (680, 68, 1260, 704))  # behind the section and behind the chart [px]
PHASE_BADGE, BAND_BADGE = (20, 18, 124, 50), (900, 18, 1122, 50)  # in the header [px]
HEADER_Y = 34  # middle of the header's words [px]
MOVING = 0.01  # stroke fraction from which the piston counts as off its seat [-]


def phase(snapshot: Snapshot) -> tuple[str, str]:
    """Name of what the valve is doing, and a sentence on it."""
    is_open = snapshot.xPV_fraction > MOVING
    is_pulled_in = snapshot.xMV_fraction > 0.5
    if snapshot.coil_on and not is_pulled_in:
        return "Pulling in", "coil on: the current builds up until it moves the armature"
    if snapshot.coil_on and is_open:
        return "Closing", "coil on: p_3 rises until it shuts the PV"
    if snapshot.coil_on:
        return "Holding", "coil on: p_3 keeps the PV shut, p_2 falls only by consumption"
    if is_pulled_in:
        return "Releasing", "coil off: the current dies away until the spring moves the armature"
    if is_open:
        return "Filling", "coil off: PV open, p_2 rises towards p_1"
    return "Venting", "coil off: p_3 falls until p_1 and p_2 lift the piston"


def _draw_background(canvas: Canvas) -> None:
    canvas.rectangle((0, 0, WIDTH, HEIGHT), c.PAGE)
    for card in CARDS:
        canvas.plate(card, 10)
    draw_section_background(canvas)
    draw_strip_background(canvas)


def _draw_header(canvas: Canvas, snapshot: Snapshot) -> None:
    name, sentence = phase(snapshot)
    canvas.rectangle(PHASE_BADGE, c.INK, radius=8)
    canvas.text(name, (72, HEADER_Y), 22, c.CARD, 0.5)
    canvas.text(sentence, (138, HEADER_Y), 20, c.INK)
    deviation = snapshot.p2_bar - snapshot.target_bar
    canvas.rectangle(BAND_BADGE, c.GOOD if abs(deviation) <= BAND_BAR else c.BAD, radius=8)
    # The font has no minus sign; its dash is as wide as the plus, the hyphen is not.
    words = f"p_2 – target  {deviation:+.2f} bar".replace("-", "–")
    canvas.text(words, (1011, HEADER_Y), 20, c.CARD, 0.5)
    width = canvas.text(f"{snapshot.time_s:.3f} s", (1258, HEADER_Y), 22, c.INK, 1.0)
    canvas.text("time", (1250 - width, HEADER_Y), 18, c.MUTED, 1.0)


class Renderer:
    """Draws snapshots, one frame each.

    `is_open` turns False when the user shuts the window (mode 'human'); `draw` then does nothing.
    """

    def __init__(self, mode: Literal["rgb_array", "human"], fps: int):
        """fps: frames per second of the window. Without pygame, `draw` raises DependencyNotInstalled."""
        self.mode = mode
        self.fps = fps
        self.is_open = True
        self._strip = Strip()
        self._drawing: tuple[Canvas, pygame.Surface] | None = None  # with what never moves
        self._window: tuple[pygame.Surface, pygame.time.Clock] | None = None

    def reset(self) -> None:
        """Forget the strip chart's history: a new episode begins."""
        self._strip.reset()

    def note(self, snapshot: Snapshot) -> None:
        """Add a snapshot to the charts without drawing a frame."""
        self._strip.append(snapshot)

    def draw(self, snapshot: Snapshot) -> NDArray[np.uint8] | None:
        """Draw one frame. Mode 'rgb_array': returns it, uint8 (720, 1280, 3). 'human': shows it."""
        if not self.is_open:
            return None
        self._strip.append(snapshot)
        frame = self._compose(snapshot)
        if self.mode == "rgb_array":
            pixels = bytearray(load_pygame().image.tobytes(frame, "RGB"))
            return np.frombuffer(pixels, np.uint8).reshape(HEIGHT, WIDTH, 3)
        self._show(frame)
        return None

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or a pickle takes along: the history, not the window."""
        return {**self.__dict__, "_drawing": None, "_window": None}

    def close(self) -> None:
        """Shut the window and free the memory. May be called twice; drawing again starts anew."""
        if self._window is not None:
            load_pygame().display.quit()
        self._drawing = self._window = None

    def _compose(self, snapshot: Snapshot) -> "pygame.Surface":
        if self._drawing is None:
            canvas = Canvas(WIDTH, HEIGHT)
            _draw_background(canvas)
            self._drawing = canvas, canvas.surface.copy()
        canvas, background = self._drawing
        canvas.surface.blit(background, (0, 0))
        _draw_header(canvas, snapshot)
        draw_section(canvas, snapshot)
        self._strip.draw(canvas)
        return canvas.frame()

    def _show(self, frame: "pygame.Surface") -> None:
        pygame = load_pygame()
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((WIDTH, HEIGHT)), pygame.time.Clock()
            pygame.display.set_caption("Electro-pneumatic protection valve")
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self.close()
            self.is_open = False
            return
        window, clock = self._window
        window.blit(frame, (0, 0))
        pygame.display.flip()
        clock.tick(self.fps)
