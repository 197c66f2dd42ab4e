"""Compute the report's tables again.

    python -m docs.studies.reproduction.study

writes reproduce.json and the tables of README.md. The report is SCL-001/2003. Its
recordings were never published: Tables 2 to 4 and 10 to 15 come from a virtual bench whose truth is
Table 12.
"""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from docs.studies.common import PAGE, fill, study_options, study_parser, table
from docs.studies.reproduction.one_at_a_time import (
    agreement_with_printed,
    printed_sensitivities,
    sensitivities,
)
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import write_json
from epv_env.plant.parameters import Parameters, confidence_intervals
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.calibration.calibrate import STARTS
from identification.calibration.search import METHODS
from identification.pipeline.identification import Identification
from identification.quality.assessment import assess_recording
from identification.quality.section import as_json as quality_json
from identification.replay.replay import errors_as_json, responses
from identification.sensitivity import studied_symbols

FOLDER = Path(__file__).parent


def reproduce(identification: Identification) -> dict[str, Any]:
    """Every table, JSON-ready: parameters in SI units, errors in percent.

    identification: of a virtual bench's campaign whose truth is Table 12.
    """
    campaign = identification.campaign
    quality = assess_recording(campaign.with_role("quality")[0], campaign.pressure)
    return {
        **sensitivity_tables(),
        "virtual_bench": {"tables2to4": quality_json(quality), **_bench(identification)},
    }


def sensitivity_tables() -> dict[str, Any]:
    """JSON-ready 'table8' and 'table9' [%], and 'comparison' with the printed ones."""
    rows = sensitivities(Parameters.nominal(), studied_symbols())
    tables = {
        f"table{number}": {s: rows[s].as_json() for s in printed_sensitivities(number)}
        for number in (8, 9)
    }
    return {**tables, "comparison": agreement_with_printed(rows)}


def _bench(identification: Identification) -> dict[str, Any]:
    """Tables 10 to 15 of the virtual bench."""
    calibration, confidence = identification.calibration, identification.confidence
    vector, validation = identification.problem.vector, identification.problem.validation
    held_out = responses(validation, calibration.parameters("Nelder-Mead"))
    return {
        "table10": {s: vector.reference[s] for s in vector.symbols},
        "table11": errors_as_json(calibration.before),
        "table12": {m: {s: calibration.parameters(m)[s] for s in vector.symbols} for m in METHODS},
        "table13": errors_as_json(calibration.after["Nelder-Mead"]),
        "table14": {
            "eq23": {s: list(ends) for s, ends in confidence.report_intervals().items()},
            "covering": {s: list(ends) for s, ends in confidence.intervals().items()},
        },
        "table15": errors_as_json(held_out),
    }


def page_parts(results: Mapping[str, Any]) -> dict[str, str]:
    """The tables of README.md."""
    return {
        "agreement": _agreement(results["comparison"]),
        "estimates": _estimates(results["virtual_bench"]),
    }


def _agreement(found: Mapping[str, Any]) -> str:
    row = [
        f"{found['reproduced']} of {found['figures']}",
        f"all but {', '.join(found['classes_differ'])}",
        f"{found['worst_factor']:.3g}",
    ]
    return table(["Reproduced", "Classes as printed", "Farthest figure, factor"], [row])


def _estimates(bench: Mapping[str, Any]) -> str:
    """Table 12 found again, and widths of its intervals beside Table 14's."""
    truth, printed = Parameters.calibrated(), confidence_intervals()
    rows = []
    for symbol, start in bench["table10"].items():
        intervals = (
            printed[symbol],
            bench["table14"]["eq23"][symbol],
            bench["table14"]["covering"][symbol],
        )
        found = (bench["table12"][method][symbol] for method in METHODS)
        rows.append(
            [
                symbol,
                *(f"{value:.5g}" for value in (start, truth[symbol], *found)),
                *(f"{100 * np.diff(interval)[0] / truth[symbol]:.2g}" for interval in intervals),
            ]
        )
    widths = ["Table 14 [%]", "eq. 23 [%]", "covering 95 % [%]"]
    return table(["", "Start", "Truth", *METHODS, *widths], rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    campaign = run_bench(REPORT_SUITE, Parameters.calibrated(), seed=0)
    starts = 1 if options.quick else STARTS
    identification = Identification(campaign, options.work / "reproduce.jsonl", starts=starts)
    results = reproduce(identification)
    write_json(options.out / "reproduce.json", results)
    fill(options.out / PAGE, page_parts(results))
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
