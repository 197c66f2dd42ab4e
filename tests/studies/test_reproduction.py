"""The report's tables computed again, and its figures checked against each other."""

import json

import pytest

from docs.studies.reproduction.errata import (
    ERRATUM,
    HOLDS,
    figure_checks,
    recomputed_total,
    signal_to_noise,
)
from docs.studies.reproduction.study import FOLDER, page_parts
from identification.recordings.recording import CHANNELS

STATUS = {check.where: check.status for check in figure_checks()}
PUBLISHED = json.loads((FOLDER / "reproduce.json").read_text(encoding="utf-8"))


def test_the_page_shows_the_published_results():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert all(part in page for part in page_parts(PUBLISHED).values())


def test_total_error_of_table_13_is_not_what_eq_21_gives():
    assert recomputed_total(13) == pytest.approx(6.8297, abs=1e-4)
    assert STATUS["Table 13, total error [%]"] == ERRATUM
    assert STATUS["Table 11, total error [%]"] == HOLDS


def test_only_p2_s_signal_to_noise_ratio_follows_from_its_standard_deviation():
    fits = [name for name in CHANNELS if STATUS[f"Table 3, SNR of {name} [dB]"] == HOLDS]
    assert fits == ["p2"]
    assert signal_to_noise("p2", 0.0098) == pytest.approx(64.26, abs=0.01)


def test_seven_of_ten_pairs_are_correlated():
    (found,) = [check for check in figure_checks() if "non-correlated" in check.where]
    assert found.recomputed.startswith("7 of 10 pairs beyond ±0.0196")
