"""Speed and memory of the identification, compared with SciPy's solver and the acceptance criteria.

    python -m tests.benchmarks.identification [--quick] [--json PATH]

The campaigns are the virtual bench's. A criterion is the largest accepted figure on one core or two.
Figures measured while other processes use the cores prove nothing.
"""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from threadpoolctl import threadpool_limits

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import DIAGNOSIS_SUITE, REPORT_SUITE
from identification.bench.session import TrueSignals, measured_campaign, run_programme
from identification.calibration.problem import CalibrationProblem, calibration_problem
from identification.calibration.search_methods import SearchResult, nelder_mead, weighted_least_squares
from identification.recordings.campaign_files import write_campaign
from identification.recordings.recording import Campaign
from tests.benchmarks.command_line import run
from tests.benchmarks.fresh_processes import identification_process
from tests.benchmarks.measure import CPU, Row, Table, durations
from tests.benchmarks.scipy_replay import RTOL, scipy_misfit

TRUE = Parameters.calibrated()
LARGE_CAMPAIGN = 100
"""Calibration recordings of the large campaign."""
VALVE_WITH_EFFECTS = TRUE.replace(A_PV=1e-7, G_eddy=2e-3)
"""A valve with two effects, so that a diagnosis has to search pairs."""
ACCEPTANCE_CRITERIA = {
    "evaluation": 10.0, "search": 5.0, "run": 60.0, "diagnosis": 60.0,
    "memory": 2048.0,
}  # fmt: skip
"""Largest accepted medians [ms, s, s, s, s, MiB]."""


def benchmark(table: Table, quick: bool) -> None:
    """All sections."""
    truths = [run_programme(TRUE, programme) for programme in REPORT_SUITE]
    # The command line does the same: threads of the linear algebra would wait for each other.
    with threadpool_limits(1):
        fits(table, calibration_problem(measured_campaign(truths, TRUE, seed=0)), quick)
    with TemporaryDirectory() as folder:
        whole_run(table, Path(folder), 1 if quick else 3, warm=not quick)
        many_recordings(table, Path(folder), truths, quick)
        diagnoses(table, Path(folder), quick)


def fits(table: Table, problem: CalibrationProblem, quick: bool) -> None:
    """The report's fit, on this plant and on SciPy's solver."""
    table.section("four parameters from Table 10, four tests of 3 outputs at 2 kHz, CPU time")
    repetitions = 3 if quick else 9
    misfit, squares = problem.total_error(), problem.least_squares()
    start = problem.vector.scaled(problem.vector.reference)
    seconds = durations(lambda: misfit.error(start), 10 * repetitions)
    one = table.add(
        "one evaluation of the total error",
        "ms",
        [1e3 * s for s in seconds],
        limit=ACCEPTANCE_CRITERIA["evaluation"],
    )
    simplex = nelder_mead(misfit, start)
    search = table.add(
        "Nelder-Mead to convergence", "s", durations(lambda: nelder_mead(misfit, start), repetitions),
        limit=ACCEPTANCE_CRITERIA["search"], note=outcome(simplex),
    )  # fmt: skip
    gauss = weighted_least_squares(squares, start)
    seconds = durations(lambda: weighted_least_squares(squares, start), repetitions)
    table.add("weighted least squares to convergence", "s", seconds, note=outcome(gauss))
    beside_scipy(table, problem, simplex, one, search, quick)


def beside_scipy(
    table: Table, problem: CalibrationProblem, simplex: SearchResult, one: Row, search: Row, quick: bool
) -> None:
    """The same error, and the same search, through SciPy's LSODA; one, search: this plant's rows."""
    table.section(f"the same fit through SciPy's LSODA at rtol {RTOL:g}; ratio: this plant is faster by")
    peer, start = scipy_misfit(problem), simplex.start
    here, there = problem.total_error().error(start), peer.error(start)
    seconds = durations(lambda: peer.error(start), 3 if quick else 9)
    found = table.add(
        "one evaluation of the total error", "ms", [1e3 * s for s in seconds],
        ratio=1e3 * float(np.median(seconds)) / one.median,
        note=f"error {100 * there:.4g} %, here {100 * here:.4g} %",
    )  # fmt: skip
    estimate = 1e-3 * found.median * simplex.evaluations
    note = f"if it took {simplex.evaluations} evaluations too"
    table.add("Nelder-Mead, estimated", "s", estimate, ratio=estimate / search.median, note=note)
    if quick:
        return
    began = CPU()
    fit = nelder_mead(peer, start)
    taken = CPU() - began
    apart = float(np.max(np.abs(fit.z / simplex.z - 1)))
    note = f"{outcome(fit)}, estimate {apart:.1g} from this plant's"
    table.add("Nelder-Mead to convergence", "s", taken, ratio=taken / search.median, note=note)


def outcome(fit: SearchResult) -> str:
    """Evaluations and final error of a search."""
    error = f"{100 * fit.error:.5g} %" if fit.method == "Nelder-Mead" else f"rms {fit.error:.5g} sigma"
    return f"{fit.evaluations} evaluations, {error}{'' if fit.converged else ', NOT CONVERGED'}"


def whole_run(table: Table, folder: Path, repetitions: int, *, warm: bool) -> None:
    """`run` on the report's campaign. warm: begin with one that is not counted."""
    caches = "compile caches warm" if warm else "compile caches as they are"
    table.section(f"fresh processes, wall time, {caches}")
    campaign = folder / "report"
    bench = identification_process("bench", "--out", campaign)
    table.add("bench: the report's campaign", "s", bench.seconds, note=bench.note)
    found = [
        identification_process("run", campaign, "--out", folder / f"run{i}")
        for i in range(repetitions + warm)
    ][warm:]
    seconds = [process.seconds for process in found]
    table.add(
        "run: the report's campaign", "s", seconds, limit=ACCEPTANCE_CRITERIA["run"], note=found[-1].note
    )
    table.add("  its memory at most", "MiB", [p.peak for p in found])


def many_recordings(table: Table, folder: Path, truths: list[TrueSignals], quick: bool) -> None:
    """A campaign of LARGE_CAMPAIGN recordings; quick: no more than its calibration from one start."""
    campaign = folder / "many"
    write_campaign(large_campaign(truths), campaign)
    command = ("calibrate", "--starts", 1) if quick else ("run",)
    found = identification_process(command[0], campaign, "--out", folder / "large", *command[1:])
    name = f"{' '.join(map(str, command))}: {LARGE_CAMPAIGN} recordings"
    table.add(name, "s", found.seconds, note=found.note)
    table.add("  its memory at most", "MiB", found.peak, limit=ACCEPTANCE_CRITERIA["memory"])


def large_campaign(truths: list[TrueSignals]) -> Campaign:
    """The report's four tests measured again and again, each time with noise of their own."""
    tests = [truth for truth in truths if truth.programme.role == "calibration"]
    others = [truth for truth in truths if truth.programme.role != "calibration"]
    copies = [renamed(tests[i % len(tests)], f"{i + 1:03d}") for i in range(LARGE_CAMPAIGN)]
    return measured_campaign([*copies, *others], TRUE, seed=0, name=f"{LARGE_CAMPAIGN} recordings")


def diagnoses(table: Table, folder: Path, quick: bool) -> None:
    """`gap` with two effects at work, and how its time grows with the recordings."""
    table.section("diagnosis of the gap: two effects, whole catalogue; ratio: to the nine recordings")
    suite = [p for p in DIAGNOSIS_SUITE if p.name not in ("rest", "high_voltage")]
    truths = [run_programme(VALVE_WITH_EFFECTS, programme) for programme in suite]
    fitted = [truth for truth in truths if truth.programme.role == "calibration"]
    nine = 0.0
    for copies in (0, 1) if quick else (0, 1, 3):
        more = [renamed(t, f"{t.programme.name}_{c}") for c in range(copies) for t in fitted]
        campaign = folder / f"ailing{copies}"
        write_campaign(
            measured_campaign([*truths, *more], VALVE_WITH_EFFECTS, seed=0, offsets={}), campaign
        )
        found = identification_process("gap", campaign, "--out", folder / f"gap{copies}")
        count = len(truths) + len(more)
        nine = nine or found.seconds
        table.add(
            f"gap: {count} recordings", "s", found.seconds, ratio=found.seconds / nine,
            limit=None if copies else ACCEPTANCE_CRITERIA["diagnosis"], note=found.note,
        )  # fmt: skip
        table.add("  its memory at most", "MiB", found.peak, limit=ACCEPTANCE_CRITERIA["memory"])


def renamed(truth: TrueSignals, name: str) -> TrueSignals:
    """The same course under another name."""
    return replace(truth, programme=replace(truth.programme, name=name))


if __name__ == "__main__":
    run(__doc__, benchmark)
