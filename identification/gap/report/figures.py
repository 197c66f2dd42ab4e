"""Figures of a diagnosis: measured against modelled, laws of causes, and the missing term."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import norm

from identification.block_bootstrap import LEVEL
from identification.gap.diagnosis import Diagnosis
from identification.gap.fit.evidence import predict
from identification.gap.fit.laws import Law
from identification.gap.locate.localisation import ForcingEstimate, MissingTerm
from identification.gap.plant import GreyBox
from identification.report.page import over_time

QUANTILE = float(norm.ppf(0.5 + LEVEL / 2))
"""Half the width of a band [standard deviations]."""

CURVE, BAND = "tab:green", "#bfe3bf"
"""Colours of what is estimated over a state or in time, and of its interval; blue is the model."""


def compared_models(diagnosis: Diagnosis) -> dict[str, list[NDArray]]:
    """Residuals before and after, by model, each run (channels, samples) [noise deviations].

    Before the best cause is the recalibrated model; where no cause is needed, the nominal one.
    """
    ranking, best = diagnosis.ranking, diagnosis.best
    models = {"nominal parameters": diagnosis.nominal, "recalibrated": ranking.recalibrated}
    if best:
        models = {"recalibrated": ranking.recalibrated, "with the likeliest cause": best.hypothesis}
    return {
        f"{when}: {name}": predict(ranking.problem, model.estimate).residuals
        for when, (name, model) in zip(("before", "after"), models.items(), strict=True)
    }


def comparison_figure(diagnosis: Diagnosis, *, every_channel: bool = False) -> Figure:
    """Measured against modelled, before and after, and both errors, on a held-out run.

    It is the middle one of those that gain at least a tenth of the most: there the cause acts.
    every_channel: False for the channel that the correction improves most.
    """
    plant, models = diagnosis.ranking.problem.plant, compared_models(diagnosis)
    before, after = models.values()
    gains = [np.mean(b**2 - a**2, axis=1) for b, a in zip(before, after, strict=True)]
    gain = {r: float(np.mean(gains[r])) for r, run in enumerate(plant.runs) if run.held_out}
    most_gain = max(gain.values())
    runs = [r for r in sorted(gain, key=gain.__getitem__) if gain[r] >= min(most_gain, most_gain / 10)]
    r = runs[len(runs) // 2]
    run, most = plant.runs[r], int(np.argmax(gains[r]))
    rows: dict[str, dict[str, NDArray]] = {}
    for c, channel in enumerate(plant.channels):
        if not every_channel and c != most:
            continue
        unit = f"[{channel.unit}]" if channel.unit else ""
        measured = np.where(run.trusted[c], run.measured[c], np.nan) / channel.scale
        noise = channel.known_noise / channel.scale
        errors = {
            name: np.where(run.trusted[c], noise * residuals[r][c], np.nan)
            for name, residuals in models.items()
        }
        modelled = {name: measured - error for name, error in errors.items()}
        rows[f"{channel.name} {unit}"] = {"measured": measured, **modelled}
        rows[f"{channel.name}: measured\n- model {unit}"] = errors
    figure = over_time(run.time, rows, [2.0, 1.0] * (len(rows) // 2))
    counted = run.time[np.any(run.trusted, axis=0)]
    figure.axes[0].set_xlim(counted[0], counted[-1])
    figure.axes[0].set_title(f"{run.name}, never fitted to", fontsize="medium")
    return figure


def law_figure(
    laws: Sequence[tuple[Law, NDArray, NDArray]], units: Mapping[str, tuple[str, float]]
) -> Figure:
    """Strength of causes over the states that they follow, relative to the law of the catalogue.

    laws: each with g at the knots and its standard deviation, (knots,) [1]. units: unit of each state
    and its size [SI], by the state's name.
    """
    figure = Figure(figsize=(4.2 * len(laws) + 0.4, 3.6), layout="constrained")
    panels = figure.subplots(1, len(laws), squeeze=False)[0]
    for axes, (law, growth, sd) in zip(panels, laws, strict=True):
        unit, size = units[law.argument]
        strength, margin = np.maximum(1.0 + growth, 0.0), QUANTILE * sd
        _banded(axes, law.knots / size, strength, margin, "as recorded", least=0.0)
        axes.axhline(1.0, color="0.4", linewidth=1.0, linestyle="--", label="as assumed")
        axes.set_title(law.cause.title, fontsize="small", wrap=True)
        axes.set(xlabel=f"{law.argument} [{unit}]" if unit else law.argument, ylim=(0.0, None))
        axes.set_ylabel("strength over the fitted size [1]")
        axes.legend(fontsize="small")
    return figure


def missing_term_figure(term: MissingTerm) -> Figure:
    """The missing term over the state that explains it best, and what single windows need."""
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes, missing = figure.subplots(), term.equation
    axes.plot(term.x, term.scatter, ".", color="0.6", markersize=4, label="single windows")
    _banded(axes, term.x, term.y, QUANTILE * term.sd, f"as a function of the state, {LEVEL:.0%}")
    axes.set_xlabel(f"{term.state} [{term.state_unit}]")
    axes.set_ylabel(f"missing in d{missing.state}/dt,\n{missing.title} [{missing.unit}]")
    axes.legend(fontsize="small")
    return figure


def _banded(
    axes: Axes, x: NDArray, y: NDArray, margin: NDArray, label: str, least: float = -np.inf
) -> None:
    """A curve with its interval y ± margin, which does not fall below `least`."""
    axes.fill_between(x, np.maximum(y - margin, least), y + margin, color=BAND, linewidth=0.0)
    axes.plot(x, y, color=CURVE, label=label)
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.grid(alpha=0.3)


def forcing_figure(plant: GreyBox, forcing: ForcingEstimate) -> Figure:
    """The forcing of a state equation over time, run by run."""
    runs = list(dict.fromkeys(window.run for window in forcing.windows))
    figure = Figure(figsize=(7.0, 1.5 * len(runs) + 0.8), layout="constrained")
    panels = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
    for axes, run in zip(panels, runs, strict=True):
        mine = [j for j, window in enumerate(forcing.windows) if window.run == run]
        middle = [(forcing.windows[j].begin + forcing.windows[j].end) / 2 for j in mine]
        value, margin = forcing.forcing[mine], QUANTILE * forcing.sd[mine]
        _banded(axes, np.array(middle), value, margin, "missing")
        axes.set_title(plant.runs[run].name, fontsize=9)
        axes.set_ylabel(f"missing [{forcing.equation.unit}]", fontsize=8)
    panels[-1].set_xlabel("time [s]")
    return figure
