"""The stages of an identification: what each computes, and what it needs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from identification.calibration.calibration_section import calibration_json, calibration_section
from identification.confidence.confidence_section import confidence_json, confidence_section
from identification.pipeline.identification import Identification
from identification.quality import section as quality_export
from identification.quality.assessment import assess_recording
from identification.quality.section import quality_section
from identification.recordings.noise import campaign_steps
from identification.recordings.recording import CampaignError
from identification.report.page import Section, Verdict
from identification.sensitivity import sensitivity_export
from identification.sensitivity.collinearity import sensitivities_on_recordings
from identification.sensitivity.one_at_a_time import studied_symbols
from identification.sensitivity.sensitivity_section import sensitivity_section
from identification.sensitivity.sensitivity_study import run_sensitivity_study
from identification.validation.validation_section import validation_json, validation_section


@dataclass(frozen=True, kw_only=True)
class Result:
    """What a stage gives to the report and to the JSON file."""

    sections: list[Section]
    content: dict[str, Any]
    """Fields of the JSON file."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One stage of the identification."""

    name: str
    """The stage's command: `python -m identification NAME`."""
    help: str
    """The question that the stage answers, and the report's section."""
    compute: Callable[[Identification], Result]
    """Computes the stage and what it rests on. Raises CampaignError."""
    time_share: float
    """Share of a whole run's time, for the estimate of what is left."""
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
    pressure = identification.campaign.pressure
    steps = campaign_steps(identification.campaign.recordings, identification.campaign.rules)
    sensors = identification.campaign.rules.sensors
    assessments = [assess_recording(recording, pressure, steps, sensors) for recording in recordings]
    return Result(
        sections=[
            quality_section(assessment, report_2003=identification.report_2003)
            for assessment in assessments
        ],
        content={"quality": [quality_export.as_json(assessment) for assessment in assessments]},
    )


def sensitivity(identification: Identification) -> Result:
    """Section 5 at the report's conditions, and what the campaign's own recordings can separate."""
    problem = identification.problem
    replay = problem.least_squares().replay
    settings = identification.settings.sensitivity
    outputs = sensitivities_on_recordings(replay, studied_symbols(), problem.noise, settings)
    study = run_sensitivity_study(outputs=outputs, seed=identification.seed, settings=settings)
    return Result(
        sections=[sensitivity_section(study, report_2003=identification.report_2003)],
        content={"sensitivity": sensitivity_export.as_json(study)},
    )


def calibration(identification: Identification) -> Result:
    """Section 6.2."""
    calibrated = identification.calibration
    return Result(
        sections=[calibration_section(calibrated)],
        content={"calibration": calibration_json(calibrated)},
    )


def confidence(identification: Identification) -> Result:
    """Section 6.3."""
    intervals = identification.confidence
    return Result(
        sections=[confidence_section(intervals, report_2003=identification.report_2003)],
        content={"confidence": confidence_json(intervals)},
    )


def validation(identification: Identification) -> Result:
    """Section 7. Raises CampaignError if nothing was held out."""
    validated = identification.validation
    return Result(
        sections=[validation_section(validated)], content={"validation": validation_json(validated)}
    )


STAGES = (
    Stage(
        name="quality", help="is the data good enough (section 4)",
        compute=quality, time_share=0.15, role="quality",
    ),
    Stage(
        name="sensitivity", help="which parameters matter (section 5)",
        compute=sensitivity, time_share=0.4,
    ),
    Stage(
        name="calibrate", help="fit the parameters (section 6.2)",
        compute=calibration, time_share=0.25,
    ),
    Stage(
        name="confidence", help="how sure the estimates are (section 6.3)",
        compute=confidence, time_share=0.1,
    ),
    Stage(
        name="validate", help="does the model hold on held-out recordings (section 7)",
        compute=validation, time_share=0.1, role="validation",
    ),
)  # fmt: skip
"""In the order of the report."""


def result_or_omission(stage: Stage, identification: Identification) -> Result:
    """A stage's result; where the campaign lacks its recordings, a section that says so."""
    if stage.role is None or identification.campaign.with_role(stage.role):
        return stage.compute(identification)
    text = f"The campaign has no recording with role {stage.role!r}: this stage was left out."
    verdict = Verdict(status="doubt", text=text)
    return Result(
        sections=[Section(title=f"Not done: {stage.name}", verdicts=[verdict], blocks=[])], content={}
    )
