"""One run of the confidence stage for all tests."""

from functools import cache

from identification.confidence.confidence import Confidence, assess_confidence
from tests.identification.twins import calibration


@cache
def twin_confidence() -> Confidence:
    return assess_confidence(calibration())
