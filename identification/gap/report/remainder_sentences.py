"""Sentences on what no named cause explains: the remainder, and disturbances beside the noise."""

from identification.gap.diagnosis import Diagnosis, hypothesis_title
from identification.gap.report.json_export import discrepancy
from identification.gap.report.quantities import listed, probability_text, quantity, share_text
from identification.gap.report.remainder import Remainder, remainder


def remainder_place(left: Remainder) -> str:
    """Where the remainder lies, as the end of a clause; empty where the recordings do not show it."""
    if not left.location or not left.location.forcings:
        return ""
    equation = left.location.likeliest.equation
    probability = left.equation[equation.name]
    if probability <= left.location.nothing_missing:
        return ""
    return (
        f", most likely in {equation.title} of {equation.component.replace('_', ' ')} "
        f"({probability_text(probability)})"
    )


def remainder_sentence(diagnosis: Diagnosis) -> str:
    """How much of the explainable gap remains, and where."""
    left = remainder(diagnosis)
    if not left.share.value:
        return "No named cause leaves any of the gap on recordings never fitted to."
    if not diagnosis.named:
        return f"No cause is named, so the whole gap remains{remainder_place(left)}."
    return (
        f"{hypothesis_title(diagnosis.named.hypothesis)} leaves {share_text(left.share)} of the gap on "
        f"recordings never fitted to{remainder_place(left)}."
    )


def disturbance_sentence(diagnosis: Diagnosis) -> str:
    """Disturbances that are seen beside the noise, with a blank at the end; empty where none is seen."""
    least = diagnosis.settings.report.mentioned_discrepancy
    ranking, seen = diagnosis.ranking, discrepancy(diagnosis)
    channels = zip(ranking.problem.plant.channels, ranking.discrepancies, strict=True)
    texts = [
        f"{quantity(seen[channel.name]['sd'], channel.unit)} in {channel.name}, correlated over "
        f"{quantity(seen[channel.name]['time_scale_s'], 's')}"
        for channel, own in channels
        if own.sd >= least
    ]
    if not texts:
        return ""
    are = "is a disturbance" if len(texts) == 1 else "are disturbances"
    return f"Beside the noise there {are} of {listed(texts)}, that no model input explains. "
