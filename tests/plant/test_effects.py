"""Every effect of the catalogue: off is nominal, on is felt; balances hold; closed forms come out."""

import numba
import numpy as np
import pytest
from scipy.integrate import quad

from epv_env.plant.coefficients import coefficients, effect_sizes, has_effects
from epv_env.plant.effects import CATALOGUE, Effects, saturated_force
from epv_env.plant.equations import (
    Coefficients,
    Inputs,
    State,
    armature_force,
    current_rate,
    reluctance_inverse,
)
from epv_env.plant.flow import CRITICAL_RATIO, mass_flux
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.simulate import energised, simulate
from epv_env.plant.valves import Valves
from tests.reference.schedule import largest_difference, pulses

CALIBRATED = Parameters.calibrated()
RATE = 2000.0


def sized(name: str, share: float) -> Parameters:
    """The calibrated plant with one effect at a share of its range's upper end."""
    ends = {symbol: table()[symbol].domain for symbol in CATALOGUE[name]}
    return CALIBRATED.replace(**{symbol: share * end[1] for symbol, end in ends.items() if end})


def two_openings(p: Parameters):
    U = np.full(1300, 24.0)
    U[100:280] = U[700:880] = 0.0
    return simulate(p, initial=energised(p, p1=12e5, p2=6.8e5, U=24.0), U=U, period=1 / RATE)


def difference(name: str, share: float) -> dict[str, float]:
    """Greatest change of each output by one effect, relative to the sensors' noise."""
    one, other = two_openings(CALIBRATED).state, two_openings(sized(name, share)).state
    noise = {"p2": 980.0, "p3": 750.0, "I": 8e-4}
    return {y: float(np.max(np.abs(getattr(one, y) - getattr(other, y)))) / s for y, s in noise.items()}


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_effect_fades_with_its_size(name):
    """A size of a millionth of its range is below the noise, a third of the range well above."""
    assert max(difference(name, 1e-6).values()) < 0.05
    # A rebound of the armature is over before a chamber feels much of it.
    assert max(difference(name, 0.33).values()) > (0.5 if name == "armature_bounce" else 5)


def test_sizes_of_zero_are_no_effects():
    assert not np.any(has_effects(effect_sizes(CALIBRATED)))
    for name in CATALOGUE:
        if name != "armature_bounce":  # acts where a stop is met, in both kernels
            assert np.all(has_effects(effect_sizes(sized(name, 0.1)))), name


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_kernel_agrees_with_scipy_on_every_effect(name):
    from identification.bench.automaton import simulate_reference

    p = sized(name, 0.3)
    schedule = pulses(p, opening=0.1, count=1, duration=0.3)
    time = np.arange(0.0, 0.3, 1 / RATE)
    reference = simulate_reference(schedule, time, rtol=1e-8)
    U = np.where((time >= 0.05 - 1e-9) & (time < 0.15 - 1e-9), 0.0, 24.0)
    run = simulate(p, initial=schedule.initial, U=U, period=1 / RATE)
    for output, allowed in {"p2": 20.0, "p3": 50.0, "I": 1e-4}.items():
        keep = reference.away_from_events(1e-3)
        found = largest_difference(getattr(run.state, output), getattr(reference.state, output), keep)
        assert found < allowed, output


def test_air_is_conserved_with_every_effect_on():
    p = CALIBRATED
    for name in CATALOGUE:
        p = p.replace(**{s: sized(name, 0.1)[s] for s in CATALOGUE[name]})
    valves = Valves(1)
    valves.set_parameters(np.arange(1), p, 0.02)
    for field, value in zip(valves.state, energised(p, p1=12e5, p2=6e5, U=24.0), strict=True):
        field[:] = value
    start = State(*(field.copy() for field in valves.state))
    U = np.where(np.arange(200) % 50 < 25, 0.0, 24.0)[:, None]
    end = valves.record(Inputs(U, *np.zeros((3, 200, 1))), 5e-3)
    RT = p["R_gas"] * p["T_env"]
    volume_3 = p["V3"] - p["sV3"] * np.pi / 4 * p["d1"] ** 2 * end.xPV
    in_3 = (end.p3 * volume_3 - start.p3 * p["V3"]) / RT
    in_2 = (end.p2 - start.p2) * p["V2"] / RT
    from_1 = (start.p1 - end.p1) * 0.02 / RT
    assert np.max(end.air_in_PV) > 1e-3
    np.testing.assert_allclose(in_2 + in_3, from_1 - end.air_vented, rtol=0, atol=1e-9)


@numba.njit
def _magnet(q, u, c, e):
    inverse_Rm = reluctance_inverse(q, c)
    return (
        current_rate(q, u, c, inverse_Rm, e, True),
        armature_force(q, c, inverse_Rm, e, True),
    )


def test_a_saturating_magnet_with_remanence_conserves_energy():
    """(I + I_rem) d(linkage)/dt = rate of the stored energy + mechanical power."""
    p = CALIBRATED.replace(sMV=1e4, I_rem=0.03)
    gap_reluctance = 1 / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2)

    def linkage(i, x):
        reluctance = p["RML"] + (p["xMVmax"] - x) * gap_reluctance
        return p["N"] ** 2 * i / (reluctance + p["N"] * p["sMV"] * i)

    def coenergy(i, x):
        return quad(linkage, 0.0, i, args=(x,), epsabs=1e-14)[0]

    x, v, current, U = 2e-4, 0.4, 0.35, 24.0
    q = State(*np.zeros(len(State._fields)))._replace(p1=1e5, p2=1e5, p3=1e5, xMV=x, vMV=v, I=current)
    c, e = Coefficients(*coefficients(p)[:, 0]), Effects(*effect_sizes(p)[:, 0])
    rate, net = _magnet(q, Inputs(U, 0.0, 0.0, 0.0), c, e)
    force = net + p["cMV"] * (x + p["xMV0"]) + p["kMV"] * v
    i, d = current + p["I_rem"], 1e-6
    assert force == pytest.approx((coenergy(i, x + d) - coenergy(i, x - d)) / (2 * d), rel=1e-6)
    linkage_rate = (linkage(i + d, x) - linkage(i - d, x)) / (2 * d) * rate
    linkage_rate += (linkage(i, x + d) - linkage(i, x - d)) / (2 * d) * v
    assert linkage_rate == pytest.approx(U - p["R"] * current, rel=1e-6)


def test_the_driver_s_drop_lowers_the_current():
    p = CALIBRATED.replace(U_drop=1.5)
    run = two_openings(p)
    assert run.state.I[-1] == pytest.approx((24.0 - 1.5) / p["R"], rel=1e-4)


def test_a_clamp_ends_the_current_sooner_and_never_reverses_it():
    """Low current, armature at rest: I = (I0 + Uc/R) exp(-t/tau) - Uc/R until it is used up."""
    p = CALIBRATED.replace(U_clamp=30.0)
    rest = energised(p, p1=12e5, p2=6e5, U=8.0)._replace(p3=p["p_env"], xMV=0.0)
    run = simulate(p, initial=rest, U=np.zeros(60), period=1e-4)
    inductance = p["N"] ** 2 / (p["RML"] + p["xMVmax"] / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2))
    asymptote, tau = 30.0 / p["R"], inductance / p["R"]
    expected = (8.0 / p["R"] + asymptote) * np.exp(-run.time / tau) - asymptote
    flowing = expected > 0.05  # below, the clamp's voltage fades within 10 mA
    assert np.sum(flowing) > 3
    np.testing.assert_allclose(run.state.I[flowing], expected[flowing], rtol=0, atol=5e-3)
    assert np.min(run.state.I) >= 0
    assert run.state.I[-1] < 1e-4


def test_a_leak_of_the_circuit_is_exponential_while_it_chokes():
    p = CALIBRATED.replace(A_circuit=2e-7)
    run = simulate(p, initial=energised(p, p1=9e5, p2=8e5, U=24.0), U=np.full(2000, 24.0), period=1e-3)
    RT = p["R_gas"] * p["T_env"]
    per_pressure = -float(mass_flux.py_func(1e5, 8e5, 1 / np.sqrt(RT))) / 8e5
    expected = 8e5 * np.exp(-RT / p["V2"] * 2e-7 * per_pressure * run.time)
    np.testing.assert_allclose(run.state.p2, expected, rtol=1e-6)


def test_orifices_choke_where_the_effect_says():
    """Against the ellipse of ISO 6358 with critical ratio b, which the stretched form resembles."""
    b = 0.3
    share = (1 - CRITICAL_RATIO) / (1 - b)
    flux = mass_flux.py_func
    choked = flux(1e6, 1e5, 1.0, share)
    for ratio in (0.05, 0.2, 0.299):
        assert flux(1e6, 1e6 * ratio, 1.0, share) == pytest.approx(choked)
    for ratio in (0.31, 0.5, 0.7, 0.9):
        ellipse = np.sqrt(1 - ((ratio - b) / (1 - b)) ** 2)
        assert flux(1e6, 1e6 * ratio, 1.0, share) / choked == pytest.approx(ellipse, abs=0.03)
    assert flux(1e6, 5.2e5, 1.0) == pytest.approx(choked)  # without the effect it chokes at 0.528


def test_friction_holds_a_piston_that_would_open():
    """Opening force 20 N: 15 N of friction let it move, 25 N do not."""
    back, seat = np.pi / 4 * CALIBRATED["d1"] ** 2, np.pi / 4 * CALIBRATED["d2"] ** 2
    p3 = 12e5 - (20.0 + (12e5 - 6e5) * seat + CALIBRATED["cPV"] * CALIBRATED["xPV0"]) / back
    for size, opens in ((15.0, True), (25.0, False)):
        p = CALIBRATED.replace(F_PV=size, V3=2e-5)
        start = energised(p, p1=12e5, p2=6e5, U=24.0)._replace(p3=p3)
        run = simulate(p, initial=start, U=np.full(4, 24.0), period=2.5e-4)
        assert (np.max(run.state.xPV) > 0) == opens


def test_the_swept_volume_raises_the_pressure_of_a_sealed_chamber():
    """p3 V3 stays constant: compared along a run with tiny seats of the magnet valve."""
    p = CALIBRATED.replace(sV3=1.0, alphaMV=0.5, dMVin=5e-4, dMVexh=5e-4)
    start = energised(p, p1=12e5, p2=6e5, U=24.0)._replace(p3=4e5)
    run = simulate(p, initial=start, U=np.full(20, 24.0), period=1e-4)
    volume = p["V3"] - np.pi / 4 * p["d1"] ** 2 * run.state.xPV
    held = run.state.p3 * volume / (p["R_gas"] * p["T_env"])
    gained = run.state.air_in_MV - run.state.air_vented
    np.testing.assert_allclose(held - held[0], gained, rtol=0, atol=1e-11)
    assert np.max(run.state.xPV) > 1e-3


@pytest.mark.parametrize("u", [0.0, 1e-6, 0.01, 0.3, 1.0, 3.0])
def test_the_saturated_force_is_the_coenergy_s(u):
    exact = (np.log1p(u) - u / (1 + u)) / u**2 if u > 1e-3 else 0.5 - 2 / 3 * u
    assert saturated_force.py_func(u) == pytest.approx(exact, abs=1e-5)
