"""The catalogue of causes of a gap, with physical ranges and sizes to begin a search from."""

from collections.abc import Sequence

from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import table
from epv_env.plant.region import CALIBRATED_SYMBOLS
from identification.gap.model.cause import Cause
from identification.gap.model.free_parameter import FreeParameter, NuisanceParameter
from identification.valve_gap.settings import VALVE, ValveSettings

PARAMETER_COMPONENTS = {
    "cMV": "armature", "dMB": "solenoid", "mMV": "armature", "N": "solenoid", "xMV0": "armature",
    "xMVmax": "armature", "kMV": "armature", "dMVin": "control_chamber", "dMVexh": "control_chamber",
    "V3": "control_chamber", "cPV": "protection_valve", "d1": "protection_valve",
    "d2": "protection_valve", "mPV": "protection_valve", "xPV0": "protection_valve",
    "xPVmax": "protection_valve", "kPV": "protection_valve", "V2": "output_chamber",
}  # fmt: skip
"""Component of each parameter outside the four, all of Tables 6 and 7 but the cone model's."""


def catalogue(without: Sequence[str] = (), settings: ValveSettings = VALVE) -> tuple[Cause, ...]:
    """All causes but those named. Raises ValueError for a name that none has."""
    every = effects() + parameters(settings)
    unknown = set(without) - {cause.name for cause in every}
    if unknown:
        known = ", ".join(dict.fromkeys(cause.name for cause in every))
        raise ValueError(f"no cause is named {', '.join(sorted(unknown))}; known are {known}")
    return tuple(cause for cause in every if cause.name not in without)


def effects() -> list[Cause]:
    """Causes that are effects of the catalogue, a variant each."""
    return [
        Cause(
            name=effect.name,
            variant=variant,
            component=effect.component,
            parameters=tuple(effect_size(size) for size in sizes),
            run_parameters=tuple(_run_parameter(size) for size in effect.sizes if size.scatter),
            prior=1.0 / len(effect.fitted),
        )
        for effect in EFFECTS
        for variant, sizes in effect.fitted.items()
    ]


def parameters(settings: ValveSettings = VALVE) -> list[Cause]:
    """Causes `parameter:<symbol>`: a parameter outside the four off its table value."""
    return [
        Cause(
            name=f"parameter:{symbol}",
            words=f"another {symbol} ({table()[symbol].meaning})",
            component=component,
            parameters=(parameter_size(symbol, settings),),
            prior=settings.parameter_prior,
            exact_form=True,
        )
        for symbol, component in PARAMETER_COMPONENTS.items()
    ]


def effect_size(size: Size) -> FreeParameter:
    """A size of an effect as the diagnosis fits it."""
    row = table()[size.symbol]
    low, high = row.domain or (0.0, 0.0)
    return FreeParameter(
        symbol=size.symbol,
        unit=row.unit,
        low=max(low, low if size.least_fitted is None else size.least_fitted),
        high=high,
        trials=size.trials,
        scale=abs(size.trials[0]),
    )


def _run_parameter(size: Size) -> NuisanceParameter:
    """A size that every recording has its own of."""
    return NuisanceParameter(symbol=size.symbol, sd=size.scatter or 0.0, step=size.difference or 0.0)


def parameter_size(symbol: str, settings: ValveSettings = VALVE) -> FreeParameter:
    """A parameter that is not off by itself; its scale is its table value."""
    row = table()[symbol]
    low, high = row.domain or (row.value, row.value)
    return FreeParameter(
        symbol=symbol,
        unit=row.unit,
        low=max(low, row.value * (1 - settings.parameter_range)),
        high=min(high, row.value * (1 + settings.parameter_range)),
        nominal=row.value,
        trials=tuple(row.value * factor for factor in settings.parameter_trials),
        scale=row.value,
    )


def calibrated(start: dict[str, float]) -> list[FreeParameter]:
    """The four parameters that calibration fits, from `start`."""
    return [
        FreeParameter(
            symbol=symbol,
            unit=table()[symbol].unit,
            low=min(table()[symbol].domain or (0.0,)),
            high=max(table()[symbol].domain or (0.0,)),
            nominal=start[symbol],
            meaning=table()[symbol].meaning,
            scale=start[symbol],
        )
        for symbol in CALIBRATED_SYMBOLS
    ]
