"""The results of the sim-to-real loop: sim-to-real.json, sim-to-real.png and the printed tables."""

from pathlib import Path
from typing import Any

import pandas as pd

from epv_env.common.files import write_json
from training.studies.sim_to_real.performance_tables import as_markdown, gap_table, performance_table


def report(
    episodes: pd.DataFrame,
    diagnosis: dict[str, Any],
    *,
    withheld: str,
    folder: Path,
    images: Path | None = None,
) -> str:
    """Write sim-to-real.json and sim-to-real.png; return what is to be printed.

    Args:
        episodes: rows of `deployed` with their stage.
        diagnosis: the content of gap.json.
        withheld: the effect of the bench's valve.
        folder: where both files are written.
        images: another folder for the picture.
    """
    from training.evaluation.plots import save_figure
    from training.studies.sim_to_real.performance_figure import (
        performance_figure,  # matplotlib takes a second to import: only now
    )

    aims, differences = performance_table(episodes), gap_table(episodes)
    content = {
        "withheld": withheld,
        "diagnosis": {key: diagnosis[key] for key in ("verdict", "causes", "ambiguity_set", "gap")},
        "aims": aims.to_dict(orient="records"),
        "gaps": differences.to_dict(orient="records"),
    }
    write_json(folder / "sim-to-real.json", content, allow_nan=False)
    save_figure(performance_figure(aims), (images or folder) / "sim-to-real.png")
    return f"{diagnosis_text(diagnosis, withheld)}\n\n{as_markdown(aims, differences)}"


def diagnosis_text(diagnosis: dict[str, Any], withheld: str) -> str:
    """The withheld effect and the diagnosis (gap.json), in two sentences."""
    names = " or ".join(" + ".join(effects) for effects in diagnosis["ambiguity_set"])
    if not names:
        return (
            f"Withheld: {withheld}. Diagnosis: {diagnosis['verdict']}; the plant is recalibrated only."
        )
    first = diagnosis["causes"][0]
    sizes = ", ".join(
        f"{name} {value:.4g} (90 %: {low:.4g} to {high:.4g})"
        for name, (value, low, high) in first["magnitude"].items()
    )
    return (
        f"Withheld: {withheld}. Diagnosis: {diagnosis['verdict']}, {names}; the likeliest has "
        f"probability {first['probability']:.3f} and {sizes}."
    )
