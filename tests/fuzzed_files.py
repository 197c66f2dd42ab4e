"""A good file of each format that a command takes from a stranger: its writer, and how it is used."""

import json
import shutil
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from controllers.policy import TRAINED, load_policy
from controllers.policy_files import CONTRACT_FILE, WEIGHTS_FILE
from controllers.tuned import load_search, load_tunings, save_tunings, tuned
from epv_env.common.files import Journal, write_json
from epv_env.common.results_folder import CONFIG, check_options, write_options
from epv_env.observation import ENTRIES
from epv_env.plant.plantfile import Plant, load_plant, plant_subject, save_plant
from epv_env.plant.region import Alternative, Mixture, Region
from epv_env.reward import RewardWeights
from identification.bench.programmes import REPORT_SUITE, load_programmes, save_programmes
from identification.calibration.search import SearchResult
from identification.gap.fit.evidence import evaluate
from identification.gap.fit.fitting_problem import FitCache
from identification.gap.fit.recalibration import recalibrate
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.report.gap_json import FORMAT, GAP
from identification.importing.import_campaign import read_files
from identification.importing.mapping_file import read_mapping
from identification.monitor.model import MonitorModel
from identification.monitor.monitor import Monitor
from identification.recordings.campaign_files import FILE_NAME, read_campaign, write_campaign
from identification.recordings.log_files import read_log
from identification.valve_gap.logged_valve import steady_openings
from tests.identification.gap.drives import Drive
from tests.identification.importing.dialects import DIALECTS
from tests.identification.monitor.test_monitor import white_model
from tests.identification.recordings.good_campaign import campaign_of, switching
from training.commands.sim_to_real import diagnosis_text
from training.commands.train import Options, begin_folder, configuration
from training.drives import write_log
from training.evaluation.batches import kept_metrics
from training.evaluation.metrics import EpisodeMetrics, summary
from training.learners import ppo
from training.learners.environment import ROLLOUT, make_training_env

Use = Callable[[Path], object]
"""Writes a good file at a path, or uses the one that is there."""

VALVE = Plant.calibrated()


def _decide(path: Path) -> None:
    policy = load_policy(path.parent)
    policy.reset(2)
    assert set(policy.act(np.zeros((2, ENTRIES)))) <= {0, 1}


def _monitor(path: Path) -> None:
    monitor = Monitor(MonitorModel.load(path))
    monitor.follow(np.tile([1.0, 24.0, 12.0, 8.0, 12.0, 0.5], (100, 1)))
    assert 0.0 <= monitor.probability <= 1.0


def _plant(path: Path) -> None:
    region = Region(centre=VALVE.parameters)
    found = Mixture(alternatives=(Alternative(name="lag", probability=1.0, region=region),))
    save_plant(Plant(parameters=VALVE.parameters, region=region, diagnosis=found), path)


def _gap(path: Path) -> None:
    _plant(path.with_name("plant.json"))
    empty = {"causes": [], "ambiguity_set": [], "gap": {}}
    write_json(path, {"format": FORMAT, "verdict": "partial", **empty})


@cache
def _model() -> Any:
    settings: Any = {"parameters": "exact", "weights": RewardWeights()}
    return ppo.make_model(make_training_env(plant=VALVE, num_envs=2, **settings), seed=0)


def _resume(path: Path) -> None:
    if ppo.load_checkpoint(_model(), path.parents[1], 8192):
        assert all(bool(weight.isfinite().all()) for weight in _model().policy.parameters())
        assert 0 < _model().num_timesteps < 8192


def _config(path: Path) -> None:
    check_options(path.parent, {"versions": configuration(Options(), VALVE)["versions"]}, "training")
    begin_folder(Options(out=path.parent, resume=True), VALVE)


def _journal(result: Any, use: Callable[[Any], object]) -> tuple[Use, Use]:
    """A journal that holds a result; read, if its line is there, and used."""

    def read(path: Path) -> None:
        if "it" in (journal := Journal(path, {})):
            journal.read("it", use)

    return lambda path: Journal(path, {}).add("it", result), read


START = np.ones(4)
SEARCH = SearchResult(
    method="Nelder-Mead", start=START, z=START, error=1.0, evaluations=3, seconds=1.0, converged=True,
    message="",
)  # fmt: skip


def _search(content: Any) -> None:
    found = SearchResult.from_json(content, START)
    assert np.all(np.isfinite(found.z + found.error))


@cache
def _fit() -> Any:
    return recalibrate(prepared(Drive({"lag": 0.05})))


def _fits(path: Path) -> None:
    problem, base = _fit()
    evaluate(problem, FitCache(problem.plant, Journal(path, {}))("base", lambda: [base]))


MAPPING = {
    "format": "epv-mapping/1", "environment": {"temperature_K": 293.0, "pressure_bar": 1.0},
    "channels": {"p2": {"source": "P2_raw", "unit": "mbar gauge", "factor": 1.0}},
    "recordings": {"a.mf4": {"role": "calibration", "name": "test1"}},
}  # fmt: skip


POLICY = lambda path: shutil.copytree(TRAINED, path.parent, dirs_exist_ok=True), _decide
CAMPAIGN = (
    lambda path: write_campaign(campaign_of(switching()), path.parent),
    lambda path: read_campaign(path.parent),
)
LOG = (
    lambda path: write_log(path.parent, tuned("hysteresis"), VALVE, [0], duration=10.0),
    lambda path: steady_openings(read_log(path.parent), VALVE),
)

DIALECT_OF = {"csv": "psi", "mf4": "MDF 4", "mat": "MATLAB 5", "tdms": "TDMS", "parquet": "Parquet"}
MEASURED = {
    f"run.{ending}": (
        partial(lambda write, path: write(path.with_suffix(""), switching()), DIALECTS[dialect]),
        lambda path: read_files([path], ambient_bar=1.0),
    )
    for ending, dialect in DIALECT_OF.items()
}

FORMATS: dict[str, tuple[Use, Use]] = {
    "plant.json": (_plant, lambda path: json.dumps(plant_subject(load_plant(path)), allow_nan=False)),
    "next.json": (partial(save_programmes, REPORT_SUITE), load_programmes),
    FILE_NAME: CAMPAIGN,
    "test1.csv": CAMPAIGN,
    "mapping.json": (lambda path: write_json(path, MAPPING), read_mapping),
    CONTRACT_FILE: POLICY,
    WEIGHTS_FILE: POLICY,
    "log.json": LOG,
    "drive-1.csv": LOG,
    "monitor.json": (white_model().save, _monitor),
    "tuned.json": (lambda path: save_tunings(load_tunings(), path, load_search()), load_tunings),
    f"checkpoints/{2 * ROLLOUT:010}.safetensors": (
        lambda path: ppo.save_checkpoint(_model().learn(1), path.parents[1]),
        _resume,
    ),
    ppo.VALIDATION_FILE: (
        lambda path: path.write_text(f"{','.join(ppo.ROW)}\n1,2,3,4,5,6,7\n"),
        lambda path: max((row["score"] for row in ppo.read_rows(path.parent)), default=0.0),
    ),
    CONFIG: (lambda path: write_options(path.parent, configuration(Options(), VALVE)), _config),
    GAP: (_gap, lambda path: diagnosis_text(path.parent)),
    "batches.jsonl": _journal(
        {name: [0.0, 1.0] for name in EpisodeMetrics.__annotations__} | {"stayed": [True, False]},
        lambda found: summary(kept_metrics(found, 2)),
    ),
    "searches.jsonl": _journal(SEARCH.as_json(), _search),
    "fits.jsonl": (_fits, _fits),
    **MEASURED,
}
"""By the file's name: what writes a good one, with what belongs beside it, and how it is used."""


@cache
def good(name: str) -> dict[str, bytes]:
    """The files of a folder with a good file of this name, by their path; the file is used once."""
    write, use = FORMATS[name]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write(folder / name)
        use(folder / name)
        paths = [path for path in folder.rglob("*") if path.is_file()]
        return {str(path.relative_to(folder)): path.read_bytes() for path in paths}
