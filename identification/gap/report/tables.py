"""Tables of a diagnosis for the HTML page."""

from identification.gap.diagnosis import Diagnosis, label
from identification.gap.reduce.gaps import FLOOR, Gap
from identification.gap.report import sentences
from identification.gap.report.quantities import chance, gap, quantity, spread
from identification.report.page import Table


def ranking(diagnosis: Diagnosis) -> Table:
    """Causes with their sizes, what each closes and what it looks like."""
    return Table(
        columns=["Cause", "component", "probability", "size (90 %)", "closes", "looks like"],
        rows=[
            [
                label(cause.found),
                ", ".join(dict.fromkeys(c.component for c in cause.found.point.hypothesis.causes)),
                chance(cause.probability),
                "; ".join(sentences.fitted(cause)),
                sentences.closed(diagnosis, cause),
                sentences.alike(diagnosis, cause),
            ]
            for cause in diagnosis.judged
        ],
        caption="'Looks like': what these recordings hardly tell from it, with the correlation of what "
        "both would change; from the model's sensitivities, before any residual is looked at.",
    )


def gaps(diagnosis: Diagnosis) -> Table:
    """In noise units and in the report's percent."""
    models = {**diagnosis.shrinkage.gaps, "black box": diagnosis.shrinkage.black_box_floor}
    channels = list(diagnosis.shrinkage.noise)
    columns = ["overall", *channels]
    return Table(
        columns=["Model", *(f"{c} [noise]" for c in columns), *(f"{c} [%]" for c in columns)],
        rows=[
            [name, *_noise_units(model, channels), *_percent(model, columns)]
            for name, model in models.items()
        ],
        caption=f"Left: noise deviations, {FLOOR:g} is noise alone. Right: the report's error "
        "(eqs 19-21), every run begun at its nominal state.",
    )


def _noise_units(model: Gap, channels: list[str]) -> list[str]:
    return [spread(model.overall), *(gap(model.channels[channel].value) for channel in channels)]


def _percent(model: Gap, columns: list[str]) -> list[str]:
    return [f"{model.percent[column]:.2f}" if model.percent else "-" for column in columns]


def parameters(diagnosis: Diagnosis) -> Table:
    """Calibrated parameters of each model."""
    fitter = diagnosis.verdicts.fitter
    points = {"nominal": diagnosis.nominal, "recalibrated": diagnosis.verdicts.none.point}
    if diagnosis.best:
        points[f"with {label(diagnosis.best.found)}"] = diagnosis.best.found.point
    values = [fitter.values(point) for point in points.values()]
    return Table(
        columns=["Parameter", *points],
        rows=[
            [size.symbol, *(quantity(found[size.symbol], size.unit) for found in values)]
            for size in fitter.plant.parameters
        ],
        caption="Calibrated parameters.",
    )
