"""Tables 8 and 9 of the report, computed again, and its check of a minimum on a virtual bench.

    python -m docs.studies.reproduction.study

writes reproduce.json and the tables of README.md. For Tables 8 and 9 every variant of the parameters
runs the report's test cases. Its total error (eq. 21) against the nominal model says how far the
responses move.
"""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import f

from docs.studies.common import PAGE, fill, study_options, study_parser
from docs.studies.common import table as markdown_table
from epv_env.common.command_line import fail_clearly
from epv_env.common.files import write_json
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.simulate import energised, simulate
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import measured_campaign, run_programme
from identification.calibration.problem import calibration_problem
from identification.calibration.search import TotalError, nelder_mead
from identification.recordings.recording import OUTPUTS
from identification.report_2003 import (
    CALIBRATION_CASES,
    CIRCUIT_PRESSURE,
    ENERGISED_VOLTAGE,
    SAMPLING_RATE,
    SUPPLY_PRESSURE,
    partial_error,
    relative_error,
    total_error,
)
from identification.sensitivity import studied_symbols

FOLDER = Path(__file__).parent
PRINTED: dict[str, Any] = json.loads((FOLDER / "printed_2003.json").read_text(encoding="utf-8"))
"""Tables that the report prints."""

FACTORS = (0.9, 1.1)
"""The changes of Tables 8 and 9."""


RELATIVE_AGREEMENT, ABSOLUTE_AGREEMENT = 0.1, 0.1
"""A figure is reproduced if it differs from the printed one by at most this fraction of it, or by at
most this many percentage points."""

NOT_COUNTED = ("a1",)
"""Its change is not printed: what it must have been is this project's guess."""


def total_errors(p: Mapping[str, ArrayLike], U_on: float = ENERGISED_VOLTAGE) -> NDArray:
    """Total error (eq. 21) of variants 1, 2, .. against variant 0, as fractions, (n - 1,).

    p: parameters by symbol [SI], arrays (n,). U_on: voltage that holds the armature [V]. Raises
    epv_env.plant.simulate.SimulationError.
    """
    partials = []
    start = energised(p, p1=SUPPLY_PRESSURE, p2=CIRCUIT_PRESSURE, U=U_on)
    for case in CALIBRATION_CASES:
        U = case.voltage(U_on, SAMPLING_RATE)
        run = simulate(p, initial=start, U=U, period=1 / SAMPLING_RATE)
        outputs = [np.asarray(getattr(run.state, name)) for name in OUTPUTS]  # (samples, n) each
        errors = [relative_error(y[:, 0], y[:, 1:], run.time) for y in outputs]
        partials.append(partial_error(errors))
    return total_error(partials)


@dataclass(frozen=True, kw_only=True)
class ErrorSensitivity:
    """Total errors (eq. 21), as fractions, that two changes of one parameter cause."""

    minus: float
    """With -10 %; for a1, which is zero, with the lower end of its domain."""
    plus: float
    """With +10 %; for a1 with the upper end of its domain."""

    @property
    def percentages(self) -> tuple[float, float]:
        """Both total errors [%]."""
        return 100 * self.minus, 100 * self.plus

    @property
    def sensitive(self) -> bool:
        """Whether the total error reaches 2 % in either direction (section 5.2.2)."""
        return max(self.minus, self.plus) >= 0.02

    def as_json(self) -> dict[str, Any]:
        """Errors in percent, and the class."""
        minus, plus = self.percentages
        return {"minus10": minus, "plus10": plus, "sensitive": self.sensitive}


def printed_sensitivities(*tables: int) -> dict[str, tuple[float, float]]:
    """Tables 8 and 9, or one of them: total errors for -10 % and +10 % by symbol [%]."""
    rows = [row for table in tables or (8, 9) for row in PRINTED[f"table{table}"].items()]
    return {symbol: (minus, plus) for symbol, (minus, plus) in rows}


def changed_values(symbol: str, nominal: float) -> tuple[float, float]:
    """The two values of one parameter that its row compares with the nominal one.

    10 % of a zero is no change, yet Table 9 prints errors for a1: a parameter that is zero goes to
    the ends of its domain instead.
    """
    domain = table()[symbol].domain
    if nominal == 0.0 and domain is not None:
        return domain
    return FACTORS[0] * nominal, FACTORS[1] * nominal


def variants(nominal: Mapping[str, float], symbols: Sequence[str]) -> dict[str, NDArray]:
    """Parameters by symbol [SI], (variants,): the nominal ones, then each symbol lowered and raised.

    There are 1 + 2 symbols variants.
    """
    p = {symbol: np.full(1 + 2 * len(symbols), value) for symbol, value in nominal.items()}
    for row, symbol in enumerate(symbols):
        p[symbol][1 + 2 * row : 3 + 2 * row] = changed_values(symbol, nominal[symbol])
    return p


def sensitivities(
    nominal: Mapping[str, float],
    symbols: Sequence[str],
    *,
    U_on: float = ENERGISED_VOLTAGE,
) -> dict[str, ErrorSensitivity]:
    """Total errors against the nominal model by symbol; all variants run in one batch."""
    errors = total_errors(variants(nominal, symbols), U_on)
    pairs = errors.reshape(-1, 2).tolist()
    return {
        symbol: ErrorSensitivity(minus=minus, plus=plus)
        for symbol, (minus, plus) in zip(symbols, pairs, strict=True)
    }


def agreement_with_printed(rows: Mapping[str, ErrorSensitivity]) -> dict[str, Any]:
    """How a computation meets the printed tables, JSON-ready.

    'figures' and 'reproduced' count figures, 'worst_factor' is the largest ratio of two, either way, and
    'classes_differ' names the symbols, a1 among them, whose class is another.
    """
    printed = printed_sensitivities()
    pairs = [
        pair
        for symbol in printed
        if symbol not in NOT_COUNTED
        for pair in zip(rows[symbol].percentages, printed[symbol], strict=True)
    ]
    return {
        "figures": len(pairs),
        "reproduced": sum(_is_reproduced(*pair) for pair in pairs),
        "classes_differ": [s for s in printed if rows[s].sensitive != table()[s].sensitive],
        "worst_factor": max(max(a / b, b / a) for a, b in pairs),
    }


def _is_reproduced(percent: float, printed: float) -> bool:
    return abs(percent - printed) <= max(RELATIVE_AGREEMENT * printed, ABSOLUTE_AGREEMENT)


def sensitivity_tables() -> dict[str, Any]:
    """JSON-ready 'table8' and 'table9' [%], and 'comparison' with the printed ones."""
    rows = sensitivities(Parameters.nominal(), studied_symbols())
    tables = {
        f"table{number}": {s: rows[s].as_json() for s in printed_sensitivities(number)}
        for number in (8, 9)
    }
    return {**tables, "comparison": agreement_with_printed(rows)}


def limit_ratio(values: int, parameters: int) -> float:
    """eps_p / eps_opt of eq. 23, 1 + v/(k - v) F, for k measured values and v parameters.

    The printed F(k, v - k, p) has negative degrees of freedom; F(v, k - v) is meant, at p = 0.95.
    """
    degrees = values - parameters
    return 1.0 + parameters / degrees * float(f.ppf(0.95, parameters, degrees))


def differences(function: Callable[[NDArray], float], z: NDArray) -> tuple[NDArray, NDArray]:
    """Gradient (k,) and Hessian (k, k) at z by central differences of a thousandth."""
    steps = 1e-3 * np.eye(len(z))
    ends = np.array([[function(z - step), function(z + step)] for step in steps])
    mixed = [
        [sum(i * j * function(z + i * a + j * b) for i in (-1, 1) for j in (-1, 1)) for b in steps]
        for a in steps
    ]
    return np.diff(ends)[:, 0] / 2e-3, np.array(mixed) / 4e-6


def minimum(seed: int = 1) -> dict[str, Any]:
    """The Nelder-Mead estimate of a virtual bench with Table 12's valve, and what the report asks of it.

    JSON-ready: 'deviation' from Table 12 and 'half_width' of eq. 23's interval, where the total error
    with the other parameters held stays below eps_p (Table 14), in % of the value by symbol; 'gradient'
    and 'hessian_eigenvalues' of the total error, a fraction, by the scaled parameters.
    """
    true = Parameters.calibrated()
    truths = [run_programme(true, programme) for programme in REPORT_SUITE]
    problem = calibration_problem(measured_campaign(truths, true, seed=seed))
    vector, error = problem.vector, TotalError(problem)
    fit = nelder_mead(problem, vector.scaled(vector.reference))
    gradient, hessian = differences(error, fit.z)
    _, curvature = differences(lambda z: 0.5 * error(z) ** 2, fit.z)
    values = sum(run.measured.size for run in problem.plant.runs)
    rise = fit.error**2 * (limit_ratio(values, len(fit.z)) ** 2 - 1.0)
    deviation = fit.z / vector.scaled(true) - 1.0
    half_width = np.sqrt(rise / np.diag(curvature)) / fit.z
    return {
        "deviation": dict(zip(vector.symbols, (100 * deviation).tolist(), strict=True)),
        "half_width": dict(zip(vector.symbols, (100 * half_width).tolist(), strict=True)),
        "gradient": gradient.tolist(),
        "hessian_eigenvalues": np.linalg.eigvalsh(hessian).tolist(),
    }


def minimum_table(found: Mapping[str, Any]) -> str:
    """The second table of README.md; found: of `minimum`."""
    rows = [
        [symbol, f"{deviation:.4f}", f"±{found['half_width'][symbol]:.4f}"]
        for symbol, deviation in found["deviation"].items()
    ]
    return markdown_table(["Parameter", "Off Table 12 [%]", "Interval by eq. 23 [%]"], rows)


def agreement(found: Mapping[str, Any]) -> str:
    """The table of README.md; found: 'comparison'."""
    row = [
        f"{found['reproduced']} of {found['figures']}",
        f"all but {', '.join(found['classes_differ'])}",
        f"{found['worst_factor']:.3g}",
    ]
    return markdown_table(["Reproduced", "Classes as printed", "Farthest figure, factor"], [row])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    options = study_options(study_parser(__doc__ or "", FOLDER), arguments)
    results = {**sensitivity_tables(), "minimum": minimum()}
    write_json(options.out / "reproduce.json", results)
    tables = {
        "agreement": agreement(results["comparison"]),
        "minimum": minimum_table(results["minimum"]),
    }
    fill(options.out / PAGE, tables)
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
