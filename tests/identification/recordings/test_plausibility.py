"""Wrong units, references, signs, exchanged channels and times are refused, and the usual ones named."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.quality.assessment import assess_recording
from identification.quality.section import check_results
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import Campaign, CampaignError, Recording

AMBIENT = 1e5
PRESSURES = ("p1", "p2", "p3")
COLUMN = {"p1": "p1_bar", "p2": "p2_bar", "p3": "p3_bar", "I": "I_A", "U": "U_V"}
UNITS = {  # factor of the reading, name in the message
    "Pa": 1e5,
    "mbar": 1e3,
    "kPa": 1e2,
    "MPa": 0.1,
    "psi": 14.5037738,
    "bar, 100 times too small": 0.01,
    "bar, 1000 times too small": 0.001,
}
Mutation = Callable[[Recording], Recording]


@cache
def bench() -> Campaign:
    """A test and the record at rest of the report's session on the virtual bench."""
    truth = Parameters.calibrated().replace(R=43.0)
    return run_bench((REPORT_SUITE[0], REPORT_SUITE[-1]), truth, seed=5)


def scaled(factor: float, offset: float, *names: str) -> Mutation:
    """Readings × factor + offset [SI of the channel]."""
    return lambda r: replace(r, **{n: factor * r.channel(n) + offset for n in names})


def exchanged(**source: str) -> Mutation:
    """Each channel's column holds another channel."""
    return lambda r: replace(r, **{n: r.channel(other) for n, other in source.items()})


def timed(factor: float) -> Mutation:
    """Times × factor."""
    return lambda r: replace(r, period=factor * r.period)


def looks(names: tuple[str, ...], text: str) -> str:
    """Pattern of the sentence that names these channels."""
    return f"{' and '.join(COLUMN[name] for name in names)} looks? like {re.escape(text)}[,: ]"


def wrong_pressures() -> dict[str, tuple[Mutation, str]]:
    """Mutations of the pressures, with what the message says."""
    cases = {
        "all gauge": (scaled(1, -AMBIENT, *PRESSURES), looks(PRESSURES, "gauge pressure")),
        "ambient added": (scaled(1, AMBIENT, *PRESSURES), "absolute pressure to which the ambient"),
        "100 times too small and ambient added": (scaled(0.01, AMBIENT, *PRESSURES), "next to empty"),
    }
    for unit, factor in UNITS.items():
        cases[f"all in {unit}"] = scaled(factor, 0, *PRESSURES), looks(PRESSURES, unit)
        gauge = scaled(factor, -factor * AMBIENT, *PRESSURES)
        cases[f"all in {unit}, gauge"] = gauge, looks(PRESSURES, f"{unit}, gauge")
        for name in PRESSURES:
            cases[f"{name} in {unit}"] = scaled(factor, 0, name), looks((name,), unit)
    for name in PRESSURES:
        cases[f"{name} gauge"] = scaled(1, -AMBIENT, name), looks((name,), "gauge pressure")
    for name in ("p1", "p3"):
        cases[f"{name} offset"] = scaled(1, 7e4, name), "although the open inlet joins them: check"
    return cases


OTHERS = {
    "p1 and p2 swapped": (exchanged(p1="p2", p2="p1"), "p1_bar and p2_bar look swapped"),
    "p2 and p3 swapped": (exchanged(p2="p3", p3="p2"), "p2_bar and p3_bar look swapped"),
    "p1 and p3 swapped": (exchanged(p1="p3", p3="p1"), "p1_bar and p3_bar look swapped"),
    "all turned": (exchanged(p1="p2", p2="p3", p3="p1"), "swapped .*p1_bar holds p2, p2_bar holds p3"),
    "I and U swapped": (exchanged(I="U", U="I"), "U_V and I_A look swapped"),
    "mA": (scaled(1e3, 0, "I"), looks(("I",), "mA")),
    "kA": (scaled(1e-3, 0, "I"), looks(("I",), "kA")),
    "µA": (scaled(1e6, 0, "I"), looks(("I",), "µA")),
    "tenth of A": (scaled(0.1, 0, "I"), looks(("I",), "A, 10 times too small")),
    "sign of I": (scaled(-1, 0, "I"), looks(("I",), "a current with its sign flipped")),
    "sign of U": (scaled(-1, 0, "U"), looks(("U",), "a voltage with its sign flipped")),
    "mA, flipped": (scaled(-1e3, 0, "I"), looks(("I",), "mA with the sign flipped")),
    "mV": (scaled(1e3, 0, "U"), looks(("U",), "mV")),
    "kV": (scaled(1e-3, 0, "U"), looks(("U",), "kV")),
    "mV and mA": (scaled(1e3, 0, "U", "I"), "6 to 32.32 V are usual: check unit"),
    "offset of I": (scaled(1, 0.1, "I"), "a current of 0.1 A flows while the coil is off: check unit"),
    "offset of U": (scaled(1, 4.0, "U"), "the voltage is 4 V while the coil is off: check unit"),
    "ms": (timed(1e3), "time_s looks like ms: give s"),
    "ks": (timed(1e-3), "time_s looks like ks: give s"),
    "half the rate": (timed(2), "time_s looks 2 times too long"),
    "twice the rate": (timed(0.5), "time_s looks 2.* times too short"),
    "a tenth of the rate": (timed(10), "time_s looks (9|1).* times too long"),
}  # fmt: skip

CASES = {**wrong_pressures(), **OTHERS}

HIDDEN_AT_REST = ("p2 in psi", "100 times too small and ambient added")
"""A circuit may hold 14.5 bar; 1.01 bar is ambient, but for its noise (see below)."""


def test_the_campaign_itself_is_accepted(tmp_path):
    write_campaign(bench(), tmp_path / "good")
    assert len(read_campaign(tmp_path / "good").recordings) == 2


@pytest.mark.parametrize("case", CASES)
def test_what_is_wrong_is_named_and_nothing_written(case, tmp_path):
    mutation, message = CASES[case]
    campaign = replace(bench(), recordings=tuple(mutation(r) for r in bench().recordings))
    with pytest.raises(CampaignError) as refused:
        write_campaign(campaign, tmp_path / "new")
    assert re.search(message, str(refused.value)), str(refused.value)
    assert list(tmp_path.iterdir()) == []


def test_a_recording_at_rest_shows_wrong_pressures_too(tmp_path):
    for case, (mutation, _) in wrong_pressures().items():
        if case not in HIDDEN_AT_REST:
            campaign = replace(bench(), recordings=(mutation(bench().recordings[-1]),))
            with pytest.raises(CampaignError, match=r"p[123]"):
                write_campaign(campaign, tmp_path / "new")


def test_pressures_a_hundred_times_too_small_do_not_end_as_good():
    """At rest, 0.01 bar to which somebody added 1 bar is ambient pressure; its noise is too small."""
    rest = scaled(0.01, 0.99 * AMBIENT, *PRESSURES)(bench().recordings[-1])
    quality = assess_recording(rest, AMBIENT)
    for name in PRESSURES:
        results = check_results(quality, name)
        assert results["noise"].status == "bad"
        assert "check the unit" in results["noise"].text
