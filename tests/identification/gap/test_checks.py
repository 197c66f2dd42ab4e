"""Each mistake in the description of a plant is named, with the rule and the remedy."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from docs.examples.tank import Tank, virtual_recordings
from identification.gap.diagnosis import diagnose
from identification.gap.plant import (
    Cause,
    FreeParameter,
    GreyBox,
    PlantError,
    Run,
    StateEquation,
    StateTrace,
)
from identification.gap.plant_checks import check
from tests.identification.gap.tanks import TANKS


class Described(Tank):
    """A tank without a gap, whose description a test may spoil."""

    def __init__(self, **members: object):
        super().__init__(virtual_recordings({"c": 0.021}))
        for name, member in members.items():
            setattr(self, name, member)


def findings(plant: GreyBox) -> list[str]:
    """Lines of the error that a plant deserves."""
    with pytest.raises(PlantError) as caught:
        check(plant)
    return str(caught.value).split("\n")


def with_run(**changes: object) -> Tank:
    """A tank whose first recording is spoilt."""
    first, *others = Described().runs
    return Described(runs=(replace(first, **changes), *others))


def with_cause(**changes: object) -> Tank:
    """A tank whose first cause has a spoilt parameter."""
    first, *others = Described().causes
    spoilt = replace(first, parameters=(replace(first.parameters[0], **changes),))
    return Described(causes=(spoilt, *others))


def with_c(**changes: object) -> Tank:
    """A tank whose calibrated parameter is spoilt."""
    return Described(parameters=(replace(Described().parameters[0], **changes),))


def with_channel(**changes: object) -> Tank:
    """A tank whose channel is spoilt."""
    return Described(channels=(replace(Described().channels[0], **changes),))


def runs(held_out: bool) -> tuple[Run, ...]:
    """All recordings in the same role."""
    return tuple(replace(run, held_out=held_out) for run in Described().runs)


def untrusted() -> list[Run]:
    """Recordings whose readings do not count."""
    return [replace(run, trusted=np.zeros((1, 240), bool)) for run in runs(False)]


def with_reading(value: float, trusted: bool) -> Tank:
    """A tank with one odd reading."""
    plant = Described()
    plant.runs[1].measured[0, 7] = value
    plant.runs[1].trusted[0, 7] = trusted
    return plant


def equation(step: float) -> StateEquation:
    """The equation of the level."""
    return StateEquation(name="f1", state="h", component="tank", unit="m/s", step=step)


C, LEAK = Described().parameters[0], Described().causes[0]
TIME = 0.5 * np.arange(240)

MISTAKES: list[tuple[Callable[[], Tank], str]] = [
    (lambda: with_channel(noise=0.0), r"channels, h: noise 0 is not positive.*leave it out"),
    (lambda: Described(runs=(*runs(True), *runs(False))), "runs: two are named test_1.*rename"),
    (lambda: Described(runs=runs(False)), "runs: no run is held out.*held_out=True"),
    (lambda: with_run(time=TIME**1.1), "run test_1: time does not rise uniformly.*resample"),
    (lambda: with_run(time=TIME + 3.0 * (TIME >= 50.0)), "test_1: time jumps by 3.5 s at sample 100"),
    (lambda: with_run(measured=np.zeros(240)), r"run test_1: measured .* \(240,\), not .*1, 240"),
    (lambda: with_run(trusted=np.ones((1, 240))), "trusted is no boolean array: convert"),
    (lambda: Described(runs=untrusted()), "runs: no reading of the runs that are fitted is trusted"),
    (lambda: with_run(inputs={"q": np.zeros(3)}), r"test_1: input q has the shape \(3,\)"),
    (lambda: with_c(low=0.2), "parameters, c: low 0.2 and high 0.1 are no range"),
    (lambda: with_c(nominal=0.5), "parameters, c: nominal 0.5 lies outside 0.001 to 0.1"),
    (lambda: Described(parameters=(), causes=()), "parameters, causes: both are empty"),
    (lambda: with_cause(symbol="c"), "causes, leak: c is a parameter"),
    (lambda: Described(causes=(replace(LEAK, parameters=()),)), "causes, leak: it has no parameters"),
    (lambda: with_cause(trials=()), "causes, leak, leak: it has no trials"),
    (lambda: with_cause(trials=(9.0,)), "leak: trial 9 lies outside 0 to 0.05"),
    (lambda: Described(equations=(equation(-1.0),)), "equations, f1: step -1 is negative"),
]


@pytest.mark.parametrize(("make", "sentence"), MISTAKES, ids=[sentence for _, sentence in MISTAKES])
def test_a_mistake_is_named(make, sentence):
    with np.errstate(invalid="ignore", divide="ignore"):
        plant = make()
    with pytest.raises(PlantError, match=sentence):
        check(plant)


@pytest.mark.parametrize("verdict", TANKS)
def test_a_plant_in_order_is_not_blamed(verdict):
    assert check(TANKS[verdict]()) == []


def test_all_mistakes_are_told_at_once():
    plant = with_channel(noise=0.0)
    plant.parameters = (replace(C, scale=0.0),)
    assert [line.split(":")[0] for line in findings(plant)] == ["channels, h", "parameters, c"]


def test_what_is_allowed_is_not_blamed():
    variants = (replace(LEAK, variant="a"), replace(LEAK, variant="b"))
    unequal = FreeParameter(symbol="x", unit="", low=0.0, high=1.0, trials=(0.1, 0.2))
    both = Cause(name="leak too", component="tank", parameters=(unequal, replace(unequal, symbol="y")))
    for plant in (
        Described(causes=()),
        Described(causes=variants),
        Described(parameters=()),
        Described(equations=()),
        Described(runs=[replace(run, time=run.time - 40.0) for run in Described().runs]),
        with_channel(noise=None),
        with_reading(np.nan, False),
        with_reading(np.inf, False),
    ):
        assert check(plant) == []
    assert len(check(Described(causes=(LEAK, both)))) == 1


class Simulated(Described):
    """A tank whose simulator a test may spoil."""

    def __init__(self, change: Callable[[np.ndarray], np.ndarray]):
        super().__init__()
        self.change = change

    def outputs(self, values, runs):
        """The tank's outputs (1, samples, n), spoilt."""
        return [self.change(output) for output in super().outputs(values, runs)]


def mixed(output: np.ndarray) -> np.ndarray:
    """Every candidate is the mean of all."""
    return np.broadcast_to(np.mean(output, axis=2, keepdims=True), output.shape)


def scalar(output: np.ndarray) -> np.ndarray:
    """A simulator that was written for one candidate."""
    return output * float(output.shape[2] if output.shape[2] == 1 else np.array([1.0, 2.0]))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda y: y[0], r"outputs: .* \[\(240, 1\), .*, not .*\(1, 240, 1\)"),
        (lambda y: y * np.nan, "outputs: run test_1, channel h is not finite at sample 0"),
        (mixed, "outputs: run test_1 of the nominal candidate changes.*keep candidates apart"),
        (lambda y: y[..., :1], r"outputs: .* \[\(1, 240, 1\), .*, not .*\(1, 240, 2\)"),
        (scalar, "outputs: 2 candidates side by side end in TypeError"),
    ],
)
def test_a_simulator_that_cannot_be_used_is_named(change, sentence):
    with pytest.raises(PlantError, match=sentence):
        check(Simulated(change))


def test_a_cause_that_acts_at_its_nominal_value_is_named():
    class Leaking(Described):
        def outputs(self, values, runs):
            """A leak that the plant has where nobody speaks of it, and not where it is 0."""
            return super().outputs({"leak": np.full(1, 0.01), **values}, runs)

    with pytest.raises(PlantError, match="let no cause act at its nominal value"):
        check(Leaking())


@pytest.mark.parametrize(
    ("member", "sentence"),
    [
        ("states", r"states: h of run test_1 has the shape \(3,\), not \(samples,\) = \(240,\)"),
        ("regimes", r"regimes: late of run test_1 is not boolean"),
        ("forced", r"forced: equation f1 has the shape \(1, 240\), not \(1, 240, 2\)"),
    ],
)
def test_what_the_localisation_needs_has_its_shape(member, sentence):
    wrong = {
        "states": lambda values, run: {"h": StateTrace(unit="m", scale=1.0, values=np.zeros(3))},
        "regimes": lambda values, run: {"late": np.ones(240)},
        "forced": lambda values, run, forcing: np.zeros((1, 240)),
    }
    with pytest.raises(PlantError, match=sentence):
        check(Described(**{member: wrong[member]}))


def test_what_has_no_effect_is_a_warning():
    idle = FreeParameter(symbol="idle", unit="", low=0.0, high=1.0, nominal=0.5)
    cause = Cause(name="rust", component="tank", parameters=(replace(idle, symbol="r", trials=(1.0,)),))
    plant = Described(parameters=(C, idle), causes=(LEAK, cause))
    first, second = check(plant)
    assert first.startswith("parameters, idle has no effect on any trusted reading")
    assert second.startswith("causes, rust has no effect on any trusted reading")


def test_a_channel_that_shows_nothing_but_noise_is_a_warning():
    rng, plant = np.random.default_rng(0), Described()
    noise = plant.channels[0].known_noise

    def still(run: Run, of_noise: float) -> Run:
        return replace(run, measured=0.2 + of_noise * noise * rng.standard_normal(run.measured.shape))

    silent = Described(runs=[still(run, 1.0) for run in plant.runs])
    assert "shows nothing but noise about 200 mm" in " ".join(check(silent))
    assert not check(Described(runs=[still(run, 3.0) for run in plant.runs]))


def test_parameters_that_act_alike_are_a_warning():
    class Twice(Described):
        def outputs(self, values, runs):
            """The pipe's number is the product of two."""
            c = values.get("c", np.array([0.02])) * values.get("width", np.ones(1))
            return super().outputs({**values, "c": c}, runs)

    width = FreeParameter(symbol="width", unit="", low=0.5, high=1.5, nominal=1.0)
    (warning,) = check(Twice(parameters=(replace(C, low=0.015, high=0.025), width)))
    assert warning.startswith("parameters, c and parameters, width act alike on all runs")


def test_warnings_reach_the_diagnosis():
    idle = FreeParameter(symbol="idle", unit="", low=0.0, high=1.0, trials=(0.5,))
    plant = Described(causes=(LEAK, Cause(name="rust", component="tank", parameters=(idle,))))
    assert any("rust has no effect" in warning for warning in diagnose(plant).warnings)
