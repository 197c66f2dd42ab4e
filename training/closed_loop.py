"""What a gap costs the controller of a log: its own figures as logged and as simulated in closed loop.

The controller runs each drive again on a simulated plant, with the logged target, supply and voltage.
Consumption is not logged: p2 gives it while the valve is shut, and it is smooth in between. A simulated
drive that is treated as a log, and simulated again, shows how exact that is.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve

from controllers.base import Controller
from epv_env.actions import OnOff
from epv_env.common.units import BAR, GRAM
from epv_env.plant.plantfile import Plant, load_plant
from epv_env.plant.primitives import mass_flux
from epv_env.plant.supply import Supply
from epv_env.reward import BAND_BAR
from epv_env.signals import MovingTarget, RecordedConsumption
from identification.gap.diagnosis import Diagnosis
from identification.recordings.log_files import Drive, Log, read_log
from identification.recordings.recording import rules_of
from identification.report.page import Section, Table, Verdict
from training.drives import check_can_log, drives
from training.evaluation.named import named_controllers

SETTLING = 0.5
"""Time of a drive after which p2 counts [s]."""
REPEATS = 6
"""Simulations of a drive, each with its own noise."""
OTHER_NOISE = 1_000_000
"""First seed of the noise of what is compared with simulations: a log has its own noise."""
DEVIATIONS = 3.0
"""Standard deviations of the method's own error above which a difference counts: of five figures one
would often pass two by chance."""
READING, BALANCE, CHANGE = 0.01 * BAR, 0.05 * GRAM, 2.0 * GRAM
"""Standard deviations: of p2's noise [Pa], of the shut circuit's balance [kg/s], and of the change of
consumption in a second [kg/s]."""
MOSTLY = 0.5
"""Share of a difference [1] below which the correction lacks something."""
ROUNDS = 3
"""In which consumption is found, since it is never negative."""
SURELY_SHUT = 0.5 * BAR
"""p3 above the pressure at which the valve opens from which it is surely shut [Pa]."""


INPUTS = ("scenario", "supply", "target_bar", "p2_bar", "p3_bar")
"""Options of a reset that a drive sets."""
SHORTEST = 2.0 * SETTLING
"""Drive that can be compared [s]."""


class Kind(NamedTuple):
    """One of the figures."""

    title: str
    unit: str
    format: str
    least: float
    """Difference that does not matter [unit]."""


KINDS = (
    Kind(f"p2 beyond ±{1e3 * BAND_BAR:g} mbar", "% of the time", ".1f", 0.2),
    Kind("deepest pressure dip", "mbar", ".0f", 20.0),
    Kind("highest overshoot", "mbar", ".0f", 20.0),
    Kind("rms of p2 - target", "mbar", ".0f", 5.0),
    Kind("switchings", "1/s", ".2f", 0.2),
)


def figures(log: Log) -> NDArray:
    """Of the readings, in the order of KINDS and their units, mean over the drives, (kinds,)."""
    return np.mean([_of_drive(drive, log.period) for drive in log.drives], axis=0)


def _of_drive(drive: Drive, period: float) -> NDArray:
    error = (1e3 * (drive.p2 - drive.target) / BAR)[round(SETTLING / period) :]
    outside = 100.0 * np.mean(np.abs(error) > 1e3 * BAND_BAR)
    switchings = np.count_nonzero(np.diff(drive.coil)) / (len(drive.coil) * period)
    return np.array([outside, -np.min(error), np.max(error), np.sqrt(np.mean(error**2)), switchings])


def consumption(drive: Drive, period: float, p: Mapping[str, float]) -> NDArray:
    """Air drawn from the circuit, (samples,) [kg/s]: least squares over p2 and a random walk.

    The circuit's balance counts while the valve is shut. p: of the plant; its leaks are no consumption,
    and what its sensor of p2 lags behind is undone.
    """
    n, shut = len(drive.p2), _shut(drive, p)
    storage = p["V2"] / (p["R_gas"] * p["T_env"])
    p2 = drive.p2 + p["tau_p2"] * np.gradient(drive.p2, period)
    reading = READING * (1.0 + p["tau_p2"] / period)
    one = sparse.csr_array(sparse.eye_array(n))
    step = one[1:] - one[:-1]
    rows = [
        [one / reading, None],
        [step[shut] * (storage / period / BALANCE), one[:-1][shut] / BALANCE],
        [None, step / (CHANGE * np.sqrt(period))],
    ]
    b = np.concatenate([p2 / reading, _leaking(drive, p)[:-1][shut] / BALANCE, np.zeros(n - 1)])
    a, at_zero, flow = sparse.bmat(rows, format="csr"), np.zeros(2 * n), np.empty(0)
    for _ in range(ROUNDS):  # hold at zero what would be negative, so that the air drawn stays right
        normal = a.T @ a + sparse.diags_array(at_zero / BALANCE**2)
        flow = np.asarray(spsolve(normal.tocsc(), a.T @ b))[n:]
        at_zero[n:] = np.maximum(at_zero[n:], 10.0 * (flow < 0.0))
    return np.maximum(flow, 0.0)


def _shut(drive: Drive, p: Mapping[str, float]) -> NDArray:
    """Whether p3 keeps the valve shut from before each sample to after the next; (samples - 1,)."""
    spring = p["cPV"] * p["xPV0"] / (np.pi / 4.0 * p["d1"] ** 2)
    opens = drive.p1 - (drive.p1 - drive.p2) * (p["d2"] / p["d1"]) ** 2 - spring  # eq. 22 at rest
    high = drive.p3 > opens + SURELY_SHUT
    return high[:-1] & high[1:] & np.append(False, high[:-2])


def _leaking(drive: Drive, p: Mapping[str, float]) -> NDArray:
    """Flow through the plant's leaks into the circuit while the valve is shut, (samples,) [kg/s]."""
    flux, inverse = np.vectorize(mass_flux), 1.0 / np.sqrt(p["R_gas"] * p["T_env"])
    into = p["A_PV"] * flux(drive.p1, drive.p2, inverse)
    return into - p["A_circuit"] * flux(drive.p2, p["p_env"], inverse)


def simulated(
    logs: Sequence[Log], plant: Plant, controller: Controller, first_seed: int = 0
) -> list[Log]:
    """Each log as the controller would have written it on a plant.

    The coil's voltage is the log's median. first_seed: of the sensors' noise. Raises ValueError for a
    drive that cannot begin in simulation.
    """
    logged = [drive for log in logs for drive in log.drives]
    period, count = logs[0].period, len(logs[0].drives)
    p = plant.parameters.replace(T_env=logs[0].temperature, p_env=logs[0].pressure)
    unique = {id(drive): drive for drive in logged}
    inputs = {key: _inputs(drive, period, p) for key, drive in unique.items()}
    options = {name: [inputs[id(drive)][name] for drive in logged] for name in INPUTS}
    on = np.concatenate([[plant.voltage], *(drive.U[drive.coil > 0] for drive in logged)])
    seeds = range(first_seed, first_seed + len(logged))
    read = drives(
        plant, controller, seeds, {"parameters": p, **options},
        voltage=float(np.median(on)) / plant.voltage,
        duration=max(len(drive.coil) for drive in logged) * period,
    )  # fmt: skip
    found = [_read(drive, rows) for drive, rows in zip(logged, read, strict=True)]
    return [replace(log, drives=tuple(found[k * count : (k + 1) * count])) for k, log in enumerate(logs)]


def _inputs(drive: Drive, period: float, p: Mapping[str, float]) -> dict[str, Any]:
    """What the drive was like, as INPUTS of a reset."""
    time = np.arange(len(drive.coil)) * period
    values = (
        RecordedConsumption(time=time, flow=consumption(drive, period, p)),
        Supply.recorded(time, drive.p1 / BAR),
        MovingTarget.recorded(time, drive.target / BAR),
        float(drive.p2[0] / BAR),
        float(drive.p3[0] / BAR),
    )
    return dict(zip(INPUTS, values, strict=True))


def _read(drive: Drive, rows: NDArray) -> Drive:
    """The drive with other readings, (samples at least, 6) of `training.drives.drives`."""
    coil, u, p1, p2, p3, current = rows[: len(drive.coil)].T
    return replace(drive, coil=coil, U=coil * u, p1=BAR * p1, p2=BAR * p2, p3=BAR * p3, I=current)


class Compared(NamedTuple):
    """Figures in the order of KINDS and their units, (kinds,); simulated ones are means of REPEATS."""

    logged: NDArray
    given: NDArray
    """On the plant as given."""
    corrected: NDArray
    """On the corrected plant."""
    tolerance: NDArray
    """Difference up to which logged and simulated figures may differ on the same plant."""

    @property
    def explained(self) -> NDArray:
        """Share of each difference that the correction removes [1], 0 for one that it widens; NaN where
        none is to be seen."""
        before, after = np.abs(self.logged - self.given), np.abs(self.logged - self.corrected)
        return np.maximum(1.0 - after / np.where(before > self.tolerance, before, np.nan), 0.0)


@dataclass
class ClosedLoop:
    """A log, the controller that wrote it, and the plant as given: for a section of the report."""

    log: Log
    given: Plant
    controller: Controller

    def __post_init__(self) -> None:
        """Simulate as given. Raises ValueError for another kind of controller, or as `simulated`."""
        check_can_log(self.controller)
        self.log.check_period(OnOff.default_period, f"{self.controller.name!r} decides each")
        for drive in self.log.drives:
            if len(drive.coil) * self.log.period < SHORTEST:
                raise ValueError(
                    f"{drive.file} is shorter than {SHORTEST:g} s: leave it out of log.json"
                )
        self.before = simulated([self.log] * REPEATS, self.given, self.controller)

    def compared(self, corrected: Plant, part: slice = slice(None)) -> Compared:
        """Against a corrected plant; a part of the drives counts."""
        after = simulated([self.log] * REPEATS, corrected, self.controller)
        again = simulated(after, corrected, self.controller, OTHER_NOISE)
        logged, before, each, repeated = (
            np.array([figures(replace(log, drives=log.drives[part])) for log in logs])
            for logs in ([self.log], self.before, after, again)
        )
        error = DEVIATIONS * np.sqrt(np.mean((repeated - each) ** 2, axis=0))
        tolerance = np.maximum(error, [kind.least for kind in KINDS])
        return Compared(logged[0], np.mean(before, axis=0), np.mean(each, axis=0), tolerance)

    def sections(self, found: Diagnosis, corrected: Plant) -> list[Section]:
        """One section: a sentence and a table, of the drives in which the causes act."""
        files = [drive.file for drive in self.log.drives]
        first = files.index(found.onset.drive) if found.onset else 0
        end = files.index(found.onset.mended) if found.onset and found.onset.mended else None
        result = self.compared(corrected, slice(first, end))
        name = f"with {found.model.title}" if found.model.labels else "recalibrated"
        caption = (
            f"Mean over {', '.join(files[first:end])}, after {SETTLING:g} s. Simulated: {REPEATS} runs "
            f"of {self.controller.name} in closed loop. Consumption is read off p2 while the valve is "
            f"shut. Own error: what this method may be off by ({DEVIATIONS:g} standard deviations), or "
            "what does not matter; a difference below it counts for nothing. An error that a sensor "
            "hides from the controller is not in its readings."
        )
        status, text = sentence(result, name)
        verdict = Verdict(status=status, text=text)
        table = _table(result, name, caption)
        return [Section(title="What it costs the controller", verdicts=[verdict], blocks=[table])]


def sections_about(
    folder: Path, plant: Path | None, controller: str
) -> Callable[[Diagnosis, Plant], list[Section]]:
    """What makes the section about the controller of a log; plant: file. Raises ValueError."""
    nominal = load_plant(plant)
    (found,) = named_controllers([controller], nominal)[0].values()
    return ClosedLoop(read_log(folder, rules_of(nominal)), nominal, found).sections


def sentence(result: Compared, name: str) -> tuple[str, str]:
    """Status for the page, and what the correction explains. name: of the corrected model."""
    shares = {k.title: s for k, s in zip(KINDS, result.explained, strict=True) if not np.isnan(s)}
    if not shares:
        return "good", "The plant as given shows the logged figures, as far as this method can tell."
    listed = ", ".join(f"{title} {100.0 * share:.0f} %" for title, share in shares.items())
    text = (
        "Simulated on the plant as given, the controller has other figures than logged. Of the "
        f"difference, the model {name} explains: {listed}."
    )
    if min(shares.values()) < MOSTLY:
        return "doubt", f"{text} The model still lacks something that the controller meets."
    return "good", text


def _table(result: Compared, name: str, caption: str) -> Table:
    rows = [
        [
            f"{kind.title} [{kind.unit}]",
            *(f"{value[k]:{kind.format}}" for value in result),
            "-" if np.isnan(result.explained[k]) else f"{100.0 * result.explained[k]:.0f} %",
        ]
        for k, kind in enumerate(KINDS)
    ]
    columns = ["Readings", "logged", "as given", name, "own error", "explained"]
    return Table(columns=columns, rows=rows, caption=caption)
