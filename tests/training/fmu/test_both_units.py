"""The units of policy and plant in FMPy close the loop as an episode in Python does."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("joblib")
pytest.importorskip("fmpy", reason="FMPy is not installed")

import fmpy
from fmpy.fmi2 import FMU2Slave

from controllers.policy import TRAINED, load_policy
from epv_env.common.units import BAR
from epv_env.period import NOISE_BLOCK
from epv_env.plant.channels import CHANNEL, MEASURED, digitised
from epv_env.plant.plantfile import Plant
from tests.training.exports import export
from training.deploy.fmu.archive import fmu
from training.deploy.fmu.models import plant_model
from training.evaluation.rollout import begin_episodes, make_env

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

PERIOD, PERIODS = 5e-3, 2000
SEED = 6
"""Of an episode in which no reading lies so near a step of its converter that FMU and kernel round it
apart."""
FINE = 25e-6
"""Integration step at which FMU and kernel differ by nothing but their code [s]."""
MILLIBAR = 100.0
DRAWN = ("sigma_S", "refill", "p1_slope")
"""Inputs of the plant that do not come from the policy."""


class Slave:
    """A unit in FMPy."""

    def __init__(self, content: bytes, folder: Path, start: dict[str, float]):
        folder.mkdir()
        (folder / "unit.fmu").write_bytes(content)
        where = fmpy.extract(str(folder / "unit.fmu"), str(folder / "unzipped"))
        described: Any = fmpy.read_model_description(where)
        self.references = {each.name: each.valueReference for each in described.modelVariables}
        identifier = described.coSimulation.modelIdentifier
        self.slave = FMU2Slave(
            guid=described.guid, unzipDirectory=where, modelIdentifier=identifier, instanceName="unit"
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.set(start)
        self.slave.exitInitializationMode()

    def set(self, values: dict[str, float]) -> None:
        self.slave.setReal([self.references[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        return self.slave.getReal([self.references[name] for name in names])

    def step(self, k: int) -> None:
        """Over control period k."""
        self.slave.doStep(currentCommunicationPoint=k * PERIOD, communicationStepSize=PERIOD)


@pytest.fixture(scope="module")
def episode() -> dict[str, Any]:
    """An episode in Python: how it starts, and by period what is drawn and what the policy decides."""
    policy = load_policy()
    env: Any = make_env(policy, 1, parameters="sensitive_ten_percent", scenario="mixed")
    task = env.task
    task.valves.step = FINE
    observation = begin_episodes(env, policy, [SEED])
    task.valves.nominal = False  # the task then advances its plant by `advance`, which minds the step
    q, p, volume = task.valves.state, task.parameters[0], float(task.volumes[0])
    start = {f"{name}_start": float(getattr(q, name)[0]) for name in ("p1", "p2", "p3", "I")}
    start |= {"longest_step": FINE, "V1": volume if np.isfinite(volume) else 0.0}
    found: dict[str, Any] = {"parameters": p, "start": start, "target": float(task.target[0])}
    noise, drawn, actions, p2 = [task._noise[0, 0].copy()], [], [], []
    for k in range(PERIODS):
        actions.append(int(policy.act(observation)[0]))
        observation = env.advance(np.array(actions[-1:])).observation
        drawn.append({name: float(getattr(task.valves.inputs, name)[0]) for name in DRAWN})
        noise.append(task._noise[0, (k + 1) % NOISE_BLOCK].copy())
        p2.append(float(q.p2[0]))
    return found | {"noise": noise, "drawn": drawn, "actions": actions, "p2": p2}


@pytest.fixture(scope="module")
def ecu(tmp_path_factory) -> bytes:
    """The FMU of the package's policy."""
    folder = tmp_path_factory.mktemp("ecu")
    assert export(TRAINED, folder, "--fmu") == 0
    return (folder / "epv_policy.fmu").read_bytes()


def read(plant: Slave, noise: NDArray) -> dict[str, float]:
    """What the sensors say of the plant, as inputs of the policy."""
    said = {}
    for name, true, normal in zip(MEASURED, plant.get(*MEASURED), noise, strict=True):
        channel = CHANNEL[name]
        said[name] = channel.scale * digitised(true / channel.scale, normal, *channel.sensor.constants())
    return said


@pytest.mark.parametrize("first", ["policy", "plant"])
def test_every_decision_is_that_of_the_episode_unless_it_comes_a_period_late(
    episode, ecu, first, tmp_path
):
    valve = Plant(parameters=episode["parameters"], region=Plant.calibrated().region)
    plant = Slave(fmu(plant_model(valve), "cc"), tmp_path / "plant", episode["start"])
    inputs = {**read(plant, episode["noise"][0]), "p2_target": episode["target"] * BAR}
    policy = Slave(ecu, tmp_path / "policy", inputs)
    decided, p2, before = [], [], policy.get("U")[0]
    for k in range(PERIODS):
        policy.set(read(plant, episode["noise"][k]))
        policy.step(k)
        coil, U = policy.get("coil", "U")
        decided.append(int(coil))
        plant.set({**episode["drawn"][k], "U": U if first == "policy" else before})
        plant.step(k)
        before = U
        p2 += plant.get("p2")
    apart = np.max(np.abs(np.subtract(p2, episode["p2"])))
    assert (decided == episode["actions"]) == (first == "policy")
    assert (apart < MILLIBAR) == (first == "policy")
    assert 0.1 < np.mean(decided) < 0.99
    assert np.ptp(p2) > 1e4
