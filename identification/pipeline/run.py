"""The whole identification of one campaign: every stage, the plant file, the report."""

import sys
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

from epv_env.plant.plantfile import Plant, save_plant
from identification.pipeline.identification import ESTIMATOR, Identification
from identification.pipeline.stages import STAGES, Result, result_or_omission
from identification.pipeline.summary import summary_section
from identification.recordings.recording import campaign_facts
from identification.report.page import Section
from identification.report.result_files import write_results

PLANT_FILE = "plant.json"
"""Name of the file of the calibrated plant in the folder of results."""


def run(identification: Identification, out: Path) -> Plant:
    """Run all stages; write plant.json, report.html and report.json into `out`.

    Raises CampaignError if the campaign has no recording to fit to.
    """
    began, done = perf_counter(), 0.0
    results: list[Result] = []
    for number, stage in enumerate(STAGES, start=1):
        left = _remaining(perf_counter() - began, done)
        print(f"[{number}/{len(STAGES)}] {stage.name}{left}", file=sys.stderr)
        results.append(result_or_omission(stage, identification))
        done += stage.time_share
    plant = calibrated_plant(identification)
    _write_report(out, identification, plant, results)
    save_plant(plant, out / PLANT_FILE)
    print(f"[done] {perf_counter() - began:.0f} s", file=sys.stderr)
    return plant


def calibrated_plant(identification: Identification) -> Plant:
    """The calibrated plant with its joint region and where it comes from."""
    return replace(
        identification.plant or Plant.calibrated(),
        parameters=identification.parameters,
        region=identification.confidence.region,
        name=identification.campaign.name,
        provenance={
            "method": ESTIMATOR,
            "software": f"epv-valve {version('epv-valve')}",
            "seed": identification.seed,
            "recordings_sha256": identification.hashes,
            "calibrated_on": [r.name for r in identification.campaign.with_role("calibration")],
            "warnings": identification.calibration.warnings,
        },
    )


def _write_report(
    out: Path, identification: Identification, plant: Plant, results: list[Result]
) -> None:
    """Write report.html and report.json."""
    sections: list[Section] = [summary_section(identification)]
    sections += [section for result in results for section in result.sections]
    content: dict[str, Any] = {"provenance": plant.provenance}
    for result in results:
        content |= result.content
    title = f"Identification of the protection valve: {identification.campaign.name}"
    write_results(
        out,
        "report",
        title=title,
        sections=sections,
        content=content,
        facts=campaign_facts(identification.campaign),
        report_2003=identification.report_2003,
    )


def _remaining(seconds: float, done: float) -> str:
    """Text about the time left, from the seconds and the share done so far."""
    return f", about {seconds * (1 - done) / done:.0f} s left" if done else ""
