"""A plant for the diagnosis from plain differential equations: x' = rate(x, u, p)."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epv_env.common.law_form import MOST_LAWS
from identification.gap.ode_integration import LAW_ROWS, TIME, Job, Records, settled_steps, simulator
from identification.gap.plant import (
    Cause,
    Channel,
    FreeParameter,
    NuisanceParameter,
    Run,
    StateEquation,
    StateTrace,
)
from identification.gap.prepare.noise import channel_noise


class OdePlant:
    """`GreyBox` for a user's functions of records: `x.v` a state, `u.force` an input, `p.mass` a symbol.

    Classical Runge-Kutta steps of fixed length; an input is held from its sample to the next one.
    A candidate whose states are no longer finite is NaN from there on.
    """

    def __init__(
        self,
        *,
        runs: Sequence[Run],
        channels: Sequence[Channel],
        states: Sequence[str],
        rate: Callable[[Any, Any, Any], Sequence[Any]],
        readings: Callable[[Any, Any, Any], Sequence[Any]],
        start: Callable[[Run, Any], Sequence[Any]],
        parameters: Sequence[FreeParameter],
        causes: Sequence[Cause],
        run_offsets: Sequence[NuisanceParameter] = (),
        tolerances: Sequence[NuisanceParameter] = (),
        components: Mapping[str, str] | None = None,
        units: Mapping[str, tuple[str, float]] | None = None,
        forcing_steps: Mapping[str, float] | None = None,
        regimes: Callable[[Any, Any, Any], Mapping[str, NDArray]] | None = None,
        delays: Mapping[str, str] | None = None,
        steps_per_sample: int | None = None,
        mode: str = "compiled",
    ):
        """Describe the plant.

        Args:
            runs: recordings, all with the same inputs.
            channels: what is measured, in the order of `readings`.
            states: names of the states.
            rate: (x, u, p) to the derivative of each state [SI/s], a tuple. `u.t` is the time [s].
            readings: (x, u, p) to the reading of each channel [SI], a tuple.
            start: (run, p) to the states at the first sample [SI], a tuple.
            parameters: what calibration fits.
            causes: what may be wrong with the model.
            run_offsets: nuisance parameters with a value per run.
            tolerances: nuisance parameters of the unit.
            components: component in which each state lies; None: each state is its own.
            units: unit and its size in SI, by state and input; left out: SI, without a name.
            forcing_steps: change of a rate [SI/s] with a small but clear effect, by state; a state
                that is left out lacks nothing (x' = v).
            regimes: (x, u, p) to boolean (samples,) by name, where x and u hold (samples,) arrays.
            delays: by input the symbol [s] by which it acts late.
            steps_per_sample: Runge-Kutta steps in a sampling period; None: halved until readings at
                the nominal values and at all trials settle.
            mode: "compiled": numba compiles all functions but `start` and `regimes`, in some seconds.
                "python": they run as they are, slowly.

        Raises:
            ValueError: for names, numbers of results, inputs or a mode that do not fit, and for a model
                that cannot be simulated at its nominal values.
        """
        self.runs, self.channels = tuple(runs), tuple(channels)
        inputs = _shared_inputs(self.runs)
        self.parameters, self.causes = tuple(parameters), tuple(causes)
        self.run_offsets, self.tolerances = tuple(run_offsets), tuple(tolerances)
        self.nominal = _nominal_values(parameters, causes, (*run_offsets, *tolerances))
        # All variants of a cause share its law.
        numbers = {name: n for n, name in enumerate(dict.fromkeys(c.name for c in self.causes), start=1)}
        owners = {p.symbol: numbers[cause.name] for cause in self.causes for p in cause.parameters}
        self._records = Records(
            states,
            inputs,
            tuple(self.nominal),
            [*self.nominal.values()],
            [owners.get(symbol, 0) for symbol in self.nominal],
        )
        self.law_arguments = tuple(states)
        self._start, self._regimes = start, regimes
        self._delays = dict(delays or {})
        self._units = dict.fromkeys((*states, *inputs), ("", 1.0)) | dict(units or {})
        self.equations = tuple(
            StateEquation(
                name=f"d{name}/dt",
                state=name,
                component=(components or {}).get(name, name),
                unit=f"{self._units[name][0] or '1'}/s",
                scale=self._units[name][1],
                step=(forcing_steps or {}).get(name, 0.0),
            )
            for name in self._records.states
        )
        self._check_names({"components": components, "forcing_steps": forcing_steps})
        self._check_results(rate, readings)
        functions = (rate, len(states)), (readings, len(channels))
        self._simulate = simulator(self._records, functions, mode)
        self.steps_per_sample = steps_per_sample or self._settled()

    def with_runs(self, runs: Sequence[Run]) -> "OdePlant":
        """The plant with other readings and inputs of its runs; nothing else of them changes."""
        other = copy(self)
        other.runs = tuple(runs)
        return other

    def outputs(self, values: Mapping[str, NDArray], runs: Sequence[int]) -> list[NDArray]:
        """`GreyBox.outputs`: per run (channels, samples, n) [SI]."""
        return [self._simulated(self._job(values, r))[0] for r in runs]

    def law_values(
        self, number: int, cause: Cause, argument: str, low: float, high: float, growth: NDArray
    ) -> dict[str, float]:
        """`GreyBox.law_values`; growth: (knots,)."""
        place = list(dict.fromkeys(own.name for own in self.causes)).index(cause.name) + 1
        every = (*self._records.states, *self._records.inputs)
        numbers = (place, every.index(argument) + 1, low, high, *growth)
        return {f"law {number}, {row}": float(value) for row, value in enumerate(numbers)}

    def states(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, StateTrace]:
        """`GreyBox.states`: states and inputs, values (samples,) [SI]."""
        x = self._simulated(self._job(_first(values), run))[1][..., 0]
        traces = dict(zip(self._records.states, x, strict=True)) | dict(self.runs[run].inputs)
        return {
            name: StateTrace(unit=self._units[name][0], scale=self._units[name][1], values=trace)
            for name, trace in traces.items()
        }

    def regimes(self, values: Mapping[str, NDArray], run: int) -> Mapping[str, NDArray]:
        """`GreyBox.regimes`: boolean (samples,) by name; values: (n,) or (n, runs) by symbol [SI]."""
        if self._regimes is None:
            return {}
        x = self._simulated(self._job(_first(values), run))[1][..., 0]
        own = self.runs[run]
        p = self._records.p(*self._parameters(_first(values), run)[: len(self.nominal), 0])
        return self._regimes(self._records.x(*x), self._records.u(own.time, *own.inputs.values()), p)

    def forced(self, values: Mapping[str, NDArray], run: int, forcing: Mapping[str, NDArray]) -> NDArray:
        """`GreyBox.forced`: changes (channels, samples, m) [SI]."""
        samples, m = next(iter(forcing.values())).shape
        push = np.zeros((samples, len(self._records.states), m + 1))
        for i, equation in enumerate(self.equations):
            if equation.name in forcing:
                push[:, i, 1:] = forcing[equation.name]
        copies = {symbol: np.repeat(v[:1], m + 1, axis=0) for symbol, v in values.items()}
        copies = copies or {symbol: np.full(m + 1, v) for symbol, v in self.nominal.items()}
        read = self._simulated(replace(self._job(copies, run), push=push))[0]
        return read[..., 1:] - read[..., :1]

    def _simulated(self, job: Job) -> tuple[NDArray, NDArray]:
        """Readings (channels, samples, n) and states (states, samples, n) [SI]."""
        with np.errstate(all="ignore"):
            return self._simulate(job)

    def _job(self, values: Mapping[str, NDArray], run: int, steps: int | None = None) -> Job:
        """A run to be simulated, without forcing."""
        p = self._parameters(values, run)
        n, own, names = p.shape[1], self.runs[run], self._records
        delays = np.zeros((len(names.inputs), n))
        for name, symbol in self._delays.items():
            delays[names.inputs.index(name)] = p[names.symbols.index(symbol)]
        return Job(
            start=np.array(
                [self._start(own, names.p(*each[: len(self.nominal)])) for each in p.T], dtype=float
            ).T.copy(),
            inputs=np.array([*own.inputs.values()], dtype=float).reshape(-1, len(own.time)).T.copy(),
            delays=delays,
            parameters=p,
            period=float(own.time[1] - own.time[0]),
            steps=steps or self.steps_per_sample,
            push=np.zeros((0, len(names.states), n)),
        )

    def _parameters(self, values: Mapping[str, NDArray], run: int) -> NDArray:
        """Values of all symbols in a run [SI] with the laws behind them, (symbols + laws, n)."""
        n = max((np.shape(v)[0] for v in values.values()), default=1)
        laws = [f"law {law}, {row}" for law in range(1, 1 + MOST_LAWS) for row in range(LAW_ROWS)]
        nominal = [*self.nominal.values(), *[0.0] * len(laws)]
        p = np.repeat(np.array(nominal, dtype=float)[:, None], n, axis=1)
        for i, symbol in enumerate((*self._records.symbols, *laws)):
            if symbol in values:
                given = np.asarray(values[symbol])
                p[i] = given[:, run] if given.ndim == 2 else given
        return p

    def _check_names(self, by_state: Mapping[str, Mapping[str, Any] | None]) -> None:
        """Raises ValueError for a name that is no state, no input or no symbol."""
        names = self._records
        for member, given in by_state.items():
            for name in {*(given or {})} - {*names.states}:
                raise ValueError(f"{member} has '{name}', which is none of the states {names.states}")
        for name, symbol in self._delays.items():
            if name not in names.inputs or symbol not in names.symbols:
                raise ValueError(
                    f"delays: '{name}': '{symbol}' is no pair of an input {names.inputs} and a symbol "
                    f"{names.symbols}: correct the names"
                )

    def _check_results(self, rate: Callable, readings: Callable) -> None:
        """Raises ValueError where a function has another number of results."""
        names, run = self._records, self.runs[0]
        p = names.p(*self.nominal.values())
        u = names.u(0.0, *(float(signal[0]) for signal in run.inputs.values()))
        try:
            begun = _counted("start", self._start(run, p), len(names.states), "state")
            x = names.x(*(float(value) for value in begun))
            _counted("rate", rate(x, u, p), len(names.states), "state")
            _counted("readings", readings(x, u, p), len(self.channels), "channel")
        except AttributeError as error:
            raise ValueError(
                f"OdePlant: a function asks for what is not there ({error}): x has the states "
                f"{names.states}, u the inputs {(TIME, *names.inputs)}, p the symbols {names.symbols}"
            ) from error

    def _settled(self) -> int:
        """Sub-steps whose halving changes no reading noticeably, nominal or at a trial of a cause."""
        trials = [
            {parameter.symbol: trial}
            for cause in self.causes
            for parameter in cause.parameters
            for trial in parameter.trials
        ]
        candidates = [self.nominal | changed for changed in [{}, *trials]]
        values = {symbol: np.array([own[symbol] for own in candidates]) for symbol in self.nominal}
        noise = np.array(
            [
                channel_noise(channel, [run.measured[c][run.trusted[c]] for run in self.runs])
                for c, channel in enumerate(self.channels)
            ]
        )[:, None, None]

        def read(steps: int) -> list[NDArray]:
            jobs = [self._job(values, r, steps) for r in range(len(self.runs))]
            return [self._simulated(job)[0] / noise for job in jobs]

        steps = settled_steps(read)
        if not all(np.all(np.isfinite(reading[..., 0])) for reading in read(steps)):
            raise ValueError(
                f"OdePlant: at the nominal values readings are not finite, with {steps} steps in a "
                "sampling period too: the model is stiff, or a value is wrong. Correct it, or wrap a "
                "stiff solver in a BlackBoxPlant"
            )
        return steps


def _first(values: Mapping[str, NDArray]) -> dict[str, NDArray]:
    return {symbol: np.asarray(v)[:1] for symbol, v in values.items()}


def _shared_inputs(runs: Sequence[Run]) -> tuple[str, ...]:
    """Names of the inputs. Raises ValueError where runs differ in them."""
    if not runs:
        raise ValueError("OdePlant.runs is empty: give at least one run to fit and one held out")
    wanted = tuple(runs[0].inputs)
    for run in runs:
        if tuple(run.inputs) != wanted:
            raise ValueError(
                f"run '{run.name}' has the inputs {tuple(run.inputs)}, '{runs[0].name}' has {wanted}: "
                "give every run the same inputs in the same order"
            )
        for name, signal in run.inputs.items():
            if np.shape(signal) != np.shape(run.time):
                raise ValueError(
                    f"run '{run.name}': input '{name}' has the shape {np.shape(signal)}, time has "
                    f"{np.shape(run.time)}: give one value per sample"
                )
    if TIME in wanted:
        raise ValueError(f"input '{TIME}' has the name of the time in seconds: rename the input")
    return wanted


def _nominal_values(
    parameters: Sequence[FreeParameter],
    causes: Sequence[Cause],
    nuisances: Sequence[NuisanceParameter],
) -> dict[str, float]:
    """Value of every symbol in the nominal model [SI]. Raises ValueError where two claims differ."""
    free = [*parameters, *(p for cause in causes for p in cause.parameters)]
    own = [*nuisances, *(p for cause in causes for p in cause.run_parameters)]
    values: dict[str, float] = {}
    for symbol, value in [*((p.symbol, p.nominal) for p in free), *((p.symbol, p.centre) for p in own)]:
        if values.setdefault(symbol, value) != value:
            raise ValueError(
                f"symbol '{symbol}' has the nominal values {values[symbol]:g} and {value:g}: give it "
                "one value, or two symbols"
            )
    return values


def _counted(name: str, results: Any, count: int, kind: str) -> Any:
    if not hasattr(results, "__len__") or len(results) != count:
        found = len(results) if hasattr(results, "__len__") else "a number instead of"
        raise ValueError(
            f"OdePlant: {name} gives {found} results for {count} {kind}(s): return a tuple with one "
            f"value per {kind}, as in `return (first,)`"
        )
    return results
