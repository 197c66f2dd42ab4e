"""Bode plot of the PWM controller's loop as designed, with its margins.

python training/bode.py --out docs/images/pwm-bode.png
"""

import training.console.missing_packages  # noqa: F401 - before what may be missing

# isort: split
import argparse
import sys
from pathlib import Path

import control
import numpy as np

from controllers.pwm import PWM
from controllers.pwm_design import Design, open_loop
from controllers.tuned import build, load_tunings
from epv_env.common.command_line import fail_clearly, writable_file
from epv_env.plant.plantfile import load_plant


def bode(design: Design, path: Path) -> Path:
    """Draw a design's open loop with its gain and phase margin; returns the path of the picture.

    Margins are python-control's of the very response that is drawn. The axis ends at half the sampling
    frequency of the PWM: a sampled loop has no response beyond.
    """
    # matplotlib takes a second to import: only now
    from training.evaluation.plots import COLOURS, plt, save_figure

    loop = open_loop(design)
    gain_margin, phase_margin, at_phase, at_gain = map(float, control.margin(loop))
    frequency = np.asarray(loop.omega)
    values = np.asarray(loop.frdata).reshape(-1)
    phase = np.degrees(np.unwrap(np.angle(values)))
    phase -= 360 * np.round((np.interp(at_gain, frequency, phase) + 180 - phase_margin) / 360)

    figure, (gain_axes, phase_axes) = plt.subplots(
        2, 1, figsize=(7, 5.5), sharex=True, layout="constrained"
    )
    gain_axes.semilogx(frequency, 20 * np.log10(np.abs(values)))
    gain_axes.axhline(0.0, color="0.5", lw=0.8)
    gain_axes.vlines(at_phase, -20 * np.log10(gain_margin), 0.0, color=COLOURS[3])
    gain_axes.set_ylabel("gain [dB]")
    phase_axes.semilogx(frequency, phase)
    phase_axes.axhline(-180.0, color="0.5", lw=0.8)
    phase_axes.vlines(at_gain, -180.0, phase_margin - 180.0, color=COLOURS[2])
    phase_axes.set(ylabel="phase [°]", xlabel="frequency [rad/s]", xlim=(frequency[0], frequency[-1]))
    for axes in (gain_axes, phase_axes):
        axes.axvline(at_gain, color=COLOURS[2], lw=0.8, ls="--")
        axes.axvline(at_phase, color=COLOURS[3], lw=0.8, ls="--")
        axes.grid(alpha=0.3, which="both")
    gain_axes.set_title(
        f"PWM loop: gain margin {gain_margin:.2f} ({20 * np.log10(gain_margin):.1f} dB) at "
        f"{at_phase:.0f} rad/s, phase margin {phase_margin:.0f}° at {at_gain:.1f} rad/s",
        fontsize=10,
    )
    save_figure(figure, path)
    return path


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description="Bode plot of the tuned PWM controller's loop.")
    parser.add_argument("--out", type=writable_file, required=True, help="PNG file to write")
    parser.add_argument("--plant", default=None, help="plant file; default: the report's calibration")
    chosen = parser.parse_args(arguments)
    tuned = build("PWM", load_tunings()["PWM"].values, load_plant(chosen.plant))
    assert isinstance(tuned, PWM)
    bode(tuned.design, chosen.out)
    print(f"{tuned.design}; drawn in {chosen.out}")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
