"""A plant of plain differential equations obeys closed forms, compiled or not, and the protocol."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.diagnosis import diagnose
from identification.gap.fit.gaps import WHOLE
from identification.gap.plant import Cause, GreyBox, Run, window_forcing
from tests.identification.gap.ode_plants import decay, free, quiet_run


def worst(plant, k: float) -> float:
    y = plant.outputs({"k": np.array([k])}, [0])[0][0, :, 0]
    return float(np.max(np.abs(y - np.exp(-k * plant.runs[0].time))))


def test_a_decay_is_exponential_to_fourth_order():
    errors = [worst(decay(steps_per_sample=steps), 1.3) for steps in (2, 4, 8)]
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(16, rel=0.1)


def test_compiled_or_not_candidates_runs_and_delays_give_the_same():
    rng = np.random.default_rng(1)
    runs = [quiet_run(h, n, q=rng.standard_normal(n)) for h, n in ((0.5, 21), (0.5, 30), (0.2, 12))]
    given = {"delays": {"q": "late"}, "steps_per_sample": 3}
    values = {
        "k": np.array([0.5, 1.0, 2.0, -1e4]),
        "late": np.array([0.0, 0.3, 1.1, 0.0]),
        "zero": rng.standard_normal((4, 3)),
    }
    plant, reference = decay(runs, mode="compiled", **given), decay(runs, **given)
    for own, other in zip(
        plant.outputs(values, [2, 0, 1]), reference.outputs(values, [2, 0, 1]), strict=True
    ):
        assert np.std(other[..., :3]) > 0.1
        np.testing.assert_allclose(own[..., :3], other[..., :3], rtol=1e-9, atol=1e-12)
        assert np.isfinite(own[0, 0, 3])
        assert np.isnan(own[0, -1, 3])  # it blows up, and leaves the others


def test_a_held_input_acts_from_its_sample_on_and_later_by_its_delay():
    q = np.r_[np.zeros(4), np.ones(17)]
    values = {"k": np.zeros(3), "late": np.array([0.0, 0.5, 0.75])}
    y = decay([quiet_run(0.5, 21, q=q)], delays={"q": "late"}, steps_per_sample=2).outputs(values, [0])[
        0
    ]
    since = 0.5 * np.arange(21) - 2.0
    expected = 1.0 + np.maximum(since[:, None] - values["late"], 0.0)
    np.testing.assert_allclose(y[0], expected, atol=1e-12)


def test_a_forcing_is_a_change_of_the_rate():
    q = np.sin(np.arange(21.0))
    plant = decay([quiet_run(0.5, 21, q=q)], steps_per_sample=2)
    edges = np.array([0, 5, 11, 20])
    forcing = window_forcing(plant.equations[0], 21, edges)
    found = plant.forced({"k": np.array([0.7])}, 0, forcing)
    for w in range(3):
        pushed = q + 1e-3 * ((np.arange(21) >= edges[w]) & (np.arange(21) < edges[w + 1]))
        other = decay([quiet_run(0.5, 21, q=pushed)], steps_per_sample=2)
        change = [own.outputs({"k": np.array([0.7])}, [0])[0][0, :, 0] for own in (other, plant)]
        np.testing.assert_allclose(found[0, :, w], change[0] - change[1], atol=1e-14)
    assert np.max(np.abs(found)) > 1e-4


def test_sub_steps_are_halved_until_readings_settle():
    plant = decay([quiet_run(0.5, 21, q=np.zeros(21))])
    assert plant.steps_per_sample == 1 or worst(plant, 1.0) < 1e-3
    coarse, fine = (
        decay(steps_per_sample=steps).outputs({}, [0])[0]
        for steps in (plant.steps_per_sample, 8 * plant.steps_per_sample)
    )
    assert np.max(np.abs(coarse - fine)) < 0.1 * 1e-3


def test_states_and_inputs_are_traces_and_regimes_may_be_missing():
    plant: GreyBox = decay()
    traces = plant.states({}, 0)
    assert list(traces) == ["y", "q"]
    np.testing.assert_allclose(traces["y"].values, np.exp(-plant.runs[0].time), atol=1e-4)
    assert plant.regimes({}, 0) == {}
    high = decay(regimes=lambda x, u, p: {"high": x.y > p.k / 2}).regimes({}, 0)["high"]
    assert np.sum(high) == 2  # exp(-t) > 1/2 at 0 and 0.5 s


def noisy_runs() -> list[Run]:
    """Two recordings of a plant whose gain is 1.4."""
    rng, runs = np.random.default_rng(3), []
    for held_out in (False, True):
        q = np.repeat(rng.uniform(0.0, 2.0, 10), 12)
        run = quiet_run(0.2, len(q), q=q)
        y = decay([run], steps_per_sample=1).outputs({"gain": np.array([1.4])}, [0])[0][..., 0]
        measured = y + 1e-3 * rng.standard_normal(y.shape)
        name = "held out" if held_out else "fitted"
        runs.append(replace(run, name=name, measured=measured, held_out=held_out))
    return runs


def test_the_diagnosis_takes_the_plant():
    names = (("gain", "valve", 1.0, 2.0), ("leak", "tank", 0.0, 0.3))
    causes = [
        Cause(name=name, component=place, parameters=(free(name, off, (trial,)),))
        for name, place, off, trial in names
    ]

    def rate(x, u, p):
        return (-p.k * x.y + p.gain * u.q - p.leak,)

    found = diagnose(decay(noisy_runs(), mode="compiled", rate=rate, causes=causes, tolerances=()))
    assert found.conclusion.causes[0].effects == ("gain",)
    assert {gap.regime for gap in found.localisation.regime_gaps} == {WHOLE}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"rate": lambda x, u, p: -x.y}, "rate gives a number instead of results for 1 state"),
        ({"readings": lambda x, u, p: (x.y, x.y)}, "readings gives 2 results for 1 channel"),
        ({"start": lambda run, p: ()}, "start gives 0 results for 1 state"),
        ({"parameters": [free("parameter:k", 1.0)]}, "must be a Python name"),
        ({"parameters": [free("k", 1.0), free("gain", 3.0)]}, "nominal values 3 and 1"),
        ({"mode": "fast"}, "choose one of them"),
        ({"delays": {"x": "late"}}, "no pair of an input"),
        ({"runs": []}, "runs is empty"),
        ({"states": ("y", "y")}, "given twice"),
        ({"forcing_steps": {"z": 1.0}}, "forcing_steps has 'z'"),
        ({"runs": [quiet_run(0.5, 21, q=np.zeros(20))]}, r"input 'q' has the shape \(20,\)"),
        ({"rate": lambda x, u, p: (u.pump,)}, "'pump'.*u the inputs .*'t', 'q'"),
        ({"rate": lambda x, u, p: (-1e6 * x.y,)}, "the model is stiff"),
    ],
)
def test_a_wrong_description_is_refused_in_a_sentence(changes, sentence):
    with pytest.raises(ValueError, match=sentence):
        decay(**changes)


def test_a_function_that_numba_refuses_is_named():
    def unfit(x, u, p):
        return sorted(x, key=str)

    with pytest.raises(ValueError, match=r"compiled by numba \(No implementation of .* sorted"):
        decay(rate=unfit, mode="compiled")
