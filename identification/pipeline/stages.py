"""The stages of an identification on one campaign; each runs what it needs, and nothing twice."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from epv_env.plant.parameters import Parameters
from identification.calibration.calibrate import STARTS, Calibration, calibrate
from identification.calibration.calibration_section import calibration_json, calibration_section
from identification.calibration.problem import Problem, calibration_problem
from identification.confidence.confidence import Confidence, confidence
from identification.confidence.confidence_section import confidence_json, confidence_section
from identification.quality import quality_export
from identification.quality.assess import assess
from identification.quality.quality_section import quality_section
from identification.recordings.recording import Campaign, CampaignError
from identification.report.page import Section, Verdict
from identification.sensitivity import sensitivity_export
from identification.sensitivity.collinearity import sensitivities_on_recordings
from identification.sensitivity.one_at_a_time import studied_symbols
from identification.sensitivity.results import run_study
from identification.sensitivity.sensitivity_section import sensitivity_section
from identification.validation.validate import validate
from identification.validation.validation_section import validation_json, validation_section

ESTIMATOR = "least squares"
"""The method whose estimate goes on: it weighs the outputs by their noise, so it scatters least."""


@dataclass(frozen=True, kw_only=True)
class Result:
    """What a stage gives to the report and to the JSON file."""

    sections: list[Section]
    content: dict[str, Any]


@dataclass(frozen=True)
class Identification:
    """A campaign, where finished searches are kept, and what follows from both when asked for."""

    campaign: Campaign
    journal: Path
    seed: int = 0
    starts: int = STARTS

    @property
    def hashes(self) -> dict[str, str]:
        """SHA-256 of each recording's file by name."""
        return {recording.name: recording.sha256 for recording in self.campaign.recordings}

    @cached_property
    def problem(self) -> Problem:
        """What is to be fitted to which recordings."""
        return calibration_problem(self.campaign)

    @cached_property
    def calibration(self) -> Calibration:
        """Both methods from every start."""
        return calibrate(
            self.problem,
            journal=self.journal,
            subject={
                "software": version("epv-valve"),
                "recordings": {r.name: r.digest() for r in self.campaign.recordings},
            },
            starts=self.starts,
            seed=self.seed,
        )

    @cached_property
    def confidence(self) -> Confidence:
        """Intervals and joint region."""
        return confidence(self.calibration, seed=self.seed)

    @property
    def parameters(self) -> Parameters:
        """The estimate that goes on."""
        return self.calibration.parameters(ESTIMATOR)


def quality(identification: Identification) -> Result:
    """Section 4 for every quality recording. Raises CampaignError if there is none."""
    recordings = identification.campaign.of("quality")
    if not recordings:
        raise CampaignError(
            f"campaign {identification.campaign.name!r} has no recording with role 'quality': record "
            "about 5 s at rest, coil off and exhausted, and list it in campaign.json"
        )
    found = [assess(recording, identification.campaign.pressure) for recording in recordings]
    return Result(
        sections=[quality_section(quality) for quality in found],
        content={"quality": [quality_export.as_json(quality) for quality in found]},
    )


def sensitivity(identification: Identification) -> Result:
    """Section 5 at the report's conditions, and what the campaign's own recordings can separate."""
    problem = identification.problem
    replay = problem.least_squares().replay
    outputs = sensitivities_on_recordings(replay, studied_symbols(), problem.noise)
    study = run_study(outputs=outputs, seed=identification.seed)
    return Result(
        sections=[sensitivity_section(study)],
        content={"sensitivity": sensitivity_export.as_json(study)},
    )


def calibration(identification: Identification) -> Result:
    """Section 6.2."""
    found = identification.calibration
    return Result(
        sections=[calibration_section(found)], content={"calibration": calibration_json(found)}
    )


def confidence_stage(identification: Identification) -> Result:
    """Section 6.3."""
    found = identification.confidence
    return Result(sections=[confidence_section(found)], content={"confidence": confidence_json(found)})


def validation(identification: Identification) -> Result:
    """Section 7. Raises CampaignError if nothing was held out."""
    found = validate(identification.problem, identification.parameters)
    return Result(sections=[validation_section(found)], content={"validation": validation_json(found)})


STAGES: Mapping[str, Callable[[Identification], Result]] = {
    "quality": quality,
    "sensitivity": sensitivity,
    "calibrate": calibration,
    "confidence": confidence_stage,
    "validate": validation,
}
"""By the command's name, in the order of the report."""


def possible(stage: str, identification: Identification) -> Result:
    """A stage's result; where the campaign lacks its recordings, a section that says so."""
    lacking = {"quality": "quality", "validate": "validation"}.get(stage)
    if lacking is None or identification.campaign.of(lacking):
        return STAGES[stage](identification)
    text = f"The campaign has no recording with role {lacking!r}: this stage was left out."
    verdict = Verdict(status="doubt", text=text)
    return Result(
        sections=[Section(title=f"Not done: {stage}", verdicts=[verdict], blocks=[])], content={}
    )
