"""Every effect of the catalogue: off is nominal, on is felt; balances hold; closed forms come out."""

import numba
import numpy as np
import pytest
from scipy.integrate import quad, simpson, solve_ivp

from epv_env.common.law_form import KNOTS
from epv_env.plant.channels import readings
from epv_env.plant.coefficients import coefficients
from epv_env.plant.effects.chambers import chamber_rates
from epv_env.plant.effects.coil import COOLING_TIME, COPPER
from epv_env.plant.effects.flows import FILLING_TIME
from epv_env.plant.effects.law import placed
from epv_env.plant.effects.movers import STRIBECK_SPEED, stribeck
from epv_env.plant.effects.registry import CATALOGUE, PLACES, Effects, effect_constants, kernel_of
from epv_env.plant.equations import (
    Coefficients,
    Inputs,
    State,
    armature_force,
    current_rate,
    reluctance_inverse,
)
from epv_env.plant.parameters import Parameters, table
from epv_env.plant.primitives import CRITICAL_RATIO, KAPPA, mass_flux
from epv_env.plant.simulate import energised, simulate
from epv_env.plant.valves import Valves
from tests.reference.hybrid_automaton import delayed_schedule, edge_delays
from tests.reference.reference_simulation import simulate_reference
from tests.reference.schedule import away_from_events, largest_difference, pulses

CALIBRATED = Parameters.calibrated()
RT = CALIBRATED["R_gas"] * CALIBRATED["T_env"]
RATE = 2000.0
OUTSIDE = (
    "armature_bounce", "pressure_sensor_bias", "pressure_sensor_gain", "current_sensor_gain",
    "command_delay",
)  # fmt: skip
"""Effects that act outside of the equations: where a stop is met, before them, or behind them."""


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
    one, other = (readings(two_openings(p).state, p) for p in (CALIBRATED, sized(name, share)))
    noise = {"p2": 980.0, "p3": 750.0, "I": 8e-4}
    return {y: float(np.max(np.abs(one[y] - other[y]))) / s for y, s in noise.items()}


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_effect_fades_with_its_size(name):
    """A size of a millionth of its range is below the noise, a third of the range well above."""
    assert max(difference(name, 1e-6).values()) < 0.05
    # A rebound of the armature is over before a chamber feels much of it; a wide pipe is no pipe.
    felt = {"armature_bounce": 0.5, "output_pipe": 3}.get(name, 5)
    assert max(difference(name, 0.33).values()) > felt


def test_sizes_of_zero_are_no_effects():
    assert not np.any(kernel_of(effect_constants(CALIBRATED)))
    for name in CATALOGUE:
        if name not in OUTSIDE:
            assert np.all(kernel_of(effect_constants(sized(name, 0.1)))), name


def assert_scipy_agrees(p: Parameters) -> None:
    """The kernel's readings of one opening are those of the reference."""
    schedule = pulses(p, opening=0.1, count=1, duration=0.3)
    schedule = delayed_schedule(schedule, edge_delays(schedule))
    time = np.arange(0.0, 0.3, 1 / RATE)
    reference = simulate_reference(schedule, time, rtol=1e-8)
    U = np.where((time >= 0.05 - 1e-9) & (time < 0.15 - 1e-9), 0.0, 24.0)
    run = simulate(p, initial=schedule.initial, U=U, period=1 / RATE)
    expected, simulated = readings(reference.state, p), readings(run.state, p)
    # Eddy currents make the coil's current jump where U does: at that sample it has two values.
    keep = away_from_events(reference, 1e-3) & (np.diff(U, prepend=24.0, append=24.0)[:-1] == 0)
    for output, allowed in {"p2": 20.0, "p3": 50.0, "I": 1e-4}.items():
        found = largest_difference(simulated[output], expected[output], keep)
        assert found < allowed, output


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_kernel_agrees_with_scipy_on_every_effect(name):
    assert_scipy_agrees(sized(name, 0.3))


@pytest.mark.parametrize("slot", [1, 4], ids=["usual kernel", "kernel with many laws"])
def test_the_kernel_agrees_with_scipy_on_a_law(slot):
    """An eddy current that fades with p3 acts on the coil's rate and on the current that is read."""
    law = placed(slot, PLACES["eddy_current"], "p3", 1e5, 12e5, tuple(np.linspace(1.0, -0.5, KNOTS)))
    assert_scipy_agrees(sized("eddy_current", 0.3).replace(**law))


def test_air_is_conserved_with_every_effect_on():
    p = CALIBRATED
    for name in CATALOGUE:
        p = p.replace(**{s: sized(name, 0.1)[s] for s in CATALOGUE[name]})
    initial = energised(p, p1=12e5, p2=6e5, U=24.0)
    valves = Valves.started(1, p, initial, reservoir_volume=0.02)
    start = State(*(field.copy() for field in valves.state))
    U = np.where(np.arange(200) % 50 < 25, 0.0, 24.0)[:, None]
    end = valves.record(Inputs(U, *np.zeros((3, 200, 1))), 5e-3)
    volume_3 = p["V3"] - p["sV3"] * np.pi / 4 * p["d1"] ** 2 * end.xPV
    in_3 = (end.p3 * volume_3 / (1 + end.heat_3) - start.p3 * p["V3"]) / RT
    near, far = (1 - p["s_pipe"]) * p["V2"], p["s_pipe"] * p["V2"]
    held = near * end.p2 / (1 + end.heat_2) + far * (end.p2 + end.far_pressure)
    in_2 = (held - start.p2 * p["V2"]) / RT
    from_1 = (start.p1 - end.p1) * 0.02 / RT
    assert np.max(end.air_in_PV) > 1e-3
    np.testing.assert_allclose(in_2 + in_3, from_1 - end.air_vented, rtol=0, atol=1e-9)


@numba.njit
def _magnet(q, u, c, e):
    inverse_Rm = reluctance_inverse(q, c)
    return (current_rate(q, u, c, inverse_Rm, e, True), armature_force(q, c, inverse_Rm, e, True))


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
    c, e = Coefficients(*coefficients(p)[:, 0]), Effects(*effect_constants(p)[:, 0])
    rate, net = _magnet(q, Inputs(U, 0.0, 0.0, 0.0), c, e)
    force = net + p["cMV"] * (x + p["xMV0"]) + p["kMV"] * v
    i, d = current + p["I_rem"], 1e-6
    assert force == pytest.approx((coenergy(i, x + d) - coenergy(i, x - d)) / (2 * d), rel=1e-6)
    linkage_rate = (linkage(i + d, x) - linkage(i - d, x)) / (2 * d) * rate
    linkage_rate += (linkage(i, x + d) - linkage(i, x - d)) / (2 * d) * v
    assert linkage_rate == pytest.approx(U - p["R"] * current, rel=1e-6)


@pytest.mark.parametrize("w_sat", [0.0, 0.6, 1.0, 1.5])
def test_the_inductance_bends_at_a_knee_and_the_emf_belongs_to_the_force(w_sat):
    """dI/dt = (U - R I - v dF/dI)/L: the EMF of motion is the force's derivative by the current."""
    p = CALIBRATED.replace(sMV=9e3, w_sat=w_sat)
    c, e = Coefficients(*coefficients(p)[:, 0]), Effects(*effect_constants(p)[:, 0])

    def magnet(current, v=0.0, U=24.0):
        q = dict.fromkeys(State._fields, 0.0) | {"p1": 1e5, "p2": 1e5, "p3": 1e5}
        q |= {"xMV": 3e-4, "vMV": v, "I": current}
        return np.array(_magnet(State(**q), Inputs(U, 0.0, 0.0, 0.0), c, e))

    current, d = 0.4, 1e-5
    at_rest, moving, steps = magnet(current), magnet(current, v=0.3), magnet(current, U=25.0)
    inductance = 1.0 / (steps - at_rest)[0]
    reluctance = p["RML"] + (p["xMVmax"] - 3e-4) / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2)
    u = p["sMV"] * p["N"] * current / reluctance
    steepness = (1 - w_sat) * (1 + u) ** 2 + w_sat * (1 + 16 * u**4)
    assert inductance == pytest.approx(p["N"] ** 2 / reluctance / steepness, rel=1e-9)
    emf = (at_rest - moving)[0] * inductance / 0.3
    slope = (magnet(current + d) - magnet(current - d))[1] / (2 * d)
    assert emf == pytest.approx(slope, rel=1e-6)


def released_inductance(p: Parameters) -> float:
    """Inductance of the coil with the armature at its spring [H]."""
    return p["N"] ** 2 / (p["RML"] + p["xMVmax"] / (p["mu0"] * np.pi / 4 * p["dMB"] ** 2))


def test_a_clamp_ends_the_current_sooner_and_never_reverses_it():
    """Low current, armature at rest: I = (I0 + Uc/R) exp(-t/tau) - Uc/R until it is used up."""
    p = CALIBRATED.replace(U_clamp=30.0)
    rest = energised(p, p1=12e5, p2=6e5, U=8.0)._replace(p3=p["p_env"], xMV=0.0)
    run = simulate(p, initial=rest, U=np.zeros(60), period=1e-4)
    asymptote, tau = 30.0 / p["R"], released_inductance(p) / p["R"]
    expected = (8.0 / p["R"] + asymptote) * np.exp(-run.time / tau) - asymptote
    flowing = expected > 0.05  # below, the clamp's voltage fades within 10 mA
    assert np.sum(flowing) > 3
    np.testing.assert_allclose(run.state.I[flowing], expected[flowing], rtol=0, atol=5e-3)
    assert np.min(run.state.I) >= 0
    assert run.state.I[-1] < 1e-4


def released(p: Parameters, U: float) -> State:
    """At rest with a voltage too low to lift the armature."""
    return energised(p, p1=12e5, p2=6e5, U=U)._replace(p3=p["p_env"], xMV=0.0)


def test_eddy_currents_share_the_coil_s_current_and_slow_the_flux():
    """Terminals: (I + G U)/(1 + G R), which jumps with U; I decays within L (1 + G R)/R."""
    p = CALIBRATED.replace(G_eddy=4e-3)
    slower = 1 + p["G_eddy"] * p["R"]
    time_constant = released_inductance(p) * slower / p["R"]
    off = simulate(p, initial=released(p, 8.0), U=np.zeros(100), period=1e-4)
    flux_current = 8.0 / p["R"] * np.exp(-off.time / time_constant)
    np.testing.assert_allclose(off.state.I, flux_current, rtol=1e-6)
    np.testing.assert_allclose(off.state.I_coil[1:], flux_current[1:] / slower, rtol=1e-6)
    on = simulate(p, initial=released(p, 0.0), U=np.full(100, 8.0), period=1e-4)
    assert on.state.I_coil[1] > 8.0 * p["G_eddy"] / slower  # at once, before there is flux
    expected = 8.0 / p["R"] * (1 - np.exp(-on.time / time_constant) / slower)
    np.testing.assert_allclose(on.state.I_coil[1:], expected[1:], rtol=1e-6)


def test_the_energy_of_the_coil_goes_into_heat_of_winding_and_iron_and_the_field():
    p = CALIBRATED.replace(G_eddy=4e-3)
    run = simulate(p, initial=released(p, 0.0), U=np.full(801, 8.0), period=2e-5)
    terminals = run.state.I_coil.copy()
    terminals[0] = p["G_eddy"] * 8.0 / (1 + p["G_eddy"] * p["R"])
    turn_voltage = 8.0 - p["R"] * terminals
    heat = p["R"] * terminals**2 + p["G_eddy"] * turn_voltage**2
    stored = 0.5 * released_inductance(p) * run.state.I[-1] ** 2
    assert stored > 0.05 * run.state.coil_energy[-1]
    assert run.state.coil_energy[-1] == pytest.approx(simpson(heat, x=run.time) + stored, rel=1e-6)


def test_a_winding_warms_with_its_power_up_to_where_it_cools_as_fast():
    """At first h U^2/R; in the end theta (1 + COPPER theta) = COOLING_TIME h U^2/R."""
    p = CALIBRATED.replace(h_coil=0.1)
    power = 24.0**2 / p["R"]
    start = energised(p, p1=12e5, p2=6e5, U=24.0)
    run = simulate(p, initial=start, U=np.full(41, 24.0), period=1e-3)
    np.testing.assert_allclose(run.state.coil_heat, 0.1 * power * run.time, rtol=1e-3, atol=1e-12)
    resistance_rate = np.diff(24.0 / run.state.I)[-1] / 1e-3
    assert resistance_rate == pytest.approx(p["R"] * 0.00393 * 0.1 * power, rel=0.02)
    last = (np.sqrt(1 + 4 * COPPER * COOLING_TIME * 0.1 * power) - 1) / (2 * COPPER)
    warm = p.replace(theta_coil=last)
    start = energised(warm, p1=12e5, p2=6e5, U=24.0)
    run = simulate(warm, initial=start, U=np.full(21, 24.0), period=0.05)
    np.testing.assert_allclose(run.state.coil_heat, last, rtol=1e-9)


CHAMBER = chamber_rates


def test_a_chamber_emptied_and_filled_adiabatically_ends_at_kappa_times_the_supply_s_temperature():
    def rates(_, q):
        return CHAMBER(q[0], q[1], 1e9, 1e-3, 0.0, 0.0, 1.0, 0.0)

    end = solve_ivp(rates, (0.0, 1.0), (1.0, 0.0), rtol=1e-10, atol=1e-10).y[:, -1]
    assert 1 + end[1] == pytest.approx(1.4, rel=1e-5)
    assert end[0] == pytest.approx(1.4 * 1e9 * 1e-3, rel=1e-5)  # kappa R T/V in


def test_gas_of_a_closed_chamber_follows_the_isentrope_or_relaxes():
    def compressed(t, q):
        return CHAMBER(q[0], q[1], 1e9, 0.0, 0.0, -1.0 / (1.0 - t), 1.0, 0.0)

    end = solve_ivp(compressed, (0.0, 0.5), (1e5, 0.0), rtol=1e-10, atol=1e-10).y[:, -1]
    np.testing.assert_allclose(end, (1e5 * 2**1.4, 2**0.4 - 1), rtol=1e-7)
    p_rate, heat_rate = CHAMBER(3e5, 0.25, 1e9, 0.0, 0.0, 0.0, 1.0, 1 / 0.3)
    assert heat_rate == pytest.approx(-0.25 / 0.3)  # Newton's exchange with the wall
    assert p_rate / 3e5 == pytest.approx(heat_rate / 1.25)


def test_a_circuit_that_leaks_too_fast_for_its_wall_cools_along_the_isentrope():
    p = {**CALIBRATED, "tau_2": 1e9, "A_circuit": 1e-6}
    start = energised(p, p1=9e5, p2=8e5, U=24.0)
    run = simulate(p, initial=start, U=np.full(400, 24.0), period=1e-2)
    expected = (run.state.p2 / 8e5) ** ((KAPPA - 1) / KAPPA)
    np.testing.assert_allclose(1 + run.state.heat_2, expected, rtol=1e-6)
    assert run.state.p2[-1] < 4e5


def test_behind_a_shut_pipe_the_circuit_is_small_and_the_rest_supplies_the_consumer():
    p = CALIBRATED.replace(s_pipe=0.6, A_pipe=0.0, A_circuit=2e-7)
    start = energised(p, p1=9e5, p2=8e5, U=24.0)
    run = simulate(p, initial=start, U=np.full(500, 24.0), period=1e-3, sigma_S=1e-3)
    per_pressure = -float(mass_flux(1e5, 8e5, 1 / np.sqrt(RT))) / 8e5
    near = 8e5 * np.exp(-RT / (0.4 * p["V2"]) * 2e-7 * per_pressure * run.time)
    np.testing.assert_allclose(run.state.p2, near, rtol=1e-6)
    far = 8e5 - RT / (0.6 * p["V2"]) * 1e-3 * run.time
    np.testing.assert_allclose(run.state.p2 + run.state.far_pressure, far, rtol=1e-6)


def test_the_supply_loses_pressure_with_the_square_of_the_flow():
    """zeta flow^2/(2 rho A^2) = (z flow)^2/(2 rho), reached within the filling time."""
    p = CALIBRATED.replace(z_supply=1e5, A_PV=1e-6)
    start = energised(p, p1=12e5, p2=2e5, U=24.0)
    run = simulate(p, initial=start, U=np.full(81, 24.0), period=2.5e-4)
    flow = np.diff(run.state.air_in_PV)[-1] / 2.5e-4
    density = (12e5 - run.state.supply_drop[-1]) / RT
    steady = (1e5 * flow) ** 2 / (2 * density)
    assert steady > 2e3
    assert run.state.supply_drop[-1] == pytest.approx(steady, rel=1e-3)
    rising = steady * (1 - np.exp(-run.time / FILLING_TIME))
    # Meanwhile the control chamber gives a little back through the open inlet.
    np.testing.assert_allclose(run.state.supply_drop, rising, rtol=0, atol=0.05 * steady)
    np.testing.assert_allclose(run.state.p1, 12e5)


def test_a_leak_of_the_circuit_is_exponential_while_it_chokes():
    p = CALIBRATED.replace(A_circuit=2e-7)
    run = simulate(p, initial=energised(p, p1=9e5, p2=8e5, U=24.0), U=np.full(2000, 24.0), period=1e-3)
    per_pressure = -float(mass_flux(1e5, 8e5, 1 / np.sqrt(RT))) / 8e5
    expected = 8e5 * np.exp(-RT / p["V2"] * 2e-7 * per_pressure * run.time)
    np.testing.assert_allclose(run.state.p2, expected, rtol=1e-6)


@pytest.mark.parametrize(("beside", "wider"), [(0.0, 0.0), (1.0, 2e-8)])
def test_a_leak_beside_the_seat_goes_on_while_the_seat_is_open(beside, wider):
    """The chamber vents exponentially while the exhaust chokes, by its bore and what lies beside."""
    p = CALIBRATED.replace(A_exh=2e-8, wA_exh=beside, V3=2e-5)
    run = simulate(p, initial=energised(p, p1=12e5, p2=8e5, U=24.0), U=np.zeros(101), period=1e-3)
    per_pressure = -float(mass_flux(1e5, 8e5, 1 / np.sqrt(RT))) / 8e5
    area = float(coefficients(p)[Coefficients._fields.index("orifice_exh"), 0]) + wider
    slope = np.diff(np.log(run.state.p3[50:])) / 1e-3  # the armature has landed
    np.testing.assert_allclose(slope, -RT / p["V3"] * area * per_pressure, rtol=1e-6)


def test_orifices_choke_where_the_effect_says():
    """Against the ellipse of ISO 6358 with critical ratio b, which the stretched form resembles."""
    b = 0.3
    share = (1 - CRITICAL_RATIO) / (1 - b)
    flux = mass_flux
    choked = flux(1e6, 1e5, 1.0, share)
    for ratio in (0.05, 0.2, 0.299):
        assert flux(1e6, 1e6 * ratio, 1.0, share) == pytest.approx(choked)
    for ratio in (0.31, 0.5, 0.7, 0.9):
        ellipse = np.sqrt(1 - ((ratio - b) / (1 - b)) ** 2)
        assert flux(1e6, 1e6 * ratio, 1.0, share) / choked == pytest.approx(ellipse, abs=0.03)
    assert flux(1e6, 5.2e5, 1.0) == pytest.approx(choked)  # without the effect it chokes at 0.528


def test_break_away_takes_the_excess_on_top():
    """20 N against 15 N of friction: a fifth more at rest lets the piston go, a half more does not."""
    back, seat = np.pi / 4 * CALIBRATED["d1"] ** 2, np.pi / 4 * CALIBRATED["d2"] ** 2
    p3 = 12e5 - (20.0 + (12e5 - 6e5) * seat + CALIBRATED["cPV"] * CALIBRATED["xPV0"]) / back
    for excess, opens in ((0.2, True), (0.5, False)):
        p = CALIBRATED.replace(F_PV=15.0, S_PV=excess, V3=2e-5)
        start = energised(p, p1=12e5, p2=6e5, U=24.0)._replace(p3=p3)
        run = simulate(p, initial=start, U=np.full(4, 24.0), period=2.5e-4)
        assert (np.max(run.state.xPV) > 0) == opens
    relative = [stribeck(v, 0.8) for v in (0.0, STRIBECK_SPEED, -STRIBECK_SPEED, 10.0)]
    np.testing.assert_allclose(relative, (1.8, 1.4, 1.4, 1.0), rtol=1e-4)


def test_the_swept_volume_raises_the_pressure_of_a_sealed_chamber():
    """p3 V3 stays constant: compared along a run with tiny seats of the magnet valve."""
    p = CALIBRATED.replace(sV3=1.0, alphaMV=0.5, dMVin=5e-4, dMVexh=5e-4)
    start = energised(p, p1=12e5, p2=6e5, U=24.0)._replace(p3=4e5)
    run = simulate(p, initial=start, U=np.full(20, 24.0), period=1e-4)
    volume = p["V3"] - np.pi / 4 * p["d1"] ** 2 * run.state.xPV
    held = run.state.p3 * volume / RT
    gained = run.state.air_in_MV - run.state.air_vented
    np.testing.assert_allclose(held - held[0], gained, rtol=0, atol=1e-11)
    assert np.max(run.state.xPV) > 1e-3
