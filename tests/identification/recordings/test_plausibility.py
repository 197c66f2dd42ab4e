"""Wrong units, references, signs, exchanged channels and times are refused with what they contradict."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.quality.assessment import assess_recording
from identification.quality.section import check_results
from identification.recordings import plausibility
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import Campaign, CampaignError, Recording

AMBIENT = 1e5
PRESSURES = ("p1", "p2", "p3")
COLUMN = {"p1": "p1_bar", "p2": "p2_bar", "p3": "p3_bar", "I": "I_A", "U": "U_V"}
UNITS = {  # factor of the reading
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


def blamed(*names: str) -> str:
    """Pattern of the sentence that names one of these channels."""
    columns = "|".join(COLUMN[name] for name in names)
    return f": check unit, reference, sign and sensor of .*({columns})"


def wrong_pressures() -> dict[str, tuple[Mutation, str]]:
    """Mutations of the pressures, with what the message says."""
    cases = {
        "all gauge": (scaled(1, -AMBIENT, *PRESSURES), r"p3 vents towards -\d\.\d* bar as gauge press"),
        "ambient added": (scaled(1, AMBIENT, *PRESSURES), blamed(*PRESSURES)),
        "100 times too small and ambient added": (scaled(0.01, AMBIENT, *PRESSURES), "next to empty"),
    }
    for unit, factor in UNITS.items():
        cases[f"all in {unit}"] = scaled(factor, 0, *PRESSURES), blamed(*PRESSURES)
        gauge = scaled(factor, -factor * AMBIENT, *PRESSURES)
        cases[f"all in {unit}, gauge"] = gauge, blamed(*PRESSURES)
        for name in PRESSURES:
            cases[f"{name} in {unit}"] = scaled(factor, 0, name), blamed(name)
    for name in PRESSURES:
        cases[f"{name} gauge"] = scaled(1, -AMBIENT, name), blamed(name)
    for name in ("p1", "p3"):
        cases[f"{name} offset"] = scaled(1, 7e4, name), "although the open inlet joins them: check"
    return cases


OTHERS = {
    "p1 and p2 swapped": (exchanged(p1="p2", p2="p1"), "with the coil on, p1 is 6.8.* and p3 12"),
    "p2 and p3 swapped": (exchanged(p2="p3", p3="p2"), "with the coil on, p1 is 12.* and p3 6.8"),
    "p1 and p3 swapped": (exchanged(p1="p3", p3="p1"), "with the coil off, p1 falls to"),
    "all turned": (exchanged(p1="p2", p2="p3", p3="p1"), "with the coil on, p1 is 6.8.* and p3 12"),
    "I and U swapped": (exchanged(I="U", U="I"), "U switches at 0.44.* V, and 6 to 32.32 V are usual"),
    "mA": (scaled(1e3, 0, "I"), "make 0.04.* ohm, and coils have 8 to 220 ohm"),
    "kA": (scaled(1e-3, 0, "I"), "make 4.3.*e.04 ohm, and coils have 8 to 220 ohm"),
    "µA": (scaled(1e6, 0, "I"), "a holding current of .*e.05 A make"),
    "sign of I": (scaled(-1, 0, "I"), "a holding current of -.* A make -4"),
    "sign of U": (scaled(-1, 0, "U"), "U switches at -18.9.* V, and 6 to 32.32 V are usual"),
    "mV": (scaled(1e3, 0, "U"), "the energised coil has 1.89.*e.04 V"),
    "kV": (scaled(1e-3, 0, "U"), "U switches at 0.0189.* V, and 6 to 32.32 V are usual: .* of U_V"),
    "mV and mA": (scaled(1e3, 0, "U", "I"), "6 to 32.32 V are usual: check unit"),
    "I of a coil that stays on": (
        lambda r: replace(r, I=np.where(r.energised, r.I, 0.3)), "a current of 0.3 A flows while"
    ),
    "offset of U": (scaled(1, 4.0, "U"), "the voltage is 4 V while the coil is off: check unit"),
    "ms": (timed(1e3), "p3 vents at 0.007.* 1/s, .*: check unit and rate of time_s"),
    "ks": (timed(1e-3), "p3 vents at 7.*e.03 1/s, .*: check unit and rate of time_s"),
    "half the rate": (timed(2), "p3 vents at 3.* 1/s, and this valve at 4.5 to 14"),
    "twice the rate": (timed(0.5), "p3 vents at 15.* 1/s, and this valve at 4.5 to 14"),
    "a tenth of the rate": (timed(10), "p3 vents at 0.7.* 1/s, and this valve at 4.5 to 14"),
}  # fmt: skip

CASES = {**wrong_pressures(), **OTHERS}

HIDDEN_AT_REST = ("p2 in psi", "100 times too small and ambient added")
"""A circuit may hold 14.5 bar; 1.01 bar is ambient, but for its noise (see below)."""


def test_the_campaign_itself_is_accepted(tmp_path):
    write_campaign(bench(), tmp_path / "good")
    assert len(read_campaign(tmp_path / "good").recordings) == 2


LEFT = {
    "a current that does not end": lambda r: replace(r, I=np.where(r.energised, r.I, r.I + 0.12)),
    "an offset of the current": scaled(1, 0.1, "I"),
    "a sensor's error of p3": scaled(1, 0.3 * AMBIENT, "p3"),
}


@pytest.mark.parametrize("case", LEFT)
def test_what_the_diagnosis_is_for_is_not_refused(case, tmp_path):
    first = LEFT[case](bench().recordings[0])
    write_campaign(replace(bench(), recordings=(first,)), tmp_path / "new")
    assert len(read_campaign(tmp_path / "new").recordings) == 1


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


CLIPPED = {
    "p2 at the top of an amplifier": ("p2", 9e5, np.minimum, "p2_bar stays at 9, its greatest"),
    "I at the end of a range": ("I", 0.4, np.minimum, "I_A stays at 0.4, its greatest"),
    "p3 at the end of a sensor": ("p3", 12e5, np.minimum, "p3_bar stays at 12, its greatest"),
    "p3 at the bottom of a converter": ("p3", 8e5, np.maximum, "p3_bar stays at 8, its least"),
}


@pytest.mark.parametrize("case", CLIPPED)
def test_a_clipped_channel_is_named_with_value_and_duration(case, tmp_path):
    name, end, clip, message = CLIPPED[case]
    first, rest = bench().recordings
    clipped = replace(first, **{name: clip(first.channel(name), end)})
    with pytest.raises(CampaignError, match=rf"test1.csv, lines \d+ to \d+: {message} reading, for \d"):
        write_campaign(replace(bench(), recordings=(clipped, rest)), tmp_path / "new")


@pytest.mark.parametrize("step", [0.0, 2e-3, 0.05, 0.2])
def test_live_noise_or_coarse_steps_are_not_taken_for_clipped(step):
    """Steps [bar] below and beyond the noise of 7 mbar; a channel may rest at 0, too."""
    rng = np.random.default_rng(4)
    course = np.concatenate([np.full(600, 6.8), np.linspace(6.8, 9.5, 200), np.full(600, 9.5)])
    values = course + 0.007 * rng.standard_normal(len(course))
    values = np.round(values / step) * step if step else values
    assert plausibility.clipped(values, 5e-4) is None
    assert plausibility.clipped(np.maximum(values - 8.0, 0.0), 5e-4) is None
    if step < 0.007:
        assert plausibility.clipped(np.minimum(values, 9.45), 5e-4) is not None
