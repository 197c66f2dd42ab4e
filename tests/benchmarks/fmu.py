"""Rate of the plant's FMU against real time: processor time of its steps, called as an importer does.

python -m tests.benchmarks.fmu [--quick] [--json PATH]
"""

import tempfile
from pathlib import Path

from epv_env.plant.plantfile import Plant
from tests.benchmarks.command_line import run
from tests.benchmarks.measure import Table, durations, rates
from tests.training.fmu.unit import Instance, Unit
from training.deploy.fmu.files import fmu
from training.deploy.fmu.plant_model import plant_model

STEP = 5e-3
"""Communication step [s]."""
PLANTS: dict[str, dict[str, float]] = {
    "calibrated": {},
    "eddy current 4 mS": {"G_eddy": 4e-3},
    "output pipe": {"s_pipe": 0.4, "A_pipe": 2e-5},
    "piston friction 5 N": {"F_PV": 5.0},
    "armature friction 1 N": {"F_MV": 1.0},
    "piston friction 15 N, break-away excess 1": {"F_PV": 15.0, "S_PV": 1.0},
}
"""Sizes of effects by what they are."""


def braking(instance: Instance, sizes: dict[str, float], steps: int) -> None:
    """Reset, then hold p2 above 7.8 bar under intermittent consumption."""
    instance.call("Reset")
    instance.time = 0.0
    instance.start(sizes)
    (p2,) = instance.get("p2")
    for k in range(steps):
        instance.step(STEP, U=0.0 if p2 < 7.8e5 else 24.0, sigma_S=0.012 if k % 400 >= 200 else 0.0)
        (p2,) = instance.get("p2")


def benchmark(table: Table, quick: bool) -> None:
    """Add the rates of all plants to the table."""
    repetitions, steps = (2, 400) if quick else (5, 4000)
    table.section("FMU of the plant, communication steps of 5 ms, a hysteresis at 7.8 bar")
    with tempfile.TemporaryDirectory() as folder:
        unit = Unit(fmu(plant_model(Plant.calibrated()), "3.0", "cc"), Path(folder))
        for name, sizes in PLANTS.items():
            instance = Instance(unit)
            seconds = durations(lambda i=instance, p=sizes: braking(i, p, steps), repetitions)
            found = rates(steps * STEP, seconds)
            table.add(f"simulated time, {name}", "s per CPU s", found)


if __name__ == "__main__":
    run(__doc__, benchmark)
