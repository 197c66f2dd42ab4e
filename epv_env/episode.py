"""One episode: what is drawn at its start, and what the compiled step keeps of it in between."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from epv_env.common.units import BAR
from epv_env.observation import HISTORY
from epv_env.plant.consumption import SILENT, Profile, draw_profile
from epv_env.plant.parameters import Parameters
from epv_env.plant.readings import MEASURED
from epv_env.plant.region import Region
from epv_env.plant.supply import Supply
from epv_env.settings import Settings
from epv_env.signals import MovingTarget, RecordedConsumption

TARGET_STEPS = 4
"""Steps that a target may take in an episode, besides a MovingTarget."""

EPISODE = np.dtype(
    [
        ("target", np.float64),  # [bar absolute]
        ("steps", np.int64),  # control periods so far
        ("action", np.float64),  # share of the last period with the coil on [-]
        ("waited", np.float64),  # since the last switching [s]
        ("cut_in", np.float64),  # of the compressor [Pa absolute]
        ("cut_out", np.float64),  # of the compressor [Pa absolute]
        ("delivery", np.float64),  # of the running compressor [kg/s]
        ("p1_slope", np.float64),  # of a recorded supply over this period [Pa/s]
        ("reading", np.float64, (len(MEASURED),)),  # of each sensor [bar, A]
        ("p2_history", np.float64, (HISTORY,)),  # readings, the newest first [bar]
        ("p3_history", np.float64, (HISTORY,)),  # the same of p3 [bar]
        ("coil", np.bool_),  # on at the end of the last period
        ("compressor", np.bool_),  # running
        ("idle_until", np.float64),  # when the compressor may start [s]
        ("noise", np.float64),  # factor on the sensors' noise [-]
        ("p3_frozen_at", np.float64),  # when the reading of p3 stops changing [s]
        ("target_steps_at", np.float64, (TARGET_STEPS,)),  # [s]
        ("target_steps_to", np.float64, (TARGET_STEPS,)),  # [bar absolute]
        ("violated", np.bool_),  # outside the band after settling
    ],
    align=True,
)
"""Record of a running episode."""


@dataclass(frozen=True, kw_only=True)
class Start:
    """Everything random about one episode but its noise."""

    parameters: Parameters
    """Of the plant."""
    region: Region
    """That the plant was drawn from."""
    p1: float
    """First pressure of the supply [Pa absolute]."""
    p2: float
    """First circuit pressure [Pa absolute]."""
    p3: float
    """First control pressure [Pa absolute]."""
    target: float
    """Target pressure [bar absolute]."""
    consumption: Profile
    """Consumption of the whole episode."""
    noise: np.random.Generator
    """Of the sensors."""
    supply: Supply
    """Where the air comes from."""
    moving_target: MovingTarget | None
    """What changes the target; None: it stays."""
    recorded_consumption: RecordedConsumption | None
    """What is drawn instead of `consumption`; None: nothing."""
    seed: int
    """Of all random streams of the episode."""
    coil: bool = True
    """Whether the coil is on at the start."""
    noise_factor: float = 1.0
    """On the settings' noise of the sensors [-]."""
    p3_frozen_at: float = np.inf
    """When the reading of p3 stops changing [s]."""
    target_steps_at: NDArray = field(default_factory=lambda: np.full(TARGET_STEPS, np.inf))
    """When the target steps, increasing (TARGET_STEPS,) [s]; infinite: never."""
    target_steps_to: NDArray = field(default_factory=lambda: np.zeros(TARGET_STEPS))
    """To which value, (TARGET_STEPS,) [bar absolute]."""

    @classmethod
    def draw(cls, rng: np.random.Generator, settings: Settings) -> "Start":
        """Draw an episode; rng gives one seed, from which the three streams of the episode come."""
        seed = int(rng.integers(2**63))
        plant, disturbance, noise = (np.random.default_rng((seed, stream)) for stream in range(3))
        p1 = settings.supply.draw(disturbance)
        target = disturbance.uniform(*settings.first_target)
        drop = disturbance.uniform(*settings.drop_bar)
        scenario = settings.scenario
        recorded = scenario if isinstance(scenario, RecordedConsumption) else None
        consumption = (
            SILENT if isinstance(scenario, RecordedConsumption) else draw_profile(scenario, disturbance)
        )
        # Draws that only some settings need come last: they must not shift the others.
        p2 = target - drop if settings.p2_bar is None else disturbance.uniform(*settings.p2_bar)
        p3 = p1 if settings.p3_bar is None else disturbance.uniform(*settings.p3_bar) * BAR
        return cls(
            parameters=settings.plants.draw(plant), region=settings.plants,
            p1=p1, p2=p2 * BAR, p3=p3, target=target,
            consumption=consumption,
            noise=noise,
            supply=settings.supply,
            moving_target=settings.target_bar if isinstance(settings.target_bar, MovingTarget) else None,
            recorded_consumption=recorded,
            seed=seed,
        )  # fmt: skip
