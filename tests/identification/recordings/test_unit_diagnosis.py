"""Of 60 mutated campaigns every wrong unit, swap, offset, sign and rate is named, and none accepted."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.quality.assessment import assess_recording
from identification.quality.verdicts import check_results
from identification.recordings.campaign_files import read_campaign, write_campaign
from identification.recordings.recording import Campaign, CampaignError, Recording

AMBIENT = 1e5
PRESSURES = ("p1", "p2", "p3")
COLUMN = {"p1": "p1_bar", "p2": "p2_bar", "p3": "p3_bar", "I": "I_A", "U": "U_V"}
UNITS = {  # factor of the reading, name in the message
    "Pa": (1e5, "Pa"),
    "mbar": (1e3, "mbar"),
    "kPa": (1e2, "kPa"),
    "MPa": (0.1, "MPa"),
    "psi": (14.5037738, "psi"),
    "hundredth": (0.01, "bar, 100 times too small"),
    "thousandth": (0.001, "bar, 1000 times too small"),
}
Mutation = Callable[[Recording], Recording]


@cache
def bench() -> Campaign:
    """The report's session on the virtual bench."""
    return run_bench(REPORT_SUITE, Parameters.calibrated().replace(R=43.0), seed=5)


def scaled(factor: float, offset: float, *names: str) -> Mutation:
    """Readings × factor + offset [SI of the channel]."""

    def apply(recording: Recording) -> Recording:
        return replace(recording, **{n: factor * recording.channel(n) + offset for n in names})

    return apply


def exchanged(**source: str) -> Mutation:
    """Each channel's column holds another channel."""

    def apply(recording: Recording) -> Recording:
        return replace(recording, **{n: recording.channel(other) for n, other in source.items()})

    return apply


def timed(factor: float) -> Mutation:
    """Times × factor."""
    return lambda recording: replace(recording, period=factor * recording.period)


def both(first: Mutation, second: Mutation) -> Mutation:
    return lambda recording: second(first(recording))


def looks(names: tuple[str, ...], text: str) -> str:
    """Pattern of the sentence that names these channels."""
    columns = " and ".join(COLUMN[name] for name in names)
    return f"{columns} looks? like {re.escape(text)}[,: ]"


def wrong_pressures() -> dict[str, tuple[Mutation, str]]:
    """Mutations of the pressures, with what the message says."""
    cases = {}
    for unit, (factor, text) in UNITS.items():
        cases[f"all in {unit}"] = scaled(factor, 0, *PRESSURES), looks(PRESSURES, text)
        cases[f"all in {unit}, gauge"] = (
            scaled(factor, -factor * AMBIENT, *PRESSURES),
            looks(PRESSURES, f"{text}, gauge"),
        )
        for name in PRESSURES:
            cases[f"{name} in {unit}"] = scaled(factor, 0, name), looks((name,), text)
    for factor, text in ((0.01, "100"), (0.001, "1000")):
        cases[f"{text} times too small and ambient added"] = (
            scaled(factor, AMBIENT, *PRESSURES),
            looks(PRESSURES, f"bar, {text} times too small, to which the ambient was added"),
        )
    cases["all gauge"] = scaled(1, -AMBIENT, *PRESSURES), looks(PRESSURES, "gauge pressure")
    cases["ambient added"] = scaled(1, AMBIENT, *PRESSURES), "absolute pressure to which the ambient"
    for name in PRESSURES:
        cases[f"{name} gauge"] = scaled(1, -AMBIENT, name), looks((name,), "gauge pressure")
    for name in ("p1", "p3"):
        cases[f"{name} offset"] = (
            scaled(1, 7e4, name),
            f"{COLUMN[name]} .* an offset of (0.7|0.69)[0-9]* bar",
        )
    return cases


OTHERS = {
    "p1 and p2 swapped": (exchanged(p1="p2", p2="p1"), "p1_bar and p2_bar look swapped"),
    "p2 and p3 swapped": (exchanged(p2="p3", p3="p2"), "p2_bar and p3_bar look swapped"),
    "p1 and p3 swapped": (exchanged(p1="p3", p3="p1"), "p1_bar and p3_bar look swapped"),
    "all turned": (exchanged(p1="p2", p2="p3", p3="p1"), "swapped .*p1_bar holds p2, p2_bar holds p3"),
    "swapped in kPa": (
        both(scaled(100, 0, *PRESSURES), exchanged(p2="p3", p3="p2")),
        "p2_bar and p3_bar look swapped.*look like kPa",
    ),
    "I and U swapped": (exchanged(I="U", U="I"), "(U_V and I_A|I_A and U_V) look swapped"),
    "mA": (scaled(1e3, 0, "I"), looks(("I",), "mA")),
    "kA": (scaled(1e-3, 0, "I"), looks(("I",), "kA")),
    "µA": (scaled(1e6, 0, "I"), looks(("I",), "µA")),
    "tenth of A": (scaled(0.1, 0, "I"), looks(("I",), "A, 10 times too small")),
    "sign of I": (scaled(-1, 0, "I"), looks(("I",), "a current with its sign flipped")),
    "sign of U": (scaled(-1, 0, "U"), looks(("U",), "a voltage with its sign flipped")),
    "mA, flipped": (scaled(-1e3, 0, "I"), looks(("I",), "mA with the sign flipped")),
    "mV": (scaled(1e3, 0, "U"), looks(("U",), "mV")),
    "kV": (scaled(1e-3, 0, "U"), looks(("U",), "kV")),
    "mV and mA": (scaled(1e3, 0, "U", "I"), "U_V looks like mV.*I_A looks like mA"),
    "offset of I": (scaled(1, 0.1, "I"), "I_A looks like readings with an offset of 0.1 A"),
    "offset of U": (scaled(1, 4.0, "U"), "U_V looks like readings with an offset of 4 V"),
    "ms": (timed(1e3), "time_s looks like ms"),
    "ks": (timed(1e-3), "time_s looks like ks"),
    "half the rate": (timed(2), "time_s looks 2 times too long"),
    "twice the rate": (timed(0.5), "time_s looks 2.* times too short"),
    "a tenth of the rate": (timed(10), "time_s looks (9|1).* times too long"),
}  # fmt: skip

CASES = {**wrong_pressures(), **OTHERS}


HIDDEN_AT_REST = (
    "p2 in psi",  # a circuit may hold 14.5 bar
    "100 times too small and ambient added",  # 1.01 bar; the noise tells, see below
    "1000 times too small and ambient added",
)
SHOWN_AT_REST = [case for case in wrong_pressures() if case not in HIDDEN_AT_REST]


def test_there_are_sixty_mutations_or_more():
    assert len(CASES) >= 60


def test_the_campaign_itself_is_accepted(tmp_path):
    write_campaign(bench(), tmp_path / "good")
    assert len(read_campaign(tmp_path / "good").recordings) == len(bench().recordings)


@pytest.mark.parametrize("case", CASES)
def test_what_is_wrong_is_named_and_nothing_written(case, tmp_path):
    mutation, message = CASES[case]
    campaign = replace(bench(), recordings=tuple(mutation(r) for r in bench().recordings))
    with pytest.raises(CampaignError) as refused:
        write_campaign(campaign, tmp_path / "new")
    assert re.search(message, str(refused.value)), str(refused.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("case", SHOWN_AT_REST)
def test_a_recording_at_rest_shows_it_too(case, tmp_path):
    mutation, _ = CASES[case]
    campaign = replace(bench(), recordings=(mutation(bench().recordings[-1]),))
    with pytest.raises(CampaignError, match=r"p[123]"):
        write_campaign(campaign, tmp_path / "new")


def test_pressures_a_hundred_times_too_small_do_not_end_as_good():
    """At rest, 0.01 bar to which somebody added 1 bar is ambient pressure; its noise is too small."""
    rest = scaled(0.01, 0.99 * AMBIENT, *PRESSURES)(bench().recordings[-1])
    quality = assess_recording(rest, AMBIENT)
    for name in PRESSURES:
        results = {r.check: r for r in check_results(quality, name)}
        assert results["noise"].status == "bad"
        assert "check the unit" in results["noise"].text
