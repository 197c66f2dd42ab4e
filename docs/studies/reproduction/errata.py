"""Printed figures of the report checked against its others: noise (Tables 1 to 4), errors (11, 13)."""

from dataclasses import dataclass, fields
from itertools import combinations

import numpy as np
from scipy import stats

from docs.studies.reproduction.one_at_a_time import PRINTED
from epv_env.plant.channels import SENSORS
from identification.quality.channel import DescriptiveStatistics
from identification.recordings.recording import UNITS
from identification.report_2003 import total_error

HOLDS, ERRATUM = "holds", "slip"
"""Values of `status` in reproduce.json: the printed figures agree, or contradict each other."""

REPORT_CHANNELS = ("I", "U", "p1", "p2", "p3")
"""Channels of the report's bench, in the order of Table 1."""

TREND_SLOPES = {"I": -6e-6, "U": 5.8e-5, "p1": 7.9e-5, "p2": -1.16e-4, "p3": -8.2e-5}
"""Table 2 [unit/s]."""

TREND_OFFSETS = {"I": -0.000235, "U": 0.001837, "p1": 1.000909, "p2": 0.99272, "p3": 0.996888}
"""Table 2 [unit]."""

_TABLE_3 = {
    "I": (0.0, 0.0, 0.0003, 0.0008, 0.001, 0.0006, 0.0049, 62.916, 3.513, 2.5794, 0.0825),
    "U": (0.0, -0.0001, -0.0009, 0.0122, 0.016, 0.0089, 0.0921, 66.953, 3.8362, 2.7138, 0.0972),
    "p1": (0.0, 0.0, 0.0007, 0.0068, 0.0074, 0.0055, 0.0507, 67.227, 3.7353, 3.052, 0.0583),
    "p2": (0.0, 0.0, 0.0017, 0.0098, 0.0093, 0.0078, 0.0733, 64.25, 3.9119, 3.1001, 0.0193),
    "p3": (0.0, 0.0, -0.0044, 0.0075, 0.0093, 0.0065, 0.0459, 66.995, 3.0882, 2.6351, 0.115),
}

STATISTICS = {
    name: DescriptiveStatistics(
        **{field.name: value for field, value in zip(fields(DescriptiveStatistics), column, strict=True)}
    )
    for name, column in _TABLE_3.items()
}
"""Table 3 by channel."""

CORRELATIONS = {
    (REPORT_CHANNELS[row], REPORT_CHANNELS[column]): PRINTED["table4"]["matrix"][row][column]
    for row, column in combinations(range(len(REPORT_CHANNELS)), 2)
}
"""Table 4, above the diagonal."""

SAMPLES = 10_000
"""Of the report's record: 5 s at 2000 Hz."""


@dataclass(frozen=True, kw_only=True)
class FigureCheck:
    """A printed value beside the same value recomputed from the report's other figures.

    The fields are those of an entry of `slips` in reproduce.json.
    """

    where: str
    """Table, equation or section, and the quantity with its unit."""
    printed: str
    """The printed value."""
    recomputed: str
    """The recomputed value, or what contradicts the printed one."""
    status: str
    """HOLDS or ERRATUM."""
    remark: str
    """What rule the recomputation uses, and what follows."""


def figure_checks() -> list[FigureCheck]:
    """All checks in the order of the report's sections."""
    return [
        *(_signal_to_noise(name) for name in REPORT_CHANNELS),
        _claimed_signal_to_noise(),
        _correlations(),
        *(_total_error(number) for number in (11, 13)),
        _improvement(),
    ]


def signal_to_noise(name: str, deviation: float) -> float:
    """Signal-to-noise ratio by eq. 17 with Table 1's greatest value [dB].

    name: channel. deviation: standard deviation of its noise [A, V or bar].
    """
    return float(20 * np.log10(SENSORS[name].high / deviation))


def recomputed_total(number: int) -> float:
    """Total error by eq. 21 [%] from the printed partial errors of Table 11 or 13."""
    return float(
        total_error([np.array(t["partial"]) for t in PRINTED[f"table{number}"]["tests"].values()])
    )


def _signal_to_noise(name: str) -> FigureCheck:
    """Printed SNR against what any standard deviation that rounds to the printed one can give."""
    deviation, printed = STATISTICS[name].standard_deviation, STATISTICS[name].signal_to_noise
    # Table 3 has four decimals.
    low, high = (signal_to_noise(name, deviation + change) for change in (5e-5, -5e-5))
    unit, greatest = UNITS[name][0], deviation * 10 ** (printed / 20)
    return FigureCheck(
        where=f"Table 3, SNR of {name} [dB]",
        printed=f"{printed:.3f}",
        recomputed=f"{low:.3f} to {high:.3f}",
        status=HOLDS if low <= printed <= high else ERRATUM,
        remark=f"eq. 17 with Table 1's greatest value, {SENSORS[name].high:g} {unit}; the printed SNR "
        f"would take {greatest:.3g} {unit}",
    )


def _claimed_signal_to_noise() -> FigureCheck:
    found = {
        name: signal_to_noise(name, STATISTICS[name].standard_deviation) for name in REPORT_CHANNELS
    }
    least = min(found, key=lambda name: found[name])
    return FigureCheck(
        where="Section 4.1, SNR 'over 62 dB in all cases' [dB]",
        printed="over 62",
        recomputed=f"{found[least]:.2f} ({least})",
        status=HOLDS if found[least] > 62.0 else ERRATUM,
        remark="eq. 17 with the printed standard deviations",
    )


def _correlations() -> FigureCheck:
    band = float(stats.norm.ppf(0.975) / np.sqrt(SAMPLES))
    far = {pair: value for pair, value in CORRELATIONS.items() if abs(value) > band}
    return FigureCheck(
        where="Table 4, 'shows non-correlated data'",
        printed="no pair correlated",
        recomputed=f"{len(far)} of 10 pairs beyond ±{band:.4f}: "
        + ", ".join(f"{a}-{b} {value:+.4f}" for (a, b), value in far.items()),
        status=ERRATUM if len(far) > 1 else HOLDS,
        remark=f"95 % band of independent white signals of {SAMPLES} samples; 1 in 20 may lie outside",
    )


def _total_error(number: int) -> FigureCheck:
    printed, recomputed = PRINTED[f"table{number}"]["total"], recomputed_total(number)
    return FigureCheck(
        where=f"Table {number}, total error [%]",
        printed=f"{printed:.4f}",
        recomputed=f"{recomputed:.4f}",
        # Partial errors are printed to 1e-4.
        status=HOLDS if abs(printed - recomputed) <= 1.5e-4 else ERRATUM,
        remark="eq. 21 over the printed partial errors",
    )


def _improvement() -> FigureCheck:
    """The claim that rests on the total of Table 13."""
    before, after = PRINTED["table11"]["total"], (PRINTED["table13"]["total"], recomputed_total(13))
    printed, recomputed = (100 * (1 - total / before) for total in after)
    return FigureCheck(
        where="Tables 11 and 13, fall of the total error [% of it]",
        printed=f"{printed:.2f}",
        recomputed=f"{recomputed:.2f}",
        status=HOLDS if abs(printed - recomputed) <= 0.01 else ERRATUM,
        remark="what the calibration gained, with the printed and with the recomputed total",
    )
