"""Speed of the plant simulation against its alternatives, on this machine and in one run.

    python -m tests.benchmarks.plant [--quick] [--json PATH]

Every figure is the median of several repetitions, with the least and the greatest. Machines are
noisy: compare ratios within one run, not figures between runs.
"""

import numpy as np

from epv_env.plant.runge_kutta import DEFAULT_STEP, LONGEST
from epv_env.plant.valves import available_cores
from identification.bench.reference_simulation import simulate_reference
from tests.benchmarks import startup, workloads
from tests.benchmarks.command_line import run
from tests.benchmarks.eventless_integrators import CLIPS, final_p2
from tests.benchmarks.measure import WALL, Row, Table, durations, rates
from tests.benchmarks.operations import count_operations
from tests.benchmarks.roofline import floating_point_rates, operation_rates
from tests.benchmarks.scalar_rk4 import run_scalar_rk4
from tests.benchmarks.workloads import PERIOD
from tests.reference.numpy_rhs import numpy_right_hand_side
from tests.reference.schedule import plant_states, report_tests

VALVES = 1024
TRUE_FINAL = "true p2 at the end of test 4 (reference, rtol 1e-11)"


def batched(table: Table, repetitions: int, periods: int) -> Row:
    """Simulated time of a whole batch. Returns the row per CPU second on one thread."""
    table.section(f"{VALVES} valves, 5 ms periods, switched at random with probability 0.15")
    u = workloads.random_switching(VALVES, periods)
    simulated = VALVES * periods * PERIOD
    one = workloads.energised_valves(VALVES, threads=1)
    cpu = rates(simulated, durations(lambda: one.record(u, PERIOD), repetitions))
    cpu_row = table.add("simulated time, 1 thread, per CPU second", "s per s", cpu)
    first = None
    for threads in sorted({1, available_cores()}):
        valves = workloads.energised_valves(VALVES, threads)
        found = rates(simulated, durations(lambda v=valves: v.record(u, PERIOD), repetitions, WALL))
        first = first or float(np.median(found))
        what = f"{threads} thread{'s' * (threads > 1)}, per wall second"
        ratio = float(np.median(found)) / first
        table.add(f"simulated time, {what}", "s per s", found, ratio=ratio)
        table.add(f"control periods, {what}", "1/s", [rate / PERIOD for rate in found])
    return cpu_row


def kernel(table: Table, repetitions: int, periods: int, batch: Row) -> None:
    """Cost of one step, and how close it comes to what the machine can do."""
    table.section("one step of one valve, one thread (both movers held: the number of steps is known)")
    valves, u = workloads.energised_valves(VALVES, 1), workloads.held(VALVES, periods)
    steps = VALVES * periods * PERIOD / (LONGEST * DEFAULT_STEP)
    seconds = durations(lambda: valves.record(u, PERIOD), repetitions)
    rate = table.add("Runge-Kutta steps", "1/s", rates(steps, seconds))
    table.add("right-hand sides", "1/s", [4 * value for value in rate.values])
    note = "2 at rest, 25 when moving; the rest is events"
    cost = rate.median / batch.median * PERIOD
    table.add("steps' time that a randomly switched period takes", "steps", cost, note=note)
    counts = count_operations()
    note = ", ".join(f"{value:g} {kind}" for kind, value in counts.items() if kind != "flop")
    table.add("floating-point operations per step", "flop", counts["flop"], note=note)
    peak = table.add("this machine: fused multiply-add", "flop/s", floating_point_rates(repetitions))
    divisions = table.add("this machine: division", "1/s", operation_rates("c / x", repetitions))
    roots = table.add("this machine: square root", "1/s", operation_rates("sqrt(x)", repetitions))
    reached = [value * counts["flop"] for value in rate.values]
    table.add("reached by the kernel", "flop/s", reached)
    table.add("reached by the kernel", "% of peak", [100 * value / peak.median for value in reached])
    divider = counts["divide"] / divisions.median + counts["square root"] / roots.median
    table.add("share of a step in which the divider is busy", "%", 100 * divider * rate.median)


def single_valve(table: Table, repetitions: int, duration: float, batch: Row) -> None:
    """The alternatives, one valve at a time."""
    table.section("one valve under the same switching; ratio: the batch on one thread is faster by")
    schedule = workloads.one_valve(duration)
    end = [schedule.duration]
    true = simulate_reference(schedule, end, rtol=1e-11).state.p2[0]

    def row(name: str, function, simulated: float = duration, times: int = repetitions) -> None:
        p2 = function()
        found = rates(simulated, durations(function, times))
        note = f"p2 wrong by {abs(p2 - true):.2g} Pa"
        table.add(name, "s per s", found, ratio=batch.median / np.median(found), note=note)

    numpy_rhs = numpy_right_hand_side(schedule.parameters)
    row("this plant, a batch of one", lambda: plant_states(schedule, end).p2[0])
    row("compiled scalar RK4, 50 us, two powers per flow", lambda: run_scalar_rk4(schedule)[0])
    for rtol in (1e-6, 1e-9):
        row(
            f"SciPy LSODA with events, compiled right-hand side, {rtol:g}",
            lambda rtol=rtol: simulate_reference(schedule, end, rtol=rtol).state.p2[0],
        )
    row(
        "SciPy LSODA with events, NumPy right-hand side, 1e-06",
        lambda: simulate_reference(schedule, end, rtol=1e-6, right_hand_side=numpy_rhs).state.p2[0],
        times=min(repetitions, 3),
    )


def without_events(table: Table) -> None:
    """Results of library integrators for test 4 without events at the stops."""
    table.section("test 4 without stop events (wrong on purpose)")
    schedule = report_tests(workloads.CALIBRATED)["test4"]
    end = [schedule.duration]
    true = table.add(TRUE_FINAL, "bar", simulate_reference(schedule, end, rtol=1e-11).state.p2[0] / 1e5)
    found = {
        "this plant at its default step": (plant_states(schedule, end).p2[0], ""),
        "compiled scalar RK4, 50 us, clamped": (run_scalar_rk4(schedule)[0], ""),
    }
    for clip in CLIPS:
        for method in ("LSODA", "Radau", "RK45"):
            found[f"SciPy {method}, {clip}"] = final_p2(schedule, method, clip)
    for name, (p2, failure) in found.items():
        note = failure or f"off by {p2 / 1e2 - true.median * 1e3:+.4g} mbar"
        table.add(name, "bar", p2 / 1e5, note=note)


def start_up(table: Table, repetitions: int) -> None:
    """Time until the first result in a fresh process."""
    table.section("a fresh process, disk caches warm")
    for name, code in (
        ("import epv_env", startup.IMPORT),
        ("import, one valve, first 5 ms simulated", startup.FIRST_STEP),
    ):
        table.add(name, "s", startup.seconds_in_fresh_processes(code, repetitions))


def benchmark(table: Table, quick: bool) -> None:
    """All sections."""
    repetitions, periods, duration = (3, 20, 0.5) if quick else (9, 200, 2.0)
    batch = batched(table, repetitions, periods)
    kernel(table, repetitions, periods, batch)
    single_valve(table, repetitions, duration, batch)
    without_events(table)
    start_up(table, repetitions)


if __name__ == "__main__":
    run(__doc__, benchmark)
