"""Figures of a diagnosis: probabilities, residuals, forcings and missing terms."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import norm

from identification.block_bootstrap import LEVEL
from identification.gap.diagnosis import Diagnosis
from identification.gap.fit.gaps import FLOOR, RegimeGap
from identification.gap.fit.laws import Law
from identification.gap.locate.localisation import ForcingEstimate, MissingTerm
from identification.gap.plant import GreyBox
from identification.gap.report.quantities import probability_text

NAMED, OTHER, NO_NAME = "tab:blue", "0.7", "tab:orange"
"""Colours: causes that the verdict names, other causes, hypotheses without a named cause."""

NO_CAUSE, UNKNOWN_CAUSE, NOTHING = "no cause needed", "not in the catalogue", "nothing missing"

OTHERS = "all other sets of causes"

HEAT_MAP_RANGE = 10.0
"""Upper end of the heat map's colours, unless a gap is larger [noise deviations]."""

QUANTILE = float(norm.ppf(0.5 + LEVEL / 2))
"""Half the width of a band [standard deviations]."""

BAND = "lightskyblue"
"""Colour of an interval."""


def ranking_figure(diagnosis: Diagnosis) -> Figure:
    """Probability of each cause, of none and of an unknown one."""
    causes = {c.hypothesis.title: c.probability for c in diagnosis.judged}
    named = [c.hypothesis.title for c in diagnosis.conclusion.ambiguity_set]
    rest = {NO_CAUSE: diagnosis.ranking.no_cause, UNKNOWN_CAUSE: diagnosis.ranking.unknown}
    colours = [NAMED if name in named else OTHER for name in (*causes, OTHERS)] + [NO_NAME] * len(rest)
    causes[OTHERS] = sum(diagnosis.ranking.probabilities) - sum(causes.values())
    # A label has a line for each cause, and for each name in brackets.
    bars = {
        name.replace(" + ", "\n+ ").replace(" (", "\n("): share
        for name, share in (causes | rest).items()
    }
    height = max(1.0, *(0.5 * (1 + label.count("\n")) for label in bars))
    figure = Figure(figsize=(7.5, 0.9 + 0.32 * height * len(bars)), layout="constrained")
    _bars(figure.subplots(), bars, colours)
    return figure


def location_figure(diagnosis: Diagnosis) -> Figure:
    """Probability that something is missing: by equation or reading, and by component."""
    localisation = diagnosis.localisation
    examined = {f.equation.name: f.equation.title for f in localisation.forcings}
    probabilities = localisation.equation_probabilities.items()
    equations = {examined[name]: share for name, share in probabilities if name in examined}
    equations[NOTHING] = localisation.nothing_missing
    found = diagnosis.conclusion.component_probabilities
    components = {name.replace("_", " "): share for name, share in found.items()}
    rows = max(len(equations), len(components))
    figure = Figure(figsize=(9.5, 0.9 + 0.28 * rows), layout="constrained")
    left, right = figure.subplots(1, 2)
    _bars(left, equations, [NAMED] * (len(equations) - 1) + [NO_NAME])
    _bars(right, components, [NAMED] * len(components))
    left.set_title("by state equation, no cause named")
    right.set_title("by component, causes named")
    return figure


def _bars(axes: Axes, probabilities: Mapping[str, float], colours: Sequence[str]) -> None:
    """Probabilities as horizontal bars, with their figures."""
    rows = range(len(probabilities))
    axes.barh(rows, list(probabilities.values()), color=colours, height=0.7)
    for row, probability in zip(rows, probabilities.values(), strict=True):
        axes.text(probability + 0.01, row, probability_text(probability), va="center", fontsize=8)
    axes.set_yticks(rows, list(probabilities), fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.3)  # the figure of a bar that is full stays within the frame
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100"])
    axes.set_xlabel("probability [%]")
    axes.grid(axis="x", alpha=0.3)


def heat_map(gaps: Sequence[RegimeGap]) -> Figure:
    """Gap of every channel in every regime, with its interval."""
    channels = list(dict.fromkeys(gap.channel for gap in gaps))
    regimes = list(dict.fromkeys(gap.regime for gap in gaps))
    figure = Figure(figsize=(1.1 * len(regimes) + 1.6, 0.75 * len(channels) + 1.3), layout="constrained")
    axes = figure.subplots()
    table = np.full((len(channels), len(regimes)), np.nan)
    for gap in gaps:
        table[channels.index(gap.channel), regimes.index(gap.regime)] = gap.gap
    colours = LogNorm(FLOOR, max(HEAT_MAP_RANGE, float(np.nanmax(table))), clip=True)
    image = axes.imshow(table, norm=colours, cmap="YlOrRd", aspect="auto")
    for gap in gaps:
        ends = f"{_two_digits(gap.low)} - {_two_digits(gap.high)}"
        axes.text(
            regimes.index(gap.regime), channels.index(gap.channel),
            f"{_two_digits(gap.gap)}{'' if gap.held_out else '*'}\n"
            f"{ends if np.isfinite(gap.high) else 'too rare'}",
            ha="center", va="center", fontsize=8, color="white" if colours(gap.gap) > 0.7 else "black",
        )  # fmt: skip
    axes.set_xticks(range(len(regimes)), [name.replace("_", "\n") for name in regimes], fontsize=9)
    axes.set_yticks(range(len(channels)), channels)
    figure.colorbar(image, label="gap [noise deviations]", ticks=[1, 2, 5, 10], format="%g")
    if not all(gap.held_out for gap in gaps):
        axes.set_xlabel("* too rare on held-out runs: all runs", fontsize=8)
    return figure


def _two_digits(gap: float) -> str:
    """A gap to two digits, or to the integer."""
    return f"{gap:.1f}" if gap < 9.95 else f"{gap:.0f}"


def residual_figure(
    plant: GreyBox, run: int, residuals: Mapping[str, NDArray], masks: Mapping[str, NDArray]
) -> Figure:
    """What models leave of a run over time, with the regimes in strips above.

    Args:
        plant: the plant with its recordings.
        run: index of the run.
        residuals: by model, (channels, samples) [noise deviations]; the last one is drawn on top.
        masks: samples of each regime, boolean (samples,) by name.
    """
    time, channels = plant.runs[run].time, len(plant.channels)
    figure = Figure(figsize=(9.5, 1.6 * channels + 0.2 * len(masks) + 1), layout="constrained")
    heights = [0.12 * len(masks), *[1.0] * channels]
    strips, *rows = figure.subplots(1 + channels, 1, sharex=True, height_ratios=heights)
    for row, mask in enumerate(masks.values()):
        strips.fill_between(
            time, row - 0.4, row + 0.4, where=mask.tolist(), color=f"C{row}", step="mid", linewidth=0.0
        )
    strips.set_yticks(range(len(masks)), [name.replace("_", " ") for name in masks], fontsize=7)
    strips.invert_yaxis()
    for c, (axes, channel) in enumerate(zip(rows, plant.channels, strict=True)):
        compared = plant.runs[run].trusted[c]
        axes.axhspan(-QUANTILE, QUANTILE, color="0.85")
        for colour, (name, residual) in zip(("tab:red", "black"), residuals.items(), strict=False):
            shown = np.where(compared, residual[c], np.nan)
            axes.plot(time, shown, color=colour, linewidth=0.6, label=name)
        if not np.any(compared):
            axes.text(0.5, 0.5, "not compared", transform=axes.transAxes, ha="center", va="center")
        axes.set_ylabel(f"{channel.name}\n[noise deviations]", fontsize=8)
        axes.grid(alpha=0.3)
    rows[0].legend(fontsize="small", ncols=2)
    rows[-1].set_xlabel("time [s]")
    figure.suptitle(f"measured - model: {plant.runs[run].name}")
    figure.align_ylabels()
    return figure


def law_figure(
    laws: Sequence[tuple[Law, NDArray, NDArray]], units: Mapping[str, tuple[str, float]]
) -> Figure:
    """Strength of causes over the states that they follow, relative to the law of the catalogue.

    laws: each with g at the knots and its standard deviation, (knots,) [1]. units: unit of each state
    and its size [SI], by the state's name.
    """
    figure = Figure(figsize=(4.2 * len(laws) + 0.4, 3.6), layout="constrained")
    for place, (law, growth, sd) in enumerate(laws, start=1):
        axes, (unit, size) = figure.add_subplot(1, len(laws), place), units[law.argument]
        state = np.linspace(law.low, law.high, len(growth)) / size
        strength, margin = np.maximum(1.0 + growth, 0.0), QUANTILE * sd
        axes.fill_between(
            state, np.maximum(strength - margin, 0.0), strength + margin, color=BAND, linewidth=0.0
        )
        axes.plot(state, strength, "o-", color="tab:blue", markersize=3, label="as recorded")
        axes.axhline(1.0, color="0.4", linewidth=1.0, linestyle="--", label="as assumed")
        axes.set_title(law.cause.title, fontsize="small", wrap=True)
        axes.set_xlabel(f"{law.argument} [{unit}]" if unit else law.argument)
        axes.set_ylabel("strength over the fitted size [1]")
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small")
    return figure


def missing_term_figure(term: MissingTerm) -> Figure:
    """The missing term over the state that explains it best, and what single windows need."""
    margin = QUANTILE * term.sd
    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    axes.plot(term.x, term.scatter, ".", color="0.6", markersize=4, label="single windows")
    axes.fill_between(term.x, term.y - margin, term.y + margin, color=BAND, linewidth=0.0)
    axes.plot(term.x, term.y, color="tab:blue", label=f"as a function of the state, {LEVEL:.0%}")
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel(f"{term.state} [{term.state_unit}]")
    missing = term.equation
    axes.set_ylabel(f"missing in d{missing.state}/dt,\n{missing.title} [{missing.unit}]")
    axes.set_title(f"alone has {term.explained:.0%} of the forcing's effect", fontsize="small")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return figure


def forcing_figure(plant: GreyBox, forcing: ForcingEstimate) -> Figure:
    """The forcing of a state equation over time, run by run."""
    runs = list(dict.fromkeys(window.run for window in forcing.windows))
    figure = Figure(figsize=(9.5, 1.5 * len(runs) + 0.8), layout="constrained")
    rows = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
    for axes, run in zip(rows, runs, strict=True):
        mine = [j for j, window in enumerate(forcing.windows) if window.run == run]
        edges = [forcing.windows[j].begin for j in mine] + [forcing.windows[mine[-1]].end]
        value, sd = forcing.forcing[mine], QUANTILE * forcing.sd[mine]
        low, high = np.append(value - sd, value[-1] - sd[-1]), np.append(value + sd, value[-1] + sd[-1])
        axes.fill_between(edges, low, high, step="post", color=BAND, linewidth=0.0)
        axes.stairs(value, edges, baseline=None, color="tab:blue")
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_title(plant.runs[run].name, fontsize=9)
        axes.set_ylabel(f"missing [{forcing.equation.unit}]", fontsize=8)
        axes.grid(alpha=0.3)
    rows[-1].set_xlabel("time [s]")
    return figure
