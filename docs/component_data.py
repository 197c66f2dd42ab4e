"""Check forms and sizes of effects against public measurements of components (docs/component-data.md).

python docs/component_data.py --data FOLDER --out docs/images

FOLDER holds friction/, chambers/ and solenoids/ as that page lists them; nothing of it is kept here.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy import optimize, signal, stats

from epv_env.plant.commandline import fail_clearly, writable_folder
from epv_env.plant.flow import mass_flux
from epv_env.plant.parameters import Parameters

Array = NDArray[np.float64]

SEALS = {"O-ring257": 0.0257, "X-ring257": 0.0257, "Circle": 0.025}
"""Bores by seal [m] (the authors' notebook): what turns pressure into force."""
PRESSURES = (1, 3, 5, 7)
"""Gauge pressures of the friction runs [bar]."""
UNSTEADY = ("X-ring257", 7)
"""Its friction grows by a quarter within nine cycles: no part of the seal's line over pressure."""
LEAKY = ("Ultimaker_015", "Ultimaker_020")
TIGHT = ("Aluminium", "Formlabs", "Prusa", "Ultimaker_006", "Ultimaker_010")
THREE_TEMPERATURES = ("CB10370380", "CBS0730140", "SSBH-0830")
"""Solenoids that were measured at each stroke at three case temperatures or more."""
FREQUENCIES = np.array([1e2, 1e3, 1e4, 1e5])
"""Of the inductances [Hz]."""
INDUCTANCES = {
    "plunger out": np.array([65.3, 20.34, 4.31, 4.22]) * 1e-3,
    "plunger in": np.array([123.3, 16.28, 4.10, 4.23]) * 1e-3,
}
"""CBS07300580 of 51.9 ohm [H]: work/Measure_vs_Calc/SolStrokeExp.xlsx in the solenoids' repository."""
AMBIENT = 1.01325e5
"""Pressure outside, which nobody recorded [Pa]."""
ZERO = 3.4e3
"""Reading of the chambers' sensor at no pressure [Pa]: where the record of the leakiest one ends."""
LONGEST_SETTLING = 60.0
"""Beyond this a record of 145 s cannot tell settling from leaking [s]."""
RT = 287.05 * 293.15
"""R T of the air at 20 degrees [J/kg]."""
COPPER = 0.00393
"""Temperature coefficient of copper at 20 degrees [1/K]."""
OURS = Parameters.calibrated()
OUR_INDUCTANCE = float(OURS["N"] ** 2 / OURS["RML"])
"""Of the valve's coil, pulled in [H]."""
RNG_SEED = 1
"""Of the bootstrap."""


# Friction: half the force loop, less what the regulator's droop puts into it.


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Friction of one seal at one pressure."""

    halves: Array
    """Half the loop between 8 and 28 mm, by cycle [N]."""
    raw: float
    """The same without taking the pressure's difference between the strokes out [N]."""
    speeds: tuple[float, float]
    """Mean speed in, out [m/s]."""
    first_excess: float
    """Friction at the first break-away over that of the first cycle, less 1 [-]; nan: not recorded."""
    first_peaked: bool
    """Whether the record shows the break-away's fall; else its excess is a lower bound."""
    reversal_excess: float
    """The same within 5 mm of a reversal, mean over the strokes [-]."""

    @property
    def mean(self) -> float:
        """Sliding friction [N]."""
        return float(self.halves.mean())


def strokes(position: Array) -> list[slice]:
    """Strokes between reversals [samples], for positions in metres over a stroke of about 40 mm."""
    far = signal.find_peaks(position, prominence=0.02, distance=100)[0]
    near = signal.find_peaks(-position, prominence=0.02, distance=100)[0]
    turns = np.sort(np.r_[far, near])
    return [slice(a, b) for a, b in pairwise(turns.tolist())]


def window_means(values: Array, position: Array, parts: list[slice]) -> tuple[Array, Array]:
    """Means of the strokes in and out between 8 and 28 mm, as many of each."""
    means: dict[bool, list[float]] = {True: [], False: []}
    for part in parts:
        x = position[part]
        inside = (x > 0.008) & (x < 0.028)
        means[bool(x[-1] > x[0])].append(float(values[part][inside].mean()))
    count = min(len(means[True]), len(means[False]))
    return np.array(means[True][:count]), np.array(means[False][:count])


def friction_loop(time: Array, position: Array, pressure: Array, force: Array, bore: float) -> Loop:
    """Friction from one run; SI units, gauge pressure."""
    parts = strokes(position)
    if len(parts) < 2:
        raise ValueError("a friction run needs two strokes or more: take a longer record")
    # The regulator holds 0.1-0.2 bar more on the way in: the loop of the force alone is no friction.
    rest = force - pressure * np.pi / 4 * bore**2
    inward, outward = window_means(rest, position, parts)
    raw_in, raw_out = window_means(force, position, parts)
    fast_in, fast_out = window_means(np.gradient(position, time), position, parts)
    halves = (inward - outward) / 2
    friction = rest - (inward.mean() + outward.mean()) / 2
    excess, peaked = first_excess(position, friction, halves[0])
    return Loop(
        halves=halves,
        raw=float((raw_in.mean() - raw_out.mean()) / 2),
        speeds=(float(fast_in.mean()), float(-fast_out.mean())),
        first_excess=excess,
        first_peaked=peaked,
        reversal_excess=reversal_excess(position, friction, parts, float(halves.mean())),
    )


def first_excess(position: Array, friction: Array, sliding: float) -> tuple[float, bool]:
    """Excess of the break-away from the rest before the first stroke [-], and whether its fall shows."""
    start = int(np.argmax(position > 0.0006))
    # Some records lost the first 0.3 s: without the rise from rest there is no break-away to see.
    if start < 8 or abs(position[0]) > 5e-4:
        return float("nan"), False
    peak = int(np.argmax(friction[:start]))
    return float(friction[peak] / sliding - 1), peak < start - 1


def reversal_excess(position: Array, friction: Array, parts: list[slice], sliding: float) -> float:
    """Excess within 5 mm of a reversal, on the mean over the strokes, which takes the noise out [-]."""
    distances = np.linspace(0.0005, 0.005, 46)
    profiles = []
    for part in parts:
        sign = np.sign(position[part][-1] - position[part][0])
        travelled = np.maximum.accumulate(sign * (position[part] - position[part][0]))
        profiles.append(np.interp(distances, travelled, sign * friction[part]))
    return float(np.mean(profiles, axis=0).max() / sliding - 1)


def read_loop(data: Path, seal: str, bar: int) -> Loop:
    """Friction of a seal at a pressure, from its file."""
    table = np.loadtxt(data / "friction" / f"{seal}_{bar}bar.csv", usecols=(0, 4, 5, 6))
    time, position, pressure, force = table.T
    return friction_loop(time * 1e-3, position * 1e-3, pressure * 1e5, force, SEALS[seal])


@dataclass(frozen=True, kw_only=True)
class Line:
    """Friction over pressure, with 95 % intervals."""

    constant: float
    """At no pressure [N]."""
    slope: float
    """Per pressure [N/bar]."""
    constant_half: float
    """Half its interval [N]; Student's, since four pressures scatter more than the cycles do."""
    slope_half: float
    """Half its interval [N/bar]."""


def line(pressures: Array, frictions: Array) -> Line:
    """Least squares."""
    design = np.column_stack([np.ones_like(pressures), pressures])
    constant, slope = np.linalg.lstsq(design, frictions, rcond=None)[0]
    freedom = len(pressures) - 2
    variance = np.sum((frictions - constant - slope * pressures) ** 2) / freedom
    halves = stats.t.ppf(0.975, freedom) * np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))
    return Line(constant=constant, slope=slope, constant_half=halves[0], slope_half=halves[1])


def interval(values: Array) -> tuple[float, float]:
    """95 % bootstrap interval of the mean."""
    found = stats.bootstrap(
        (values,), np.mean, n_resamples=1000, rng=np.random.default_rng(RNG_SEED), method="percentile"
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


# Chambers: three laws of a leak, each a rate of pressure over pressure, at constant temperature.


def orifice_rate(pressure: Array, area: float) -> Array:
    """Fall of the pressure [Pa/s] through an orifice of effective area over volume [1/m]."""
    flux = [mass_flux(p, AMBIENT, RT**-0.5) for p in pressure]
    return area * RT * np.array(flux)


def laminar_rate(pressure: Array, conductance: float) -> Array:
    """Fall of the pressure [Pa/s] through a laminar leak [1/(Pa s)]."""
    return conductance * (pressure**2 - AMBIENT**2)


def porous_rate(pressure: Array, viscous: float, inertial: float) -> Array:
    """Fall m of the pressure [Pa/s] by Forchheimer's law viscous m + inertial m^2 = p^2 - p_env^2."""
    drop = pressure**2 - AMBIENT**2
    return 2 * drop / (viscous + np.sqrt(viscous**2 + 4 * inertial * drop))


LAWS: dict[str, tuple[Callable[..., Array], tuple[float, ...]]] = {
    "orifice": (orifice_rate, (2e-4,)),
    "laminar": (laminar_rate, (1e-7,)),
    "porous": (porous_rate, (5e6, 200.0)),
}
"""Rates by law, with what a fit starts from."""


@dataclass(frozen=True, kw_only=True)
class Decay:
    """A law fitted to a chamber's pressure."""

    sizes: tuple[float, ...]
    """The law's sizes, as in LAWS."""
    rms: float
    """Root mean square of the residual [Pa]."""
    pressure: Array
    """The fitted pressure [Pa]."""


def decay_over(time: Array, start: float, rate: Callable[[Array], Array]) -> Array:
    """Pressure [Pa] from a start: the equation separates, dt = -dp/rate, so no integrator is needed."""
    grid = AMBIENT + (start - AMBIENT) * np.geomspace(1, 1e-4, 600)
    inverse = 1 / rate(grid)
    elapsed = np.r_[0, np.cumsum(-np.diff(grid) * (inverse[1:] + inverse[:-1]) / 2)]
    return np.interp(time, elapsed, grid)


def fitted_decay(time: Array, pressure: Array, law: str) -> Decay:
    """Fit a law from the first reading on (absolute pressure)."""
    rate, guess = LAWS[law]

    def at(logs: Array) -> Array:
        *sizes, start = np.exp(logs)
        return decay_over(time, start, lambda p: rate(p, *sizes))

    begin = np.log([*guess, pressure[0]])
    fit = optimize.least_squares(lambda logs: (at(logs) - pressure) / 1e5, begin)
    rms = 1e5 * float(np.sqrt(np.mean(fit.fun**2)))
    return Decay(sizes=tuple(np.exp(fit.x[:-1]).tolist()), rms=rms, pressure=at(fit.x))


def read_chamber(data: Path, chamber: str) -> tuple[Array, Array]:
    """Time [s] and absolute pressure [Pa]."""
    rows = [row.split(";") for row in (data / "chambers" / f"{chamber}.csv").read_text().split()]
    # Times carry a dot for thousands too: 1.234.567 is 1234.567 ms, 5.000 is 5 ms.
    plain = [row[0].replace(".", "", max(row[0].count(".") - 1, 0)) for row in rows]
    gauge = np.array([row[2] for row in rows], float) * 1e5 - ZERO
    return np.array(plain, float) * 1e-3, gauge + AMBIENT


def released(time: Array, pressure: Array) -> tuple[Array, Array]:
    """A leaky chamber's record from the moment its supply is shut."""
    first = int(np.argmax(pressure < pressure[:20].mean() - 0.03e5))
    return time[first:] - time[first], pressure[first:]


def fall(time: Array, pressure: Array, start: float, end: float) -> float:
    """Mean fall of a tight chamber's pressure over a span of time, over the pressure [1/s]."""
    inside = (time >= start) & (time < end)
    return float(-np.polyfit(time[inside], pressure[inside], 1)[0] / pressure[inside].mean())


def settling(time: Array, pressure: Array) -> tuple[float, float]:
    """Size [Pa] and time constant [s] of what settles after filling, beside a steady fall."""

    def rest(lag: float) -> tuple[float, float]:
        terms = np.column_stack([np.ones_like(time), time, np.exp(-time / lag)])
        found, left = np.linalg.lstsq(terms, pressure, rcond=None)[:2]
        return float(found[2]), float(left[0])

    lags = np.geomspace(1, LONGEST_SETTLING, 80).tolist()
    best = min(lags, key=lambda lag: rest(lag)[1])
    return rest(best)[0], best


def effective_area(rate: Callable[..., Array], sizes: tuple[float, ...], pressure: float) -> float:
    """Area of the orifice through which as much flows at an absolute pressure, per litre [m^2]."""
    at = np.array([pressure])
    return 1e-3 * float((rate(at, *sizes) / orifice_rate(at, 1.0))[0])


# Solenoids: current over case temperature, inductance over frequency.


def temperature_slopes(data: Path, solenoid: str) -> Array:
    """Relative slope of the current, 9 of 10 ms on, over case temperature, by stroke [1/K]."""
    path = data / "solenoids" / f"SolPosMeas240805_{solenoid}.csv"
    table = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(0, 1, 2, 4))
    temperature, place, on, current = table[np.isfinite(table).all(axis=1)].T
    slopes = []
    for stroke in np.unique(place):
        chosen = (place == stroke) & np.isclose(on, 9)
        if len(np.unique(temperature[chosen])) > 2:
            slopes.append(np.polyfit(temperature[chosen], np.log(current[chosen]), 1)[0])
    return np.array(slopes)


@dataclass(frozen=True, kw_only=True)
class Inductor:
    """A coil as seen at its terminals."""

    inductance: float
    """Of the iron, at low frequency [H]."""
    eddy: float
    """Resistance of the iron's shorted turn in parallel [ohm]; its time constant [s] for diffusion."""
    leakage: float
    """Inductance in series, which the iron does not see [H]."""
    worst: float
    """Largest relative deviation [-]."""


def shorted_turn(frequency: Array, inductance: float, resistance: float, leakage: float) -> Array:
    """Im(Z)/w of L in parallel with a resistance, and a leakage inductance in series [H]."""
    return leakage + inductance / (1 + (2 * np.pi * frequency * inductance / resistance) ** 2)


def diffusion(frequency: Array, inductance: float, lag: float, leakage: float) -> Array:
    """The same for flux that diffuses into the iron: impedance as sqrt(w) above 1/lag [H]."""
    return leakage + np.real(inductance / np.sqrt(1 + 2j * np.pi * frequency * lag))


def fitted_inductor(
    frequency: Array, measured: Array, model: Callable[..., Array], second: float, leaks: bool = True
) -> Inductor:
    """Fit in relative deviations; `second`: where the model's second size starts."""

    def sizes(logs: Array) -> Array:
        return np.exp(logs) if leaks else np.r_[np.exp(logs), 0.0]

    start = np.log([measured[0], second, *([measured[-1]] if leaks else [])])
    fit = optimize.least_squares(lambda q: np.log(model(frequency, *sizes(q)) / measured), start)
    inductance, eddy, leakage = sizes(fit.x).tolist()
    worst = float(np.max(np.abs(np.expm1(fit.fun))))
    return Inductor(inductance=inductance, eddy=eddy, leakage=leakage, worst=worst)


# What is found, said and drawn.


@dataclass(frozen=True, kw_only=True)
class Findings:
    """All figures of the page."""

    loops: dict[tuple[str, int], Loop]
    """By seal and gauge pressure [bar]."""
    lines: dict[str, Line]
    """By seal."""
    records: dict[str, tuple[Array, Array]]
    """Leaky chambers' times [s] and absolute pressures [Pa]."""
    decays: dict[tuple[str, str], Decay]
    """By leaky chamber and law."""
    falls: dict[str, tuple[float, float]]
    """Tight chambers' relative falls in the first 15 s and after 75 s [1/s]."""
    settlings: dict[str, tuple[float, float]]
    """What settles in them: size [Pa] and time constant [s]."""
    slopes: dict[str, Array]
    """By solenoid [1/K]."""
    turns: dict[str, Inductor]
    """Shorted turn, by plunger position."""
    diffusions: dict[str, Inductor]
    """Diffusion, likewise."""
    bare: dict[str, Inductor]
    """Shorted turn without leakage, 0.1-10 kHz, likewise."""


def seal_line(loops: dict[tuple[str, int], Loop], seal: str) -> Line:
    """Sliding friction of a seal over pressure."""
    steady = [bar for bar in PRESSURES if (seal, bar) != UNSTEADY]
    return line(np.array(steady, float), np.array([loops[seal, bar].mean for bar in steady]))


def found_in(data: Path) -> Findings:
    """Compute all figures from the folder."""
    missing = [name for name in ("friction", "chambers", "solenoids") if not (data / name).is_dir()]
    if missing:
        raise FileNotFoundError(f"{data} has no folder {missing[0]}: give --data the measured data")
    loops = {(seal, bar): read_loop(data, seal, bar) for seal in SEALS for bar in PRESSURES}
    records = {chamber: released(*read_chamber(data, chamber)) for chamber in LEAKY}
    tight = {chamber: read_chamber(data, chamber) for chamber in TIGHT}
    coils = INDUCTANCES.items()
    return Findings(
        loops=loops,
        lines={seal: seal_line(loops, seal) for seal in SEALS},
        records=records,
        decays={(name, law): fitted_decay(*records[name], law) for name in LEAKY for law in LAWS},
        falls={name: (fall(*record, 0, 15), fall(*record, 75, 150)) for name, record in tight.items()},
        settlings={name: settling(*record) for name, record in tight.items()},
        slopes={name: temperature_slopes(data, name) for name in THREE_TEMPERATURES},
        turns={name: fitted_inductor(FREQUENCIES, coil, shorted_turn, 250.0) for name, coil in coils},
        diffusions={name: fitted_inductor(FREQUENCIES, coil, diffusion, 1e-3) for name, coil in coils},
        bare={
            name: fitted_inductor(FREQUENCIES[:3], coil[:3], shorted_turn, 250.0, leaks=False)
            for name, coil in coils
        },
    )


def friction_table(found: Findings) -> list[str]:
    """Lines of the table."""
    rows = [
        "seal, bar         friction [N]         not corrected  speeds [mm/s]  S at rest  S at reversal"
    ]
    for (seal, bar), loop in found.loops.items():
        low, high = interval(loop.halves)
        fast = " ".join(f"{1e3 * speed:.1f}" for speed in loop.speeds)
        bound = "" if loop.first_peaked or np.isnan(loop.first_excess) else ">"
        rows.append(
            f"{seal:10} {bar}   {loop.mean:6.2f} ({low:.2f} to {high:.2f})  {loop.raw:9.2f}"
            f"      {fast:>10}  {bound:>4}{loop.first_excess:5.2f}  {loop.reversal_excess:9.2f}"
        )
    for seal, fit in found.lines.items():
        constant = f"{fit.constant:.1f} ± {fit.constant_half:.1f} N"
        rows.append(f"{seal}: {constant} + ({fit.slope:.2f} ± {fit.slope_half:.2f}) N/bar")
    return rows


def chamber_table(found: Findings) -> list[str]:
    """Lines of the table."""
    rows = [
        "chamber        law      rms [bar]  effective area per litre [m^2] at 8, 4, 1.5 bar absolute"
    ]
    for (chamber, law), fit in found.decays.items():
        areas = [effective_area(LAWS[law][0], fit.sizes, bar * 1e5) for bar in (8, 4, 1.5)]
        rows.append(
            f"{chamber:14} {law:8} {fit.rms * 1e-5:8.3f}   " + " ".join(f"{a:.1e}" for a in areas)
        )
    rows.append("chamber        fall in 0-15 s, after 75 s [1e-6/s]  area per litre [m^2]  settles")
    choked = float(orifice_rate(np.array([8e5]), 1.0)[0]) / 8e5
    for chamber, (early, late) in found.falls.items():
        size, lag = found.settlings[chamber]
        falls = f"{1e6 * early:8.0f} {1e6 * late:8.0f}   {late / choked * 1e-3:.1e}"
        # A time constant on its bound is the bend of a slow creep, not a settling.
        told = f"{size * 1e-2:.0f} mbar in {lag:.0f} s" if lag < 0.9 * LONGEST_SETTLING else "not told"
        rows.append(f"{chamber:14} {falls}   {told}")
    return rows


def solenoid_table(found: Findings) -> list[str]:
    """Lines of the table."""
    copper = COPPER / (1 + COPPER * 10)
    rows = [f"current over case temperature [%/K]; copper at 30 degrees: {-100 * copper:.3f}"]
    for name, slopes in found.slopes.items():
        low, middle, high = 100 * np.quantile(slopes, [0, 0.5, 1])
        rows.append(f"{name:12} {middle:.3f} ({low:.3f} to {high:.3f} over the stroke)")
    for name, coil in found.turns.items():
        other = found.diffusions[name]
        rows.append(
            f"{name:12} L {1e3 * coil.inductance:.1f} mH, R_e {coil.eddy:.0f} ohm, leakage"
            f" {1e3 * coil.leakage:.2f} mH: within {100 * coil.worst:.1f} %;"
            f" diffusion within {100 * other.worst:.0f} %,"
            f" without leakage within {100 * found.bare[name].worst:.0f} %"
        )
    scale = OUR_INDUCTANCE / found.turns["plunger in"].inductance
    eddy = scale * found.turns["plunger in"].eddy
    rows.append(f"the same iron behind our coil of {OUR_INDUCTANCE:.3f} H: R_e {eddy:.0f} ohm")
    return rows


def draw_friction(axes: Axes, found: Findings) -> None:
    """Friction over pressure; open marks: break-away from rest."""
    bars = np.array(PRESSURES)
    for number, seal in enumerate(SEALS):
        loops = [found.loops[seal, bar] for bar in PRESSURES]
        means = np.array([loop.mean for loop in loops])
        colour, fit = f"C{number}", found.lines[seal]
        axes.plot(
            bars, means, "o", color=colour, label=seal.replace("257", "").replace("Circle", "round")
        )
        axes.plot([0, 7.5], fit.constant + fit.slope * np.array([0, 7.5]), color=colour, lw=1)
        for bar, loop in zip(bars, loops, strict=True):
            mark = "^" if loop.first_peaked else r"$\uparrow$"
            height = loop.halves[0] * (1 + loop.first_excess)
            axes.plot(bar, height, ls="", marker=mark, mfc="none", mec=colour, ms=7)
    axes.plot([], [], ls="", marker="^", mfc="none", mec="0.3", label="break-away from rest")
    axes.plot([], [], ls="", marker=r"$\uparrow$", mfc="none", mec="0.3", label="the same, at least")
    axes.set(xlabel="gauge pressure [bar]", ylabel="friction [N]", xlim=(0, 7.6), ylim=(0, 38))
    axes.set_title("Seals")
    axes.legend(fontsize=8, loc="upper left")


def draw_chambers(axes: Axes, found: Findings) -> None:
    """Decay of the leaky chambers with the fitted laws."""
    styles = {"orifice": ":", "laminar": "--", "porous": "-"}
    for number, (chamber, (time, pressure)) in enumerate(found.records.items()):
        layer = chamber.removeprefix("Ultimaker_0")
        axes.plot(
            time[::12], (pressure[::12] - AMBIENT) * 1e-5, ".", ms=4, color=f"C{number}", alpha=0.5
        )
        axes.plot([], [], ".", color=f"C{number}", label=f"print, layers of 0.{layer} mm")
        for law, style in styles.items():
            fitted = (found.decays[chamber, law].pressure - AMBIENT) * 1e-5
            axes.plot(time, fitted, style, color="0.15", lw=1.1, label=law if number == 0 else None)
    axes.set(
        xlabel="time [s]", ylabel="gauge pressure [bar]", yscale="log", xlim=(0, 120), ylim=(0.02, 12)
    )
    axes.set_title("Leaky chambers")
    axes.legend(fontsize=8)


def draw_inductances(axes: Axes, found: Findings) -> None:
    """Inductance over frequency with both models."""
    frequency = np.geomspace(50, 2e5, 200)
    for number, (name, measured) in enumerate(INDUCTANCES.items()):
        turn, other = found.turns[name], found.diffusions[name]
        fits = (shorted_turn(frequency, turn.inductance, turn.eddy, turn.leakage),
                diffusion(frequency, other.inductance, other.eddy, other.leakage))  # fmt: skip
        label = f"{name}: {turn.eddy:.0f} ohm"
        axes.plot(FREQUENCIES, 1e3 * measured, "o", color=f"C{number}", label=label)
        axes.plot(frequency, 1e3 * fits[0], color=f"C{number}", lw=1.2)
        axes.plot(frequency, 1e3 * fits[1], "--", color=f"C{number}", lw=0.8)
    axes.plot([], [], color="0.3", label="shorted turn and leakage")
    axes.plot([], [], "--", color="0.3", lw=0.8, label="diffusion and leakage")
    axes.set(xlabel="frequency [Hz]", ylabel="inductance [mH]", xscale="log", yscale="log")
    axes.set_title("Solenoid")
    axes.legend(fontsize=8)


def drawn(found: Findings) -> Figure:
    """The page's figure."""
    figure = Figure(figsize=(13, 4), layout="constrained")
    seals, chambers, coils = figure.subplots(1, 3)
    draw_friction(seals, found)
    draw_chambers(chambers, found)
    draw_inductances(coils, found)
    for axes in (seals, chambers, coils):
        axes.grid(alpha=0.3)
    return figure


def main() -> int:
    """Compute, print and draw; returns the exit status."""
    parser = argparse.ArgumentParser(description="Draw the figure of docs/component-data.md.")
    parser.add_argument("--data", type=Path, required=True, help="folder of the measured data")
    parser.add_argument("--out", type=writable_folder, required=True, help="folder of the picture")
    chosen = parser.parse_args()
    found = found_in(chosen.data)
    print("\n".join([*friction_table(found), "", *chamber_table(found), "", *solenoid_table(found)]))
    chosen.out.mkdir(parents=True, exist_ok=True)
    drawn(found).savefig(chosen.out / "component-data.png", dpi=100, bbox_inches="tight")
    return 0


if __name__ == "__main__":
    sys.exit(fail_clearly(main))
