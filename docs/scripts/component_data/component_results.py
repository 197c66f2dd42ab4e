"""All figures of docs/results/component-data.md, computed from the folder of the measured data."""

from dataclasses import dataclass
from pathlib import Path

from docs.scripts.component_data.chambers import (
    LAWS,
    LEAKY_CHAMBERS,
    TIGHT_CHAMBERS,
    FittedDecay,
    after_release,
    fitted_decay,
    read_chamber,
    relative_decay_rate,
    settling,
)
from docs.scripts.component_data.column_files import Array
from docs.scripts.component_data.friction import (
    GAUGE_PRESSURES,
    SEAL_BORES,
    FrictionLine,
    FrictionLoop,
    read_loop,
    seal_line,
)
from docs.scripts.component_data.settings import DEFAULTS, ComponentSettings
from docs.scripts.component_data.solenoids import (
    FREQUENCIES,
    INDUCTANCES,
    MEASURED_SOLENOIDS,
    Inductor,
    diffusion_inductance,
    fitted_inductor,
    shorted_turn_inductance,
    temperature_slopes,
)


@dataclass(frozen=True, kw_only=True)
class ComponentResults:
    """All figures of docs/results/component-data.md."""

    loops: dict[tuple[str, int], FrictionLoop]
    """By seal and gauge pressure [bar]."""
    lines: dict[str, FrictionLine]
    """By seal."""
    records: dict[str, tuple[Array, Array]]
    """Leaky chambers' times [s] and absolute pressures [Pa], (samples,) each."""
    decays: dict[tuple[str, str], FittedDecay]
    """By leaky chamber and law."""
    decay_rates: dict[str, tuple[float, ...]]
    """Tight chambers' relative rates of decay, early and late [1/s]."""
    settlings: dict[str, tuple[float, float]]
    """Settling of the tight chambers: size [Pa] and time constant [s]."""
    slopes: dict[str, Array]
    """Relative slope of the current over temperature by solenoid [1/K], (strokes,)."""
    shorted_turns: dict[str, Inductor]
    """Fit of a shorted turn, by plunger position."""
    diffusions: dict[str, Inductor]
    """Fit of diffusion, by plunger position."""
    without_leakage: dict[str, Inductor]
    """Fit of a shorted turn without leakage at 0.1-10 kHz, by plunger position."""


def component_results(data: Path, settings: ComponentSettings = DEFAULTS) -> ComponentResults:
    """All figures from the folder of the measured data.

    Raises:
        FileNotFoundError: the folder or one of its folders is missing.
        ValueError: a file does not hold the published columns.
    """
    missing = [name for name in ("friction", "chambers", "solenoids") if not (data / name).is_dir()]
    if missing:
        raise FileNotFoundError(f"{data} has no folder {missing[0]}: give --data the measured data")
    spans = (settings.early_span, settings.late_span)
    loops = {
        (seal, bar): read_loop(data, seal, bar, settings)
        for seal in SEAL_BORES
        for bar in GAUGE_PRESSURES
    }
    leaky, tight = (
        {name: read_chamber(data, name, settings) for name in names}
        for names in (LEAKY_CHAMBERS, TIGHT_CHAMBERS)
    )
    records = {name: after_release(*record, settings) for name, record in leaky.items()}
    coils = INDUCTANCES.items()
    return ComponentResults(
        loops=loops,
        lines={seal: seal_line(loops, seal) for seal in SEAL_BORES},
        records=records,
        decays={
            (name, law): fitted_decay(*records[name], law) for name in LEAKY_CHAMBERS for law in LAWS
        },
        decay_rates={
            name: tuple(relative_decay_rate(*record, *span) for span in spans)
            for name, record in tight.items()
        },
        settlings={name: settling(*record, settings) for name, record in tight.items()},
        slopes={name: temperature_slopes(data, name, settings) for name in MEASURED_SOLENOIDS},
        shorted_turns={
            name: fitted_inductor(FREQUENCIES, coil, shorted_turn_inductance, 250.0)
            for name, coil in coils
        },
        diffusions={
            name: fitted_inductor(FREQUENCIES, coil, diffusion_inductance, 1e-3) for name, coil in coils
        },
        without_leakage={
            name: fitted_inductor(FREQUENCIES[:3], coil[:3], shorted_turn_inductance, 250.0, leaks=False)
            for name, coil in coils
        },
    )
