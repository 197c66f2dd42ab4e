"""The figure of docs/results/component-data.md."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.scripts.component_data.chambers import AMBIENT
from docs.scripts.component_data.component_results import ComponentResults
from docs.scripts.component_data.friction import GAUGE_PRESSURES, SEAL_BORES
from docs.scripts.component_data.solenoids import (
    FREQUENCIES,
    INDUCTANCES,
    diffusion_inductance,
    shorted_turn_inductance,
)


def draw_friction(axes: Axes, results: ComponentResults) -> None:
    """Friction over pressure; open marks: break-away from rest."""
    bars = np.array(GAUGE_PRESSURES)
    for number, seal in enumerate(SEAL_BORES):
        loops = [results.loops[seal, bar] for bar in GAUGE_PRESSURES]
        means = np.array([loop.mean for loop in loops])
        colour, fit = f"C{number}", results.lines[seal]
        axes.plot(
            bars, means, "o", color=colour, label=seal.replace("257", "").replace("Circle", "round")
        )
        axes.plot([0, 7.5], fit.constant + fit.slope * np.array([0, 7.5]), color=colour, lw=1)
        for bar, loop in zip(bars, loops, strict=True):
            mark = "^" if loop.first_peaked else r"$\uparrow$"
            height = loop.halves[0] * (1 + loop.first_excess)
            axes.plot(bar, height, ls="", marker=mark, mfc="none", mec=colour, ms=7)
    axes.plot([], [], ls="", marker="^", mfc="none", mec="0.3", label="break-away from rest")
    axes.plot([], [], ls="", marker=r"$\uparrow$", mfc="none", mec="0.3", label="the same, at least")
    axes.set(xlabel="gauge pressure [bar]", ylabel="friction [N]", xlim=(0, 7.6), ylim=(0, 38))
    axes.set_title("Seals")
    axes.legend(fontsize=8, loc="upper left")


def draw_chambers(axes: Axes, results: ComponentResults) -> None:
    """FittedDecay of the leaky chambers with the fitted laws."""
    styles = {"orifice": ":", "laminar": "--", "porous": "-"}
    for number, (chamber, (time, pressure)) in enumerate(results.records.items()):
        layer = chamber.removeprefix("Ultimaker_0")
        axes.plot(
            time[::12], (pressure[::12] - AMBIENT) * 1e-5, ".", ms=4, color=f"C{number}", alpha=0.5
        )
        axes.plot([], [], ".", color=f"C{number}", label=f"print, layers of 0.{layer} mm")
        for law, style in styles.items():
            fitted = (results.decays[chamber, law].pressure - AMBIENT) * 1e-5
            axes.plot(time, fitted, style, color="0.15", lw=1.1, label=law if number == 0 else None)
    axes.set(
        xlabel="time [s]", ylabel="gauge pressure [bar]", yscale="log", xlim=(0, 120), ylim=(0.02, 12)
    )
    axes.set_title("Leaky chambers")
    axes.legend(fontsize=8)


def draw_inductances(axes: Axes, results: ComponentResults) -> None:
    """Inductance over frequency with both models."""
    frequency = np.geomspace(50, 2e5, 200)
    for number, (name, measured) in enumerate(INDUCTANCES.items()):
        turn, other = results.shorted_turns[name], results.diffusions[name]
        fits = (
            shorted_turn_inductance(frequency, turn.inductance, turn.eddy, turn.leakage),
            diffusion_inductance(frequency, other.inductance, other.eddy, other.leakage),
        )
        label = f"{name}: {turn.eddy:.0f} ohm"
        axes.plot(FREQUENCIES, 1e3 * measured, "o", color=f"C{number}", label=label)
        axes.plot(frequency, 1e3 * fits[0], color=f"C{number}", lw=1.2)
        axes.plot(frequency, 1e3 * fits[1], "--", color=f"C{number}", lw=0.8)
    axes.plot([], [], color="0.3", label="shorted turn and leakage")
    axes.plot([], [], "--", color="0.3", lw=0.8, label="diffusion and leakage")
    axes.set(xlabel="frequency [Hz]", ylabel="inductance [mH]", xscale="log", yscale="log")
    axes.set_title("Solenoid")
    axes.legend(fontsize=8)


def component_figure(results: ComponentResults) -> Figure:
    """The page's figure."""
    figure = Figure(figsize=(13, 4), layout="constrained")
    seals, chambers, coils = figure.subplots(1, 3)
    draw_friction(seals, results)
    draw_chambers(chambers, results)
    draw_inductances(coils, results)
    for axes in (seals, chambers, coils):
        axes.grid(alpha=0.3)
    return figure
