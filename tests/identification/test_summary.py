"""The first screen of a calibration: values, meanings, and honest answers whether to trust them."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.calibration.calibrate import Calibration
from identification.pipeline.identification import (
    ESTIMATOR,
    Identification,
    common_reasons,
    judge_values,
    summary_section,
    worst,
)
from identification.recordings.recording import Campaign
from identification.report.page import Table
from identification.validation import Validation, validate
from tests.identification.twins import TRUE, calibration, problem, twin, twin_confidence


def identification(
    calibrated: Calibration | None = None, validation: Validation | None = None,
    campaign: Campaign | None = None,
) -> Identification:  # fmt: skip
    """Twin recordings that are already calibrated, so that a test takes no search."""
    made = Identification(campaign or twin(), Path("not-written.jsonl"))
    found = calibrated or calibration()
    made.__dict__["calibration"] = found
    made.__dict__["confidence"] = replace(twin_confidence(), estimate=found.best(ESTIMATOR).z)
    made.__dict__["validation"] = validation or validate(problem(), TRUE)
    return made


def with_best(**changes) -> Calibration:
    """The calibration with another result of its only least-squares search."""
    fits = dict(calibration().fits)
    fits[ESTIMATOR] = [replace(fits[ESTIMATOR][0], **changes)]
    return replace(calibration(), fits=fits)


def values(made: Identification) -> Table:
    (block,) = summary_section(made).blocks
    assert isinstance(block, Table)
    return block


def test_a_good_calibration_is_to_be_trusted():
    section = summary_section(identification())
    assert section.summary
    assert [verdict.status for verdict in section.verdicts] == ["good"]
    assert values(identification()).statuses == ["good"] * len(CALIBRATED_SYMBOLS)


def test_a_model_that_misses_held_out_recordings_makes_all_values_doubtful():
    wrong = validate(problem(), TRUE.replace(R=1.02 * TRUE["R"]))
    made = identification(validation=wrong)
    (verdict,) = summary_section(made).verdicts
    assert verdict.status == "doubt"
    assert "held-out I is missed by" in verdict.text
    assert set(values(made).statuses) == {"doubt"}
    assert {row[-1] for row in values(made).rows} == {"with care: for the reason above"}


def test_without_a_held_out_recording_nothing_is_promised():
    kept = tuple(r for r in twin().recordings if r.role != "validation")
    made = identification(campaign=replace(twin(), recordings=kept))
    (reason,) = common_reasons(made)
    assert (reason.status, "no recording was held out" in reason.text) == ("doubt", True)


def test_a_search_that_has_not_converged_is_not_to_be_used():
    made = identification(with_best(converged=False))
    assert [reason.status for reason in common_reasons(made)] == ["bad"]


def test_only_the_value_at_an_end_of_its_domain_is_not_to_be_used():
    symbol = "R"
    vector = calibration().problem.vector
    z = calibration().best(ESTIMATOR).z.copy()
    place = vector.symbols.index(symbol)
    z[place] = np.max(vector.bounds[place])
    judged = judge_values(identification(with_best(z=z)))
    statuses = {symbol: worst(reasons) for symbol, reasons in judged.items()}
    assert statuses[symbol] == "bad"
    assert "bad" not in {status for other, status in statuses.items() if other != symbol}


def test_a_wide_interval_is_doubted():
    made = identification()
    made.__dict__["confidence"] = replace(
        twin_confidence(), covariance=twin_confidence().covariance + 1.0
    )
    judged = judge_values(made)
    assert {worst(reasons) for reasons in judged.values()} == {"doubt"}
    assert all("wide" in reasons[-1].text for reasons in judged.values())
