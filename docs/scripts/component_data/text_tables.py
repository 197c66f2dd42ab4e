"""The results in lines of text."""

import numpy as np

from docs.scripts.component_data.chambers import LAWS, effective_area, orifice_rate
from docs.scripts.component_data.component_results import ComponentResults
from docs.scripts.component_data.friction import mean_interval
from docs.scripts.component_data.settings import DEFAULTS, ComponentSettings
from epv_env.common.units import BAR
from epv_env.plant.effects.coil import COPPER
from epv_env.plant.parameters import Parameters


def friction_table(results: ComponentResults) -> list[str]:
    """Lines of the table of seal friction."""
    rows = [
        "seal, bar         friction [N]         not corrected  speeds [mm/s]  S at rest  S at reversal"
    ]
    for (seal, bar), loop in results.loops.items():
        low, high = mean_interval(loop.halves)
        fast = " ".join(f"{1e3 * speed:.1f}" for speed in loop.speeds)
        bound = "" if loop.first_peaked or np.isnan(loop.first_excess) else ">"
        rows.append(
            f"{seal:10} {bar}   {loop.mean:6.2f} ({low:.2f} to {high:.2f})  {loop.raw:9.2f}"
            f"      {fast:>10}  {bound:>4}{loop.first_excess:5.2f}  {loop.reversal_excess:9.2f}"
        )
    for seal, fit in results.lines.items():
        constant = f"{fit.constant:.1f} ± {fit.constant_half:.1f} N"
        rows.append(f"{seal}: {constant} + ({fit.slope:.2f} ± {fit.slope_half:.2f}) N/bar")
    return rows


def chamber_table(results: ComponentResults, settings: ComponentSettings = DEFAULTS) -> list[str]:
    """Lines of the table of leaks and settling."""
    rows = [
        "chamber        law      rms [bar]  effective area per litre [m^2] at 8, 4, 1.5 bar absolute"
    ]
    for (chamber, law), fit in results.decays.items():
        areas = [effective_area(LAWS[law][0], fit.sizes, bar * BAR) for bar in (8, 4, 1.5)]
        rows.append(
            f"{chamber:14} {law:8} {fit.rms * 1e-5:8.3f}   " + " ".join(f"{a:.1e}" for a in areas)
        )
    rows.append("chamber        fall in 0-15 s, after 75 s [1e-6/s]  area per litre [m^2]  settles")
    longest = settings.settled_share * settings.settling_times[1]
    choked = float(orifice_rate(np.array([8e5]), 1.0)[0]) / 8e5
    for chamber, (early, late) in results.decay_rates.items():
        size, lag = results.settlings[chamber]
        falls = f"{1e6 * early:8.0f} {1e6 * late:8.0f}   {late / choked * 1e-3:.1e}"
        text = f"{size * 1e-2:.0f} mbar in {lag:.0f} s" if lag < longest else "not told"
        rows.append(f"{chamber:14} {falls}   {text}")
    return rows


def solenoid_table(results: ComponentResults) -> list[str]:
    """Lines of the table of currents and inductances."""
    copper = COPPER / (1 + COPPER * 10)
    rows = [f"current over case temperature [%/K]; copper at 30 degrees: {-100 * copper:.3f}"]
    for name, slopes in results.slopes.items():
        low, middle, high = 100 * np.quantile(slopes, [0, 0.5, 1])
        rows.append(f"{name:12} {middle:.3f} ({low:.3f} to {high:.3f} over the stroke)")
    for name, coil in results.shorted_turns.items():
        other = results.diffusions[name]
        rows.append(
            f"{name:12} L {1e3 * coil.inductance:.1f} mH, R_e {coil.eddy:.0f} ohm, leakage"
            f" {1e3 * coil.leakage:.2f} mH: within {100 * coil.worst:.1f} %;"
            f" diffusion within {100 * other.worst:.0f} %,"
            f" without leakage within {100 * results.without_leakage[name].worst:.0f} %"
        )
    ours, theirs = Parameters.calibrated(), results.shorted_turns["plunger in"]
    inductance = ours["N"] ** 2 / ours["RML"]
    eddy = inductance / theirs.inductance * theirs.eddy
    rows.append(f"the same iron behind our coil of {inductance:.3f} H, pulled in: R_e {eddy:.0f} ohm")
    return rows
