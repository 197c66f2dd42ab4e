"""The whole identification of one campaign: every stage, the plant file, the report."""

import sys
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

from epv_env.plant.plantfile import Plant, save_plant
from identification.pipeline.stages import ESTIMATOR, STAGES, Identification, Result, possible
from identification.report.page import Section
from identification.report.result_files import write_results

SHARES = {"quality": 0.15, "sensitivity": 0.4, "calibrate": 0.25, "confidence": 0.1, "validate": 0.1}
"""How a run's time divides among the stages, for the estimate of what is left."""

PLANT_FILE = "plant.json"


def run(identification: Identification, out: Path) -> Plant:
    """Run all stages; write plant.json, report.html and report.json into `out`."""
    began, done = perf_counter(), 0.0
    results: list[Result] = []
    for number, stage in enumerate(STAGES, start=1):
        left = _remaining(perf_counter() - began, done)
        print(f"[{number}/{len(STAGES)}] {stage}{left}", file=sys.stderr)
        results.append(possible(stage, identification))
        done += SHARES[stage]
    plant = plant_of(identification)
    sections: list[Section] = [section for result in results for section in result.sections]
    content: dict[str, Any] = {"provenance": plant.provenance}
    for result in results:
        content |= result.content
    title = f"Identification of the protection valve: {identification.campaign.name}"
    write_results(out, "report", title=title, sections=sections, content=content)
    save_plant(plant, out / PLANT_FILE)
    print(f"[done] {perf_counter() - began:.0f} s", file=sys.stderr)
    return plant


def plant_of(identification: Identification) -> Plant:
    """The calibrated plant with its joint region and where it comes from."""
    return Plant(
        parameters=identification.parameters,
        region=identification.confidence.region,
        name=identification.campaign.name,
        provenance={
            "method": ESTIMATOR,
            "software": f"epv-valve {version('epv-valve')}",
            "seed": identification.seed,
            "recordings_sha256": identification.hashes,
            "calibrated_on": [r.name for r in identification.campaign.of("calibration")],
            "warnings": identification.calibration.warnings,
        },
    )


def _remaining(seconds: float, done: float) -> str:
    return f", about {seconds * (1 - done) / done:.0f} s left" if done else ""
