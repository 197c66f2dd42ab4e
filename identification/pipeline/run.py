"""The whole identification of one campaign: its stages, the plant file, the report."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from epv_env.common.command_line import NextStep
from epv_env.common.results_folder import progress
from epv_env.plant.plantfile import Plant, save_plant
from identification.calibration.calibrate import calibration_json, calibration_section
from identification.confidence import confidence_json, confidence_section
from identification.pipeline.identification import ESTIMATOR, Identification, summary_section
from identification.quality.assessment import assess_recording
from identification.quality.section import as_json as quality_json
from identification.quality.section import quality_section
from identification.recordings.noise import campaign_steps
from identification.recordings.recording import CampaignError, campaign_facts
from identification.report.page import Section, Verdict, write_results
from identification.sensitivity import (
    sensitivities_on_recordings,
    sensitivity_json,
    sensitivity_section,
    studied_symbols,
)
from identification.validation import validation_json, validation_section

PLANT_FILE = "plant.json"
"""Name of the file of the calibrated plant in the folder of results."""


Result = tuple[list[Section], dict[str, Any]]
"""What a stage gives to the report, and fields of the JSON file."""


@dataclass(frozen=True)
class Stage:
    """One stage of the identification."""

    name: str
    """The stage's command: `python -m identification NAME`."""
    help: str
    """The question that the stage answers, and the report's section."""
    compute: Callable[[Identification], Result]
    """Computes the stage and what it rests on. Raises CampaignError."""
    role: str | None = None
    """Role of recordings that the stage needs; a whole run without them leaves the stage out."""


def quality(identification: Identification) -> Result:
    """Section 4 for every quality recording. Raises CampaignError if there is none."""
    recordings = identification.campaign.with_role("quality")
    if not recordings:
        raise CampaignError(
            f"campaign {identification.campaign.name!r} has no recording with role 'quality': record "
            "about 5 s at rest, coil off and exhausted, and list it in campaign.json"
        )
    campaign = identification.campaign
    steps = campaign_steps(campaign.recordings, campaign.rules)
    assessments = [
        assess_recording(recording, campaign.pressure, steps=steps, sensors=campaign.rules.sensors)
        for recording in recordings
    ]
    content = {"quality": [quality_json(assessment) for assessment in assessments]}
    return [quality_section(assessment) for assessment in assessments], content


def sensitivity(identification: Identification) -> Result:
    """Section 5 on the campaign's own recordings."""
    problem = identification.problem
    outputs = sensitivities_on_recordings(problem.plant.replay, studied_symbols(), problem.noise)
    return [sensitivity_section(outputs)], {"sensitivity": sensitivity_json(outputs)}


def calibration(identification: Identification) -> Result:
    """Section 6.2: both methods from every start."""
    fitted = identification.calibration
    return [calibration_section(fitted)], {"calibration": calibration_json(fitted)}


def confidence(identification: Identification) -> Result:
    """Section 6.3: intervals and joint region."""
    sure = identification.confidence
    return [confidence_section(sure)], {"confidence": confidence_json(sure)}


def validation(identification: Identification) -> Result:
    """Section 7 on held-out recordings. Raises CampaignError if there is none."""
    checked = identification.validation
    return [validation_section(checked)], {"validation": validation_json(checked)}


STAGES = (
    Stage("quality", "is the data good enough (section 4)", quality, role="quality"),
    Stage("sensitivity", "which parameters matter (section 5)", sensitivity),
    Stage("calibrate", "fit the parameters (section 6.2)", calibration),
    Stage("confidence", "how sure the estimates are (section 6.3)", confidence),
    Stage(
        "validate", "does the model hold on held-out recordings (section 7)", validation, "validation"
    ),
)
"""In the order of the report."""


def result_or_omission(stage: Stage, identification: Identification) -> Result:
    """A stage's result; where the campaign lacks its recordings, a section that says so."""
    if stage.role is None or identification.campaign.with_role(stage.role):
        return stage.compute(identification)
    text = f"The campaign has no recording with role {stage.role!r}: this stage was left out."
    verdict = Verdict(status="doubt", text=text)
    return [Section(title=f"Not done: {stage.name}", verdicts=[verdict])], {}


def run(identification: Identification, out: Path, next_step: NextStep) -> Plant:
    """Run all stages; write plant.json, report.html and report.json into `out`.

    next_step: what the report names at its end. Raises CampaignError if the campaign has no recording
    to fit to.
    """
    sections: list[Section] = []
    content: dict[str, Any] = {}
    for stage in progress(STAGES, what="stages"):
        shown, fields = result_or_omission(stage, identification)
        sections, content = [*sections, *shown], content | fields
    plant = calibrated_plant(identification)
    write_results(
        out,
        "report",
        {"provenance": plant.provenance, **content},
        title=f"Identification of the protection valve: {identification.campaign.name}",
        sections=[summary_section(identification), *sections],
        facts=campaign_facts(identification.campaign),
        next_step=next_step,
    )
    save_plant(plant, out / PLANT_FILE)
    return plant


def calibrated_plant(identification: Identification) -> Plant:
    """The calibrated plant with its joint region and where it comes from."""
    valve = identification.plant or Plant.calibrated()
    return valve.refitted(
        identification.confidence.region,
        identification.campaign.name,
        method=ESTIMATOR,
        seed=identification.seed,
        recordings_sha256=identification.hashes,
        calibrated_on=[r.name for r in identification.campaign.with_role("calibration")],
        warnings=identification.calibration.warnings,
    )
