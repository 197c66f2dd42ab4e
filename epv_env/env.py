"""EPValve-v0 and EPValvePWM-v0: one valve as a Gymnasium environment."""

from typing import Any, ClassVar, Literal, SupportsFloat

import gymnasium
import numpy as np
from numpy.typing import NDArray

from epv_env.actions import PWM, OnOff
from epv_env.common.field_types import shown
from epv_env.common.units import BAR, GRAM
from epv_env.observation import observation_space
from epv_env.render import Renderer, Snapshot
from epv_env.result import step_info, truth
from epv_env.settings import as_plant, checked_options, make_settings, with_options
from epv_env.signals import OptionError, as_seed, checked_flag
from epv_env.task import LimitingTask


class _ValveEnv(gymnasium.Env[NDArray, Any]):
    """Keep the circuit pressure within ±500 mbar of a target while consumers draw air.

    Observation: Box, float32, the ECU's readings as `epv_env.observation.LAYOUT` lists them. Reward:
    the sum of `epv_env.reward.RewardTerms`. Terminates when the circuit is empty (p2 below 1.5 bar),
    never otherwise; Gymnasium's time limit truncates after 2000 (PWM: 500) control periods, 10 s at the
    default period. info: see `epv_env.result`.

    Arguments, all optional:
        plant: path of a plant file (docs/reference/files.md), a Plant, or None for the report's
            calibration.
        parameters: "exact" (the plant's own), the name of a region ("confidence", "ten_percent",
            "sensitive_ten_percent", "domain"), "diagnosis" (the alternatives of the plant file), or
            {symbol: value or (low, high)} in SI units.
        supply: None for two reservoirs that sag, a constant pressure [bar absolute], or a Supply.
        scenario: name of a consumption scenario (`epv_env.plant.consumption.SCENARIOS`) or "mixed".
        effects: sizes of effects by name, values or (low, high) in SI units.
        target_bar, p2_bar, p3_bar: value or (low, high) [bar absolute]; the target also as a function
            of the time [s].
        conditions: what an episode may meet beyond the ordinary: None, "broad", a
            `epv_env.conditions.Conditions`, or a mapping of its fields.
        band_bar: half-width of the band that the reward prices [bar].
        privileged: whether info shows true state and parameters (`epv_env.result.truth`).
        control_period: time between decisions [s].
        supply_voltage, settling_time, sensor_noise, weights, drop_bar: see `epv_env.settings`.
    reset(options=...) takes parameters, effects, supply, scenario, target_bar, p2_bar, p3_bar and
    conditions for one episode.
    Raises ValueError subclasses with one clear sentence for what cannot be used.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 50}  # noqa: RUF012
    action_form: ClassVar[type[OnOff] | type[PWM]]

    def __init__(
        self,
        *,
        plant: Any = None,
        control_period: float | None = None,
        render_mode: Literal["rgb_array", "human"] | None = None,
        privileged: bool = False,
        **options: Any,
    ):
        if not (
            render_mode is None
            or (isinstance(render_mode, str) and render_mode in self.metadata["render_modes"])
        ):
            raise OptionError(f"unknown render_mode {shown(render_mode)}: use 'rgb_array' or 'human'")
        period = self.action_form.default_period if control_period is None else control_period
        self.plant = as_plant(plant)
        self.settings = make_settings(self.plant, control_period=period, **options)
        self.render_mode = render_mode
        self.action = self.action_form(period)
        self.action_space = self.action.space()
        self.observation_space = observation_space()
        self.task = LimitingTask(1, self.settings, threads=1)
        self.privileged = checked_flag("privileged", privileged)
        fps = self.metadata["render_fps"]
        self._renderer = None if render_mode is None else Renderer(render_mode, fps)
        self._consumption = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray, dict[str, Any]]:
        chosen = checked_options(options)
        super().reset(seed=as_seed(seed))
        settings = with_options(self.settings, chosen, self.plant) if chosen else self.settings
        observation = self.task.begin(np.array([0]), [self.np_random], [settings])[0]
        self._consumption = 0.0
        if self._renderer is not None:
            self._renderer.reset()
            self._show()
        return observation, self._truth()

    def _truth(self) -> dict[str, Any]:
        """The privileged entries of info, if they are shown."""
        if not self.privileged:
            return {}
        shown = truth(self.task.valves.state, self.task.parameter_values)
        return {key: value[0] for key, value in shown.items()}

    def step(self, action: Any) -> tuple[NDArray, SupportsFloat, bool, bool, dict[str, Any]]:
        result = self.task.step(*self.action.decode([action]))
        info = {key: value[0, ...] for key, value in step_info(result).items()}
        self._consumption = float(result.consumption[0])
        if self._renderer is not None:
            self._show()
        reward, failed = float(result.reward[0]), bool(result.failed[0])
        return result.observation[0], reward, failed, False, info | self._truth()

    def snapshot(self) -> Snapshot:
        """The true state at this instant, for pictures and logs (a controller must not see it)."""
        state = self.task.valves.state
        p = self.task.parameters[0]
        if p is None:
            raise RuntimeError("there is no episode yet: call reset() first")
        return Snapshot(
            time_s=float(self.task.time()[0]),
            p1_bar=float(state.p1[0]) / BAR,
            p2_bar=float(state.p2[0]) / BAR,
            p3_bar=float(state.p3[0]) / BAR,
            target_bar=float(self.task.target[0]),
            xPV_fraction=float(state.xPV[0]) / p["xPVmax"],
            xMV_fraction=float(state.xMV[0]) / p["xMVmax"],
            I_A=float(state.I[0]),
            coil_on=bool(self.task.coil[0]),
            sigma_S_g_per_s=self._consumption / GRAM,
        )

    def render(self) -> Any:
        """An RGB frame (rgb_array), or None (human: a window; None: nothing)."""
        if self._renderer is None:
            gymnasium.logger.warn("render() without a render_mode: pass render_mode to make()")
            return None
        return self._renderer.draw(self.snapshot())

    def _show(self) -> None:
        """Draw in a window; otherwise note the period for the charts of the next frame."""
        assert self._renderer is not None
        if self.render_mode == "human":
            self._renderer.draw(self.snapshot())
        else:
            self._renderer.note(self.snapshot())

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()


class EPValveEnv(_ValveEnv):
    __doc__ = (
        _ValveEnv.__doc__ or ""
    ) + "Action: Discrete(2), 0 = coil off (the PV opens), 1 = on (it shuts)."
    action_form = OnOff


class EPValvePWMEnv(_ValveEnv):
    __doc__ = (
        _ValveEnv.__doc__ or ""
    ) + "Action: Box [-1, 1]: (action + 1) / 2 is the share of the PWM period with the coil on."
    action_form = PWM
