"""What a valve of this kind must be able to do, by statics: its piston opens, its armature pulls in.

The checks are for a valve of one's own, whose parameters no table bounds. They call the state equations
without compiling them, since each is needed once.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from epv_env.common.units import BAR
from epv_env.plant import equations
from epv_env.plant.channels import Sensor
from epv_env.plant.coefficients import folded
from epv_env.plant.equations import State
from epv_env.plant.parameters import ParameterError, Parameters
from epv_env.plant.primitives import CRITICAL_RATIO, mass_flux


def check_valve(parameters: Parameters, voltage: float, sensors: Mapping[str, Sensor]) -> None:
    """Raises ParameterError for a valve that cannot work, or that its sensors cannot show.

    voltage: of the energised coil [V]. sensors: by channel [bar absolute, A, V].
    """
    for fault in _faults(parameters, voltage, sensors):
        raise ParameterError(fault)


def opening_force(p: Parameters, supply: float) -> float:
    """Net force on the shut piston [N], its circuit and control chamber vented; it opens if positive.

    supply: p1 [Pa absolute]. Eq. 22 at rest.
    """
    q = _at_rest(p)._replace(p1=supply)
    return float(equations.piston_force(q, folded(p, np.inf), None, None))


def pull_in_force(p: Parameters, current: float, stroke: float) -> float:
    """Net force on the armature [N] at rest at a stroke [m], for a current [A] (eq. 11)."""
    q, c = _at_rest(p)._replace(xMV=stroke, I=current), folded(p, np.inf)
    inverse_Rm = 1.0 / equations.reluctance(q, c)
    return float(equations.armature_force(q, c, inverse_Rm, None, None))


def venting_rate(p: Parameters) -> float:
    """Rate at which choked flow through the open exhaust empties the control chamber [1/s] (eq. 7)."""
    c, far = folded(p, np.inf), 100.0 * p["p_env"]
    flux = mass_flux(far, p["p_env"], c.inverse_sqrt_RT)
    return float(c.RT_V3 * min(c.curtain_exh * c.xMVmax, c.orifice_exh) * flux / far)


def _at_rest(p: Parameters) -> State:
    """Everything vented and without current."""
    chambers = dict.fromkeys(("p1", "p2", "p3"), p["p_env"])
    return State(**dict.fromkeys(State._fields, 0.0) | chambers)


def _faults(p: Parameters, voltage: float, sensors: Mapping[str, Sensor]) -> Iterator[str]:
    """What is wrong, a sentence each with its rule and remedy; the most basic first."""
    if not 0 < voltage <= sensors["U"].high:
        yield (
            f"voltage_V = {voltage:g} must be positive and within the voltage sensor's range, up to "
            f"{sensors['U'].high:g} V: correct it, or widen sensors.U"
        )
    if p["d2"] >= p["d1"]:
        yield (
            f"d2 = {p['d2']:g} m must be less than d1 = {p['d1']:g} m, since the supply opens the valve "
            "by the ring between seat and piston: exchange them, or check the unit"
        )
    yield from _piston_faults(p, sensors["p1"])
    yield from _coil_faults(p, voltage, sensors["I"])


def _piston_faults(p: Parameters, supply: Sensor) -> Iterator[str]:
    critical = p["p_env"] / CRITICAL_RATIO / BAR
    if supply.high <= critical:
        yield (
            f"sensors.p1.high = {supply.high:g} bar lies below {critical:.3g} bar, where the flow to "
            "ambient becomes choked: give the range of a brake's supply, absolute"
        )
    force = opening_force(p, supply.high * BAR)
    if force <= 0:
        yield (
            f"the piston never opens: a supply of {supply.high:g} bar, the sensor's greatest, "
            f"leaves {force:.3g} N on it; the force on the ring of d1 and d2 must exceed cPV xPV0: "
            "check their units"
        )


def _coil_faults(p: Parameters, voltage: float, ammeter: Sensor) -> Iterator[str]:
    current = voltage / p["R"]
    if current >= ammeter.high:
        yield (
            f"voltage_V / R = {current:.3g} A exceeds the current sensor's range, up to "
            f"{ammeter.high:g} A: check voltage_V and R, or widen sensors.I"
        )
    for words, stroke in (("pulls in", 0.0), ("holds", p["xMVmax"])):
        force = pull_in_force(p, current, stroke)
        if force <= 0:
            yield (
                f"{voltage:g} V and {current:.3g} A leave a net {force:.3g} N, so the coil never "
                f"{words} its armature: check N, R, RML, dMB and voltage_V against cMV, xMV0 and xMVmax"
            )
