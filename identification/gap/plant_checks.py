"""What is wrong with the description of a plant, before a diagnosis begins: one sentence per fault."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from math import isfinite, isinf

import numpy as np
from numpy.typing import NDArray

from identification.gap.plant import (
    Cause,
    FreeParameter,
    GreyBox,
    PlantError,
    Run,
    window_forcing,
)
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.prepare.screened import sentences

UNEVEN_PERIOD = 0.01
"""Largest deviation from uniform sampling [sampling periods]: rounding of a logger's clock."""

SILENT, MOVING = 1.5, 10.0
"""Standard deviation of a silent channel's readings over that of their noise, and least one of the
nominal model's outputs there [1]."""


def check_description(plant: GreyBox) -> None:
    """Look for mistakes in the description of a plant and in the form of its recordings.

    Raises:
        PlantError: every finding is one line that names the member, the rule and the remedy.
    """
    _refuse([*_recording_faults(plant), *_number_faults(plant), *_symbol_faults(plant)])


def check(plant: GreyBox) -> list[str]:
    """Look for mistakes in the description of a plant, in its recordings and in its simulator.

    The nominal model is simulated on every run, alone and beside another candidate. Every parameter and
    cause is tried once, on as few runs as show its effect.

    Returns:
        Warnings, a sentence each: faulty readings, channels that show nothing but noise, parameters and
        causes without effect, parameters that act alike.

    Raises:
        PlantError: every finding is one line that names the member, the rule and the remedy.
    """
    check_description(plant)
    usable = prepared(plant)
    nominal = _simulated(usable, [{}])
    _refuse(_output_faults(usable, nominal))
    _refuse(_shape_faults(usable))
    return [*sentences(usable.screened), *_silent_channels(usable, nominal), *_effect_warnings(usable)]


def _refuse(faults: Iterable[str]) -> None:
    lines = list(faults)
    if lines:
        raise PlantError("\n".join(lines))


def _repeated(names: Iterable[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]


def _recording_faults(plant: GreyBox) -> Iterator[str]:
    if not plant.channels:
        yield "channels: there is none, but a gap is seen in measured outputs: give one or more"
    for name in _repeated(channel.name for channel in plant.channels):
        yield f"channels: two are named {name}, but results are listed by name: rename one"
    if len(plant.runs) < 2:
        yield (
            f"runs: there {'is one' if plant.runs else 'is none'}: give two or more, one of them with "
            "held_out=True; a single recording is cut in two"
        )
        return
    for name in _repeated(run.name for run in plant.runs):
        yield f"runs: two are named {name}, but results are listed by name: rename one"
    for held_out, word, use in ((True, "held out", "a gap is judged"), (False, "fitted", "a fit rests")):
        own = [run for run in plant.runs if run.held_out == held_out]
        if plant.runs and not own:
            yield f"runs: no run is {word}, but {use} on such runs: set held_out={held_out} in one"
        elif own and not any(np.any(run.trusted) for run in own):
            yield f"runs: no reading of the runs that are {word} is trusted: set it where they count"
    for run in plant.runs:
        yield from _run_faults(plant, run)


def _run_faults(plant: GreyBox, run: Run) -> Iterator[str]:
    member, samples = f"run {run.name}", len(run.time)
    if np.ndim(run.time) != 1 or samples < 3:
        shape = np.shape(run.time)
        yield f"{member}: time has the shape {shape}: record three samples or more, or leave the run out"
        return
    yield from (f"{member}: {fault}" for fault in _time_faults(run.time))
    expected = len(plant.channels), samples
    shapes = {"measured": np.shape(run.measured), "trusted": np.shape(run.trusted)}
    for name, shape in shapes.items():
        if shape != expected:
            yield f"{member}: {name} has the shape {shape}, not (channels, samples) = {expected}"
    if np.asarray(run.trusted).dtype != bool:
        yield f"{member}: trusted is no boolean array: convert it with astype(bool)"
    for name, signal in run.inputs.items():
        if np.shape(signal) != (samples,):
            yield f"{member}: input {name} has the shape {np.shape(signal)}, not ({samples},)"
        elif not np.all(np.isfinite(signal)):
            first = int(np.argmin(np.isfinite(signal)))
            yield f"{member}: input {name} is not finite at sample {first}: fill the gap or cut the run"


def _time_faults(time: NDArray) -> Iterator[str]:
    """Jumps of a clock that is uniform elsewhere, or a clock that is not."""
    uniform, mean = np.linspace(time[0], time[-1], len(time), retstep=True)
    steps = np.diff(time)
    usual = float(np.median(steps))
    jumps = np.flatnonzero(np.abs(steps - usual) > 2 * UNEVEN_PERIOD * usual) + 1
    if usual > 0 and 0 < len(jumps) < 0.1 * len(time):
        yield (
            f"time jumps by {steps[jumps[0] - 1]:g} s at sample {jumps[0]}, where the period is "
            f"{usual:g} s: cut the run there into two runs"
        )
    elif np.any(late := ~(np.abs(time - uniform) <= UNEVEN_PERIOD * mean)):
        yield f"time does not rise uniformly at sample {int(np.argmax(late))}: resample it"


def _number_faults(plant: GreyBox) -> Iterator[str]:
    """Numbers of channels, parameters, causes, nuisances and equations that no search can use."""
    for place, name, value in _positive_numbers(plant):
        if not (isfinite(value) and value > 0):
            yield f"{place}: {name} {value:g} is not positive: correct it, or leave it out"
    for channel in plant.channels:
        if not (isfinite(channel.resolution) and channel.resolution >= 0):
            yield f"channels, {channel.name}: resolution {channel.resolution:g} is no step: give 0"
    for equation in plant.equations:
        if not (isfinite(equation.step) and equation.step >= 0):
            yield f"equations, {equation.name}: step {equation.step:g} is negative: give 0 or more"
    if not plant.parameters and not plant.causes:
        yield "parameters, causes: both are empty, so nothing can be fitted: give one parameter or cause"
    for p in plant.parameters:
        yield from _range_faults(f"parameters, {p.symbol}", p, "nominal", [p.nominal])
    for cause in plant.causes:
        if not cause.parameters:
            yield f"causes, {cause.label}: it has no parameters, so nothing can be fitted: give a size"
        for p in cause.parameters:
            place = f"causes, {cause.label}, {p.symbol}"
            yield from _range_faults(place, p, "trial", p.trials)
            if not p.trials and isinf(p.sd):
                yield f"{place}: it has no trials, but the search begins there: give one value or more"
            if p.nominal in p.trials:
                yield f"{place}: trial {p.nominal:g} is the nominal value, where no cause acts"


def _positive_numbers(plant: GreyBox) -> Iterator[tuple[str, str, float]]:
    """Where it stands, its name, and its value."""
    for channel in plant.channels:
        yield f"channels, {channel.name}", "scale", channel.scale
        if channel.noise is not None:
            yield f"channels, {channel.name}", "noise", channel.noise
    for p in plant.parameters:
        yield f"parameters, {p.symbol}", "scale", p.scale
    for cause in plant.causes:
        yield f"causes, {cause.label}", "prior", cause.prior
        yield from ((f"causes, {cause.label}, {p.symbol}", "scale", p.scale) for p in cause.parameters)
    nuisances = {"tolerances": plant.tolerances, "run_offsets": plant.run_offsets}
    nuisances |= {f"causes, {cause.label}": cause.run_parameters for cause in plant.causes}
    for member, own in nuisances.items():
        for nuisance in own:
            yield f"{member}, {nuisance.symbol}", "sd", nuisance.sd
            yield f"{member}, {nuisance.symbol}", "step", nuisance.step


def _range_faults(place: str, p: FreeParameter, name: str, starts: Sequence[float]) -> Iterator[str]:
    if not (isfinite(p.low) and isfinite(p.high) and p.low < p.high):
        yield f"{place}: low {p.low:g} and high {p.high:g} are no range: give low below high"
    for value in starts:
        if not p.low <= value <= p.high:
            yield f"{place}: {name} {value:g} lies outside {p.low:g} to {p.high:g}: widen the range"


def _symbol_faults(plant: GreyBox) -> Iterator[str]:
    """Symbols with two meanings; a cause may shift a tolerance, variants of a cause share symbols."""
    calibrated = [p.symbol for p in plant.parameters]
    offsets = [n.symbol for n in plant.run_offsets]
    tolerances = [n.symbol for n in plant.tolerances]
    members = {"parameters": calibrated, "tolerances": tolerances, "run_offsets": offsets}
    members |= {"causes": [cause.label for cause in plant.causes]}
    members |= {f"causes, {cause.label}": _symbols(cause) for cause in plant.causes}
    for member, symbols in members.items():
        for symbol in _repeated(symbols):
            yield f"{member}: two are named {symbol}: rename one"
    for one, other in combinations(("parameters", "tolerances", "run_offsets"), 2):
        for symbol in sorted({*members[one]} & {*members[other]}):
            yield f"{other}, {symbol}: it is one of `{one}` as well: strike one of them"
    for cause in plant.causes:
        for symbol in sorted({*_symbols(cause)} & {*calibrated, *offsets}):
            yield f"causes, {cause.label}: {symbol} is a parameter or run offset too: rename one"
    for one, other in combinations(plant.causes, 2):
        for symbol in sorted({*_symbols(one)} & {*_symbols(other)} if one.name != other.name else ()):
            yield f"causes, {one.label} and {other.label}: both have {symbol}: rename one"


def _symbols(cause: Cause) -> list[str]:
    return [parameter.symbol for parameter in (*cause.parameters, *cause.run_parameters)]


def _trials(plant: GreyBox) -> dict[str, dict[str, float]]:
    """Values [SI] by symbol of a candidate off nominal, by the parameter or cause that it tries."""
    found = {}
    for p in plant.parameters:
        step = 0.05 * (p.high - p.low)  # far beyond rounding, and the model can still be simulated
        value = p.nominal + (step if p.nominal + step <= p.high else -step)
        found[f"parameters, {p.symbol}"] = {p.symbol: value}
    for cause in plant.causes:
        found[f"causes, {cause.label}"] = {p.symbol: p.trials[0] for p in cause.sizes}
    return found


def _side_by_side(
    plant: GreyBox, changes: Sequence[Mapping[str, float]], *, all_symbols: bool = False
) -> dict[str, NDArray]:
    """Values (n,) [SI] by symbol of n candidates, of each of which `changes` is not nominal.

    all_symbols: whether causes that do not act are given with their nominal values, or left out.
    """
    sizes = [p for cause in plant.causes for p in cause.parameters]
    nominal = {p.symbol: p.nominal for p in (*sizes, *plant.parameters)}
    # A plant without calibrated parameters still has to see how many candidates there are.
    used = nominal if all_symbols else [p.symbol for p in plant.parameters or sizes]
    symbols = dict.fromkeys([*used, *(symbol for own in changes for symbol in own)])
    return {s: np.array([own.get(s, nominal[s]) for own in changes], dtype=float) for s in symbols}


def _simulated(plant: GreyBox, changes: Sequence[Mapping[str, float]]) -> list[NDArray]:
    """Outputs of all runs for candidates that differ from the nominal one, of the right shapes."""
    n = len(changes)
    try:
        values = _side_by_side(plant, changes, all_symbols=n > 1)
        outputs = plant.outputs(values, list(range(len(plant.runs))))
    except Exception as error:
        raise PlantError(
            f"outputs: {n} candidates side by side end in {type(error).__name__}: {error}: every value "
            f"is an array ({n},), and a symbol that is left out has its nominal value"
        ) from error
    found = [np.shape(output) for output in outputs]
    expected = [(len(plant.channels), len(run.time), n) for run in plant.runs]
    if found != expected:
        raise PlantError(
            f"outputs: the arrays have the shapes {found}, not (channels, samples, n) of each run, "
            f"{expected}: return one array per run with those axes"
        )
    return outputs


def _output_faults(plant: GreyBox, nominal: Sequence[NDArray]) -> Iterator[str]:
    """Runs that the nominal candidate cannot simulate, or that depend on the candidate beside it.

    nominal: its outputs alone, a run each.
    """
    beside = _simulated(plant, [{}, next(iter(_trials(plant).values()))])
    for run, one, two in zip(plant.runs, nominal, beside, strict=True):
        wrong = np.argwhere(run.trusted & ~np.isfinite(one[..., 0]))
        error = np.abs(two[..., 0] - one[..., 0]) / _magnitudes(one)[:, None]
        if len(wrong):
            channel, sample = plant.channels[wrong[0, 0]].name, wrong[0, 1]
            yield (
                f"outputs: run {run.name}, channel {channel} is not finite at sample {sample} at the "
                "nominal values: correct the model or the values, or leave the run out"
            )
        # A solver whose steps candidates share differs by less, mixed-up candidates by more.
        elif np.any(run.trusted & ~(error <= 1e-3)):
            yield (
                f"outputs: run {run.name} of the nominal candidate changes beside another one: keep "
                "candidates apart along the last axis, and let no cause act at its nominal value"
            )


def _shape_faults(plant: GreyBox) -> Iterator[str]:
    """Shapes of states, regimes and forced outputs of the shortest run."""
    run = min(range(len(plant.runs)), key=lambda r: len(plant.runs[r].time))
    values, name, samples = _side_by_side(plant, [{}]), plant.runs[run].name, len(plant.runs[run].time)
    for state, trace in plant.states(values, run).items():
        if np.shape(trace.values) != (samples,):
            shape = np.shape(trace.values)
            yield f"states: {state} of run {name} has the shape {shape}, not (samples,) = {(samples,)}"
    for regime, mask in plant.regimes(values, run).items():
        if np.shape(mask) != (samples,) or np.asarray(mask).dtype != bool:
            yield f"regimes: {regime} of run {name} is not boolean (samples,) = {(samples,)}"
    edges = np.array([0, (samples - 1) // 2, samples - 1])
    expected = len(plant.channels), samples, len(edges) - 1
    for equation in (equation for equation in plant.equations if equation.step):
        forcing = window_forcing(equation, samples, edges)
        shape = np.shape(plant.forced(values, run, forcing))
        if shape != expected:
            yield f"forced: equation {equation.name} has the shape {shape}, not {expected}"


def _silent_channels(plant: GreyBox, nominal: Sequence[NDArray]) -> Iterator[str]:
    """Channels that show their noise about one value in all runs, although the nominal model moves.

    nominal: its outputs, a run each.
    """
    outputs = [run[..., 0] for run in nominal]
    readings = [run.measured for run in plant.runs]
    for c, channel in enumerate(plant.channels):
        measured, modelled = (
            np.concatenate([own[c, run.trusted[c]] for own, run in zip(values, plant.runs, strict=True)])
            for values in (readings, outputs)
        )
        noise = channel.known_noise
        if len(measured) and np.std(measured) < SILENT * noise and np.std(modelled) > MOVING * noise:
            value = np.mean(measured) / channel.scale
            yield (
                f"{channel.name} shows nothing but noise about {value:.4g} {channel.unit} in all "
                "recordings, where the model moves: its sensor is dead, or what it measures does not "
                "move; look before a cause is believed"
            )


def _magnitudes(outputs: NDArray) -> NDArray:
    """Largest magnitude of each channel of outputs (channels, samples, ...), (channels,); never 0."""
    largest = np.max(np.abs(np.nan_to_num(outputs)).reshape(len(outputs), -1), axis=1)
    return np.where(largest > 0, largest, 1.0)


def _effect_warnings(plant: GreyBox) -> list[str]:
    """What has no effect or acts alike; runs are simulated, the shortest first, while in doubt."""
    trials = _trials(plant)
    members, calibrated = list(trials), np.arange(len(trials)) < len(plant.parameters)
    seen = np.zeros(len(trials), dtype=bool)
    gram = np.zeros((len(trials), len(trials)))
    doubtful, alike = np.arange(len(trials)), gram > 0
    for run in sorted(range(len(plant.runs)), key=lambda r: len(plant.runs[r].time)):
        changes = _changes(plant, [trials[members[i]] for i in doubtful], run)
        seen[doubtful] |= np.max(np.abs(changes), axis=0, initial=0.0) > 1e-9  # rounding
        gram[np.ix_(doubtful, doubtful)] += changes.T @ changes
        alike = _alike(gram, calibrated)
        doubtful = np.flatnonzero(~seen | np.any(alike, axis=1))
        if not len(doubtful):
            return []
    return [
        f"{members[i]} has no effect on any trusted reading: check that `outputs` uses it, or leave "
        "it out"
        for i in np.flatnonzero(~seen)
    ] + [
        f"{members[i]} and {members[j]} act alike on all runs, so that only one number can be told for "
        "both: fix one of them, or make it a tolerance"
        for i, j in np.argwhere(np.triu(alike))
    ]


def _changes(plant: GreyBox, tried: Sequence[Mapping[str, float]], run: int) -> NDArray:
    """Change of the trusted readings of a run by each trial, (values, trials) [channel magnitudes]."""
    outputs = np.asarray(plant.outputs(_side_by_side(plant, [{}, *tried]), [run])[0])
    shares = outputs / _magnitudes(outputs[..., :1])[:, None, None]
    # A candidate that cannot be simulated shows that the model uses its value.
    changes = np.nan_to_num(shares[..., 1:] - shares[..., :1], nan=1.0)
    return changes[plant.runs[run].trusted]


def _alike(gram: NDArray, calibrated: NDArray) -> NDArray:
    """Pairs of calibrated parameters whose changes correlate, boolean (trials, trials)."""
    size = np.sqrt(np.diag(gram))
    counts = calibrated & (size > 0)
    correlation = np.abs(gram) / np.maximum(np.outer(size, size), np.finfo(float).tiny)
    return np.outer(counts, counts) & ~np.eye(len(gram), dtype=bool) & (correlation > 0.999)
