"""The report of an export, as it is printed."""

from typing import Any


def as_text(report: dict[str, Any], contract: dict[str, Any]) -> str:
    """Agreement, cost and closed loop, for people."""
    return "\n".join([*_agreement(report["agreement"]), *_cost(report, contract), *_loop(report)])


def _agreement(a: dict[str, Any]) -> list[str]:
    """Agreement of the C code with the policy; a: the report's `agreement`."""
    rounding = f"{a['rounding_of_c']:.2g} in C, {a['rounding_of_python']:.2g} in Python"
    return [
        f"agreement on {a['states']} visited states: float C {a['float_agrees']}, fixed C "
        f"{a['fixed_agrees']}",
        f"nearest to a tie: logits {a['least_margin']:.2g} apart; rounding moves that by {rounding}",
    ]


def _cost(report: dict[str, Any], contract: dict[str, Any]) -> list[str]:
    """Time, operations and memory of each variant."""
    lines = []
    for variant, time in report["microseconds"].items():
        operations, size = (contract["variants"][variant][part] for part in ("operations", "bytes"))
        lines += [
            f"{variant} C: median {time['median_us']:.2f} us, slowest state "
            f"{time['slowest_state_us']:.2f} us, slowest call {time['slowest_call_us']:.1f} us",
            f"  {operations['multiply_accumulates']} multiply-accumulates, {size['constants']} B of "
            f"constants, {size['memory_of_a_valve']} B of memory for each valve",
        ]
    return lines


def _loop(report: dict[str, Any]) -> list[str]:
    """Figures of the policy and of both variants in closed loop."""
    loop = report["closed_loop"]
    width = max(len(name) for name in loop["controllers"])
    return [
        f"in closed loop, {loop['episodes']} episodes of {loop['duration_s']:g} s:",
        *(
            f"  {name:{width}} stayed {row['C1_stayed']:.1%}, "
            f"worst {row['C1_worst_excursion_bar']:.3f} bar, rms {row['rms_error_bar']:.4f} bar, "
            f"{row['switchings_per_s']:.2f} switchings/s"
            for name, row in loop["controllers"].items()
        ),
    ]
