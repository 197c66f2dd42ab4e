"""Film the valve at work: one episode under the tuned hysteresis controller, as a GIF.

python docs/scripts/film.py --out docs/images/valve.gif
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from controllers.tuned import tuned_controllers
from epv_env.common.command_line import fail_clearly, writable_file
from epv_env.env import EPValveEnv

SIZE = (800, 450)
"""Width and height of a frame [pixels]."""

FRAME_PERIODS = 2
"""Control periods from one frame to the next [-]."""


def film(scenario: str, seconds: float, seed: int) -> tuple[list[Image.Image], float]:
    """Frames of an episode on one palette of colours, and the time between two frames [s].

    Args:
        scenario: name of the consumption scenario.
        seconds: simulated time [s].
        seed: of the episode.
    """
    env = EPValveEnv(scenario=scenario, render_mode="rgb_array")
    controller = tuned_controllers()[1]
    observation, _ = env.reset(seed=seed)
    controller.reset(1)
    frames = []
    for step in range(round(seconds / env.settings.control_period)):
        observation, *_ = env.step(int(controller.act(observation[None])[0]))
        picture = env.render()
        if step % FRAME_PERIODS == 0:
            frames.append(Image.fromarray(np.asarray(picture)).resize(SIZE, Image.Resampling.LANCZOS))
    env.close()
    palette = frames[-1].quantize(256)
    quantised = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    return quantised, FRAME_PERIODS * env.settings.control_period


def main() -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description="Film the valve at work.")
    parser.add_argument("--out", type=writable_file, default=Path("docs/images/valve.gif"))
    parser.add_argument("--scenario", default="steps", help="consumption scenario")
    parser.add_argument("--seconds", type=float, default=2.4, help="simulated time")
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--slow", type=float, default=4.0, help="how much slower than real time")
    chosen = parser.parse_args()
    frames, period = film(chosen.scenario, chosen.seconds, chosen.seed)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    frames[0].save(
        chosen.out, save_all=True, append_images=frames[1:], loop=0, optimize=True,
        duration=round(1000 * period * chosen.slow),
    )  # fmt: skip
    print(f"{chosen.out}: {len(frames)} frames, {chosen.out.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
