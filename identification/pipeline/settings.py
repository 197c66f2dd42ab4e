"""The settings of all stages of an identification."""

from dataclasses import dataclass

from identification.calibration.settings import CALIBRATION, CalibrationSettings
from identification.confidence.settings import CONFIDENCE, ConfidenceSettings
from identification.sensitivity.settings import SENSITIVITY, SensitivitySettings
from identification.validation.settings import VALIDATION, ValidationSettings


@dataclass(frozen=True, kw_only=True)
class IdentificationSettings:
    """Judgements of every stage."""

    sensitivity: SensitivitySettings = SENSITIVITY
    calibration: CalibrationSettings = CALIBRATION
    confidence: ConfidenceSettings = CONFIDENCE
    validation: ValidationSettings = VALIDATION


IDENTIFICATION = IdentificationSettings()
"""The default settings."""
