"""All figures of docs/component-data.md, computed from the folder of the measured data."""

from dataclasses import dataclass
from pathlib import Path

from docs.component_data.chambers import (
    LAWS,
    LEAKY,
    TIGHT,
    Decay,
    fall,
    fitted_decay,
    read_chamber,
    released,
    settling,
)
from docs.component_data.files import Array
from docs.component_data.friction import PRESSURES, SEALS, Line, Loop, read_loop, seal_line
from docs.component_data.solenoids import (
    FREQUENCIES,
    INDUCTANCES,
    THREE_TEMPERATURES,
    Inductor,
    diffusion,
    fitted_inductor,
    shorted_turn,
    temperature_slopes,
)


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
