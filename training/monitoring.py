"""What a monitor has to know of a plant, by simulation of its openings with and without effects.

    python -m training.monitoring

makes the model of the report's valve anew, which is shipped.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.tuned import tuned
from epv_env.plant.effects.coil import COPPER
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import Parameters
from epv_env.plant.plantfile import Plant
from epv_env.plant.supply import Supply
from identification.monitor.features import OpeningReader
from identification.monitor.model import LINEAR, SHIPPED, MonitorModel, polynomial
from training.drives import drives

CONTROLLERS = ("hysteresis", "extrapolating hysteresis", "adaptive pulse")
"""Under which the openings are simulated: their conditions differ."""
VOLTAGES = (0.92, 0.945, 0.97, 1.0, 1.03, 1.055, 1.08)
"""Of the energised coil, as shares of the plant's."""
WARMEST = 45.0
"""Most that a winding is warmer than identified: it is a condition, and no change of the valve [K]."""
SUPPLY = (9.5, 13.5)
"""Range of a constant supply, under which every other drive is simulated [bar]."""
VALVES = 48
"""Unchanged valves; with fewer than two per feature their scatter is not known: false alarms."""
REPEATED = 6
"""Valves with each effect."""
MEDIUM = 1.5
"""Size of a medium effect, as a multiple of the catalogue's trial size."""
EXCESS = 1.5
"""Factor on the variance [-]: with 1, false alarms came about eight times as often as stated."""
LEAST_SHIFT = 0.75
"""Shift below which an effect cannot be told from the regression's own errors [standard deviations]."""
OUTLIER = 5.0
"""Standard deviations beyond which an opening does not count for the regression."""


@dataclass(frozen=True)
class Openings:
    """Openings of many valves, a row each."""

    conditions: NDArray
    features: NDArray
    valve: NDArray
    """Number of each one's valve."""
    drive: NDArray
    """Number of each one's drive."""

    def of(self, group: int) -> "Openings":
        """Those of the valves of one group of REPEATED."""
        own = self.valve // REPEATED == group
        return Openings(*(values[own] for values in vars(self).values()))


def openings(drive: NDArray) -> Iterator[tuple[NDArray, NDArray]]:
    """Conditions and features of each opening of a drive (periods, 6)."""
    reader = OpeningReader()
    for row in drive.tolist():
        found = reader.update(row)
        if found is not None:
            yield found


def monitor_model(plant: Plant, *, seed: int = 0, progress: Callable = print) -> MonitorModel:
    """The model of a monitor for a plant, from simulated drives of valves of its region."""
    rng = np.random.default_rng(seed)
    drawn = [plant.region.draw(rng) if plant.region.varies else plant.parameters for _ in range(VALVES)]
    nominal = _simulated(plant, drawn, range(VALVES), seed, VOLTAGES)
    progress(f"{len(nominal.valve)} openings of {VALVES} valves of the plant")
    model = _nominal_model(nominal)
    cases = list(_cases(plant.parameters))
    progress(f"{len(cases)} effects at medium size")
    affected = [plant.parameters, *(parameters for _, _, parameters in cases)]
    plants = [parameters for parameters in affected for _ in range(REPEATED)]
    found = _simulated(plant, plants, list(range(REPEATED)) * len(affected), seed + VALVES)
    base, *regressed = (_regressed(model, found.of(k)) for k in range(len(affected)))
    shifts = [each - base for each in regressed]
    for (_, label, _), shift in zip(cases, shifts, strict=True):
        progress(f"{label}: {np.linalg.norm(shift[:, 0]):.1f} standard deviations of one opening")
    seen = [k for k, shift in enumerate(shifts) if np.linalg.norm(shift[:, 0]) > LEAST_SHIFT]
    cases, shifts = [cases[k] for k in seen], [shifts[k] for k in seen]
    return MonitorModel(
        **vars(model)
        | {
            "effects": tuple(effect.name for effect, _, _ in cases),
            "components": tuple(effect.component for effect, _, _ in cases),
            "shifts": np.array(shifts),
        }
    )


def _cases(p: Parameters) -> Iterator[tuple]:
    """Effect, label and parameters of each variant, trial and sign at medium size."""
    for effect in EFFECTS:
        for fitted in effect.fitted.values():
            sizes = [size for size in fitted if size.trials]
            for k in range(max(len(size.trials) for size in sizes)):
                values = {
                    s.symbol: min(
                        s.trials[min(k, len(s.trials) - 1)] * MEDIUM, (s.domain or (0, 1e9))[1]
                    )
                    for s in sizes
                }
                signs = (1, -1) if sizes[0].either_sign and len(sizes[0].trials) == 1 else (1,)
                for sign in signs:
                    own = {s: sign * v for s, v in values.items()}
                    label = ", ".join(f"{s} = {v:g}" for s, v in own.items())
                    yield effect, f"{effect.name} {label}", p.replace(**own)


def _simulated(
    plant: Plant,
    plants: Sequence[Parameters],
    episodes: Sequence[int],
    seed: int,
    voltages: Sequence[float] = (1.0,),
) -> Openings:
    """Openings of valves with these parameters, each under every controller and voltage.

    episodes: number of each one's disturbance; seed: of all; voltages: shares of the plant's.
    """
    rows: list[tuple[NDArray, NDArray, int, int]] = []
    for number, (kind, voltage, supplied) in enumerate(product(CONTROLLERS, voltages, (False, True))):
        seeds = [(seed * 100 + number) * 1000 + episode for episode in episodes]
        drawn = [np.random.default_rng(own).random(2).tolist() for own in seeds]
        chosen: dict[str, Any] = {
            "parameters": [
                p.replace(R=p["R"] * (1.0 + COPPER * WARMEST * warmth))
                for p, (warmth, _) in zip(plants, drawn, strict=True)
            ]
        }
        if supplied:
            low, high = SUPPLY
            chosen["supply"] = [Supply.constant(low + share * (high - low)) for _, share in drawn]
        for valve, drive in enumerate(drives(plant, tuned(kind, plant), seeds, chosen, voltage=voltage)):
            rows += [(x, z, valve, number * len(plants) + valve) for x, z in openings(drive)]
    return Openings(*(np.array(column) for column in zip(*rows, strict=True)))


def _nominal_model(data: Openings) -> MonitorModel:
    """The regression, and coordinates in which openings and valves both scatter independently."""
    centre, scale = data.conditions.mean(axis=0), data.conditions.std(axis=0) + 1e-9
    x = polynomial(data.conditions, centre, scale)
    keep = np.ones(len(x), dtype=bool)
    for _ in range(2):
        _, _, _, within = _levels(x, data, keep)
        lower = np.linalg.cholesky(np.cov(within[keep].T))
        keep = np.all(np.abs(within @ np.linalg.inv(lower).T) < OUTLIER, axis=1)
    expected, means, count, within = _levels(x, data, keep)
    covariance = EXCESS * _long_run(within, data.drive)
    between = np.cov(means.T) - covariance / count
    lower = np.linalg.inv(np.linalg.cholesky(covariance))
    _, axes = np.linalg.eigh(lower @ between @ lower.T)
    whiten = axes.T @ lower
    return MonitorModel(
        centre=centre, scale=scale, whiten=whiten, expected=whiten @ expected.T,
        effects=(), components=(), shifts=np.empty((0, len(whiten), LINEAR)),
    )  # fmt: skip


def _long_run(within: NDArray, drive: NDArray) -> NDArray:
    """Covariance of the sum over a drive, for each opening: what a drive's openings share adds up.

    Outliers count: they come in operation, too.
    """
    sums = np.array([within[drive == number].sum(axis=0) for number in np.unique(drive)])
    return sums.T @ sums / len(within)


def _levels(x: NDArray, data: Openings, keep: NDArray) -> tuple[NDArray, NDArray, float, NDArray]:
    """Regression on x, mean departure of each valve, its openings on average, and what remains."""
    expected, *_ = np.linalg.lstsq(x[keep], data.features[keep], rcond=None)
    departure = data.features - x @ expected
    valves, counts = np.unique(data.valve[keep], return_counts=True)
    means = np.array([departure[keep & (data.valve == valve)].mean(axis=0) for valve in valves])
    count = float(1.0 / np.mean(1.0 / counts))
    return expected, means, count, departure - means[np.searchsorted(valves, data.valve)]


def _regressed(model: MonitorModel, data: Openings) -> NDArray:
    """Mean departures from the nominal plant by the linear terms, (features, LINEAR)."""
    x = polynomial(data.conditions, model.centre, model.scale)
    departure = data.features @ model.whiten.T - x @ model.expected.T
    departure = np.clip(departure, *np.percentile(departure, [1.0, 99.0], axis=0))
    return np.linalg.lstsq(x[:, :LINEAR], departure, rcond=None)[0].T


if __name__ == "__main__":
    monitor_model(Plant.calibrated()).save(SHIPPED)
