"""One campaign and everything that the stages of its identification share."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant, load_plant, plant_subject
from identification.calibration.calibrate import STARTS, Calibration, calibrate
from identification.calibration.problem import CalibrationProblem, calibration_problem
from identification.confidence.confidence import Confidence, assess_confidence
from identification.recordings.recording import Campaign
from identification.validation import Validation, validate

ESTIMATOR = "least squares"
"""The method whose estimate goes on: it weighs the outputs by their noise, so it scatters least."""


@dataclass(frozen=True)
class Identification:
    """A campaign, where finished searches are kept, and what follows from both, computed once."""

    campaign: Campaign
    journal: Path
    """File of the finished searches."""
    seed: int = 0
    """Of starts, draws and resampling."""
    plant: Plant | None = None
    """The valve as its data sheet describes it; None: the report's, from Table 10."""
    starts: int = STARTS
    """Searches of each calibration method."""

    @property
    def hashes(self) -> dict[str, str]:
        """SHA-256 of each recording's file by name."""
        return {recording.name: recording.sha256 for recording in self.campaign.recordings}

    @cached_property
    def problem(self) -> CalibrationProblem:
        """What is to be fitted to which recordings. Raises CampaignError."""
        if self.plant is None:
            return calibration_problem(self.campaign)
        return calibration_problem(self.campaign, start=self.plant.parameters, free=self.plant.free)

    @cached_property
    def calibration(self) -> Calibration:
        """Both methods from every start."""
        return calibrate(
            self.problem,
            journal=self.journal,
            subject={
                **plant_subject(load_plant(self.plant)),
                "recordings": {r.name: r.digest() for r in self.campaign.recordings},
            },
            starts=self.starts,
            seed=self.seed,
        )

    @cached_property
    def confidence(self) -> Confidence:
        """Intervals and joint region."""
        return assess_confidence(self.calibration, seed=self.seed)

    @cached_property
    def validation(self) -> Validation:
        """The calibrated model on the held-out recordings. Raises CampaignError if there is none."""
        return validate(self.problem, self.parameters)

    @property
    def parameters(self) -> Parameters:
        """The estimate that goes on [SI]."""
        return self.calibration.parameters(ESTIMATOR)
