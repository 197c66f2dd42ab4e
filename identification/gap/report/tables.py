"""Tables of a diagnosis for the HTML page."""

from identification.gap.diagnosis import Diagnosis, hypothesis_title
from identification.gap.reduce.gaps import FLOOR, Gap
from identification.gap.report import sentences
from identification.gap.report.json_export import discrepancy, inclusion
from identification.gap.report.names import in_words
from identification.gap.report.quantities import (
    gap_text,
    gap_with_interval,
    probability_text,
    quantity,
)
from identification.report.page import Table


def ranking_table(diagnosis: Diagnosis) -> Table:
    """Judged causes with their sizes, the share that each closes, and look-alikes."""
    return Table(
        columns=["Cause", "component", "probability", "size (90 %)", "closes", "looks like"],
        rows=[
            [
                hypothesis_title(cause.hypothesis),
                ", ".join(
                    dict.fromkeys(
                        c.component.replace("_", " ")
                        for c in cause.hypothesis.estimate.hypothesis.causes
                    )
                ),
                probability_text(cause.probability),
                "; ".join(sentences.sizes_with_intervals(diagnosis, cause)),
                sentences.share_closed(diagnosis, cause),
                sentences.look_alikes(diagnosis, cause),
            ]
            for cause in diagnosis.judged
        ],
        caption="'Looks like': causes that these recordings hardly tell apart from this one, with the "
        "correlation of both effects; from the model's sensitivities alone, whatever the residual.",
    )


def inclusion_table(diagnosis: Diagnosis) -> Table:
    """Probability that each effect is part of the gap, alone or beside others."""
    components = {cause.name: cause.component for cause in diagnosis.ranking.problem.plant.causes}
    least = diagnosis.settings.report.mentioned_probability
    rows = [
        [
            in_words(diagnosis, name),
            components[name].replace("_", " "),
            probability_text(probability),
            "yes" if name in diagnosis.conclusion.held else "-",
        ]
        for name, probability in inclusion(diagnosis).items()
        if probability >= least
    ]
    sure = diagnosis.ranking.settings.sure_inclusion
    return Table(
        columns=["Effect", "component", "part of the gap", "held"],
        rows=rows or [["none", "-", "-", "-"]],
        caption="Probability that an effect is part of the gap, alone or beside others, so that the "
        f"figures need not add to 100 %. Held: {100 * sure:g} % or more, and the verdict names causes.",
    )


def discrepancy_table(diagnosis: Diagnosis) -> Table:
    """What model and recordings differ by beyond noise under the best hypothesis, by channel."""
    channels = {channel.name: channel for channel in diagnosis.ranking.problem.plant.channels}
    return Table(
        columns=["Channel", "noise", "discrepancy", "correlated over"],
        rows=[
            [
                name,
                quantity((channels[name].noise or 0.0) / channels[name].scale, channels[name].unit),
                quantity(seen["sd"], channels[name].unit) if seen["sd"] else "none seen",
                quantity(seen["time_scale_s"], "s") if seen["sd"] else "-",
            ]
            for name, seen in discrepancy(diagnosis).items()
        ],
        caption="Standard deviations of the sensor noise and of what differs beyond it under the best "
        "hypothesis: errors of its form, and disturbances.",
    )


def gap_table(diagnosis: Diagnosis) -> Table:
    """Gap of every model in noise deviations, and in percent where defined."""
    models = {**diagnosis.reduction.gaps, "black box": diagnosis.reduction.black_box}
    channels = list(diagnosis.reduction.noise_ratios)
    columns = ["overall", *channels]
    shown = columns if any(model.percent for model in models.values()) else []
    caption = f"Noise deviations; {FLOOR:g} is noise alone."
    if shown:
        caption = (
            f"Left: noise deviations, {FLOOR:g} is noise alone. Right: mean distance of model and "
            "recording in percent of the recording's mean, every run with nominal offsets."
        )
    return Table(
        columns=["Model", *(f"{c} [noise]" for c in columns), *(f"{c} [%]" for c in shown)],
        rows=[
            [in_words(diagnosis, name), *_noise_units(model, channels), *_percent(model, shown)]
            for name, model in models.items()
        ],
        caption=caption,
    )


def _noise_units(model: Gap, channels: list[str]) -> list[str]:
    return [
        gap_with_interval(model.overall),
        *(gap_text(model.channels[channel].value) for channel in channels),
    ]


def _percent(model: Gap, columns: list[str]) -> list[str]:
    return [f"{model.percent[column]:.2f}" if model.percent else "-" for column in columns]


def parameter_table(diagnosis: Diagnosis) -> Table:
    """Calibrated parameters of each model."""
    problem = diagnosis.ranking.problem
    estimates = {
        "nominal": diagnosis.nominal,
        "recalibrated": diagnosis.ranking.recalibrated.estimate,
    }
    if diagnosis.best:
        best = diagnosis.best.hypothesis
        estimates[f"with {hypothesis_title(best)}"] = best.estimate
    values = [problem.values(estimate) for estimate in estimates.values()]
    return Table(
        columns=["Parameter", *estimates],
        rows=[
            [p.symbol, *(quantity(own[p.symbol], p.unit) for own in values)]
            for p in problem.plant.parameters
        ],
        caption="Calibrated parameters.",
    )
