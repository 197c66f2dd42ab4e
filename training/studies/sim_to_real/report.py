"""What the circle came to: circle.json, circle.png and the printed tables."""

import json
from pathlib import Path
from typing import Any

import pandas as pd

from epv_env.common.files import write_text
from training.studies.sim_to_real.aims import as_markdown, figures, gaps


def report(
    episodes: pd.DataFrame,
    found: dict[str, Any],
    *,
    withheld: str,
    folder: Path,
    images: Path | None = None,
) -> str:
    """Write circle.json and circle.png; return what is to be printed.

    episodes: rows of `circle_deployment.deployed` with their stage. found: gap.json. withheld: the
    effect of the bench's valve. images: a folder for the picture other than `folder`.
    """
    from training.evaluation.plots import save_figure
    from training.studies.sim_to_real.figure import (
        circle_figure,  # matplotlib takes a second to import: only now
    )

    aims, differences = figures(episodes), gaps(episodes)
    content = {
        "withheld": withheld,
        "diagnosis": {key: found[key] for key in ("verdict", "causes", "ambiguity_set", "gap")},
        "aims": aims.to_dict(orient="records"),
        "gaps": differences.to_dict(orient="records"),
    }
    write_text(folder / "circle.json", json.dumps(content, indent=1, allow_nan=False) + "\n")
    save_figure(circle_figure(aims), (images or folder) / "circle.png")
    return f"{said(found, withheld)}\n\n{as_markdown(aims, differences)}"


def said(found: dict[str, Any], withheld: str) -> str:
    """What was withheld and what the diagnosis found, in two sentences."""
    names = " or ".join(" + ".join(effects) for effects in found["ambiguity_set"])
    if not names:
        return f"Withheld: {withheld}. Diagnosis: {found['verdict']}; the plant is recalibrated only."
    first = found["causes"][0]
    sizes = ", ".join(
        f"{name} {value:.4g} (90 %: {low:.4g} to {high:.4g})"
        for name, (value, low, high) in first["magnitude"].items()
    )
    return (
        f"Withheld: {withheld}. Diagnosis: {found['verdict']}, {names}; the likeliest has "
        f"probability {first['probability']:.3f} and {sizes}."
    )
