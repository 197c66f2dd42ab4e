"""Film an episode of the valve under a controller, or show it in a window.

epv watch                                   # valve.gif: adaptive pulse control
epv watch runs/ppo --file policy.gif        # a policy that training wrote
epv watch PWM --window                      # on the screen
"""

import argparse
import io
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import gymnasium
import numpy as np
from PIL import Image

import epv_env  # noqa: F401 - registers the ids
from controllers.base import Controller, Privileged
from controllers.tuned import load_tunings
from epv_env.common.command_line import NextStep
from epv_env.common.files import write_bytes
from epv_env.common.options import PlantFile, Seconds, Seed, writable_file
from epv_env.plant.plantfile import load_plant
from training.evaluation.named import HELP, named_controllers

SIZE = (800, 450)
"""Width and height of a frame of the film [pixels]."""
FRAME_PERIODS = 2
"""Control periods from one frame of the film to the next."""
SLOWNESS = 4.0
"""How much slower than the valve the film runs: a pulse of 20 ms is to be seen."""


def gif_file(text: str) -> Path:
    """A path for a film, for argparse."""
    if Path(text).suffix.lower() != ".gif":
        raise argparse.ArgumentTypeError(f"{text}: films are animated GIFs: give a name in .gif")
    return writable_file(text)


@dataclass(frozen=True)
class Options:
    """The controller, the episode and the film."""

    controller: Annotated[str, HELP] = "adaptive pulse"
    _: KW_ONLY
    file: Annotated[Path, gif_file, "film to write"] = Path("valve.gif")
    window: Annotated[bool, "show a window; no film"] = False
    scenario: Annotated[str, "consumption"] = "steps"
    duration: Annotated[Seconds, "of the episode [s]"] = 2.4
    seed: Annotated[Seed, "of the episode"] = 4
    plant: PlantFile = None


def run(options: Options) -> None:
    """Run the episode and write the film. Raises ValueError for an unknown controller or scenario."""
    plant = load_plant(options.plant)
    (controller,) = named_controllers([options.controller], plant)[0].values()
    env = gymnasium.make(
        controller.environment,
        plant=plant,
        scenario=options.scenario,
        render_mode="human" if options.window else "rgb_array",
    )
    frames = episode(env, controller, seed=options.seed, duration=options.duration)
    if not options.window:
        write_film(options.file, frames, env)
        print(f"{options.file}: {len(frames)} frames, {options.file.stat().st_size / 1e6:.1f} MB")
    env.close()


def next_step(options: Options) -> NextStep:
    """Compare the controller with the others."""
    others = [kind for kind in load_tunings() if kind != options.controller]
    words = ("compare", "--controllers", options.controller, *others)
    return NextStep("to compare this controller with the others", words, options.plant)


def episode(
    env: gymnasium.Env, controller: Controller, *, seed: int, duration: float
) -> list[Image.Image]:
    """Frames of an episode under a controller; none if the environment shows a window.

    duration: of the episode [s].
    """
    frames = []
    observation, _ = env.reset(seed=seed)
    controller.reset(1)
    if isinstance(controller, Privileged):
        controller.watch(env.unwrapped.task)  # type: ignore[attr-defined]
    for step in range(round(duration / _period(env))):
        action = controller.act(observation[None])[0]
        observation, *_ = env.step(action)
        if env.render_mode == "rgb_array" and step % FRAME_PERIODS == 0:
            picture = Image.fromarray(np.asarray(env.render()))
            frames.append(picture.resize(SIZE, Image.Resampling.LANCZOS))
    return frames


def write_film(path: Path, frames: list[Image.Image], env: gymnasium.Env) -> None:
    """Write frames as an animated GIF on one palette of colours, whole or not at all."""
    palette = frames[-1].quantize(256)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    duration = round(1000 * FRAME_PERIODS * _period(env) * SLOWNESS)
    film = io.BytesIO()
    first.save(
        film, "GIF", save_all=True, append_images=others, loop=0, optimize=True, duration=duration
    )
    write_bytes(path, film.getvalue())


def _period(env: gymnasium.Env) -> float:
    return env.unwrapped.settings.control_period  # type: ignore[attr-defined]
