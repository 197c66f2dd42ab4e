"""A good file of each format that a command takes from a stranger, and how the command uses it."""

import json
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from controllers.knowledge import READINGS
from controllers.policy import TRAINED, load_policy
from controllers.policy_files import CONTRACT_FILE, WEIGHTS_FILE
from controllers.tuned import load_search, load_tunings, save_tunings
from epv_env.common.files import Journal, read_bytes
from epv_env.common.results_folder import CONFIG, check_options, write_options
from epv_env.operation_log import DECIMALS
from epv_env.plant.plantfile import Plant, load_plant, plant_subject, save_plant
from epv_env.plant.region import Alternative, Mixture, Region
from epv_env.reward import RewardWeights
from epv_env.saved_state import SavedState, restore_state, save_state
from identification.bench.programmes import REPORT_SUITE, load_programmes, save_programmes
from identification.calibration.search import SearchResult
from identification.gap.fit.evidence import evaluate
from identification.gap.fit.fitting_problem import FitCache
from identification.gap.fit.recalibration import recalibrate
from identification.gap.prepare.prepared_plant import prepared
from identification.gap.report.gap_json import FORMAT as GAP_FORMAT
from identification.gap.report.gap_json import GAP
from identification.importing.import_campaign import read_files
from identification.importing.mapping_file import read_mapping
from identification.monitor.model import MonitorModel
from identification.monitor.monitor import Monitor
from identification.recordings.campaign_files import FILE_NAME, read_campaign, write_campaign
from identification.recordings.columns import REQUIRED_COLUMNS, read_columns
from identification.recordings.log_files import read_log
from identification.valve_gap.operation import steady_openings
from tests.identification.gap.drives import Drive
from tests.identification.importing.dialects import DIALECTS, columns_of, text
from tests.identification.monitor.test_monitor import white_model
from tests.identification.recordings.good_campaign import campaign_of, switching
from training.commands.sim_to_real import diagnosis_text
from training.commands.train import Options, begin_folder, configuration
from training.evaluation.batches import kept_metrics
from training.evaluation.metrics import EpisodeMetrics, summary
from training.learners.environment import make_training_env
from training.learners.ppo import (
    ROW,
    VALIDATION_FILE,
    load_checkpoint,
    make_model,
    read_rows,
    save_checkpoint,
)

Use = Callable[[Path], object]
"""Fills a folder with a good file, or uses the folder's."""


@cache
def _policy_files() -> dict[str, bytes]:
    return {name: (TRAINED / name).read_bytes() for name in (CONTRACT_FILE, WEIGHTS_FILE)}


def _policy(folder: Path) -> None:
    for name, content in _policy_files().items():
        (folder / name).write_bytes(content)


def _decide(folder: Path) -> None:
    policy = load_policy(folder)
    policy.reset(2)
    assert set(policy.act(np.zeros((2, READINGS)))) <= {0, 1}


def _json(content: dict[str, Any], name: str) -> Use:
    return lambda folder: (folder / name).write_text(json.dumps(content))


def _table(folder: Path) -> None:
    names = [*REQUIRED_COLUMNS, "p1_bar"]
    rows = np.linspace(0.0, 1.0, 20 * len(names)).reshape(20, -1)
    lines = [",".join(names), *(",".join(f"{value:.6f}" for value in row) for row in rows)]
    (folder / "recording.csv").write_text("\n".join(lines) + "\n")


def _log(folder: Path) -> None:
    """Eight openings, each after half a second with the coil on."""
    coil = np.tile(np.repeat([1, 0], [100, 40]), 8)
    p3 = np.where(coil, 12.0, np.maximum(12.0 * 0.9 ** (np.arange(len(coil)) % 140 - 99), 1.0))
    rows = [
        [k * 5e-3, c, 24.0, 12.0, 8.0, p, 0.5 * c, 8.0]
        for k, (c, p) in enumerate(zip(coil, p3, strict=True))
    ]
    lines = [",".join(DECIMALS), *(",".join(f"{value:.4f}" for value in row) for row in rows)]
    (folder / "drive-1.csv").write_text("\n".join(lines) + "\n")
    content = {
        "format": "epv-log/1", "name": "valve", "control_period_s": 5e-3,
        "environment": {"temperature_K": 293.0, "pressure_bar": 1.0},
        "drives": [{"file": "drive-1.csv"}],
    }  # fmt: skip
    (folder / "log.json").write_text(json.dumps(content))


def _openings(folder: Path) -> None:
    log = read_log(folder)
    monitor = Monitor(white_model())
    for d in log.drives:
        monitor.follow(np.column_stack([d.coil, d.U, d.p1 / 1e5, d.p2 / 1e5, d.p3 / 1e5, d.I]))
    steady_openings(log, Plant.calibrated())


def _monitor(folder: Path) -> None:
    monitor = Monitor(MonitorModel.load(folder / "monitor.json"))
    monitor.follow(np.tile([1.0, 24.0, 12.0, 8.0, 12.0, 0.5], (100, 1)))
    assert 0.0 <= monitor.probability <= 1.0


def _plant(folder: Path) -> None:
    plant = load_plant(folder / "plant.json")
    json.dumps(plant_subject(plant), allow_nan=False)


@cache
def _diagnosed() -> Plant:
    p = Plant.calibrated().parameters
    found = Mixture(alternatives=(Alternative(name="lag", probability=1.0, region=Region(centre=p)),))
    return Plant(parameters=p, region=Region(centre=p), diagnosis=found)


def _gap(folder: Path) -> None:
    save_plant(_diagnosed(), folder / "plant.json")
    content = {"format": GAP_FORMAT, "verdict": "partial", "causes": [], "ambiguity_set": [], "gap": {}}
    (folder / GAP).write_text(json.dumps(content))


@cache
def _model() -> Any:
    settings: Any = {"parameters": "exact", "weights": RewardWeights()}
    return make_model(make_training_env(plant=Plant.calibrated(), num_envs=2, **settings), seed=0)


def _checkpoint(folder: Path) -> None:
    model = _model()
    model.policy.optimizer.zero_grad()
    model.num_timesteps = 1024
    for parameter in model.policy.parameters():
        parameter.data.fill_(0.1)
        parameter.grad = parameter.data * 0.0
    model.policy.optimizer.step()
    save_checkpoint(model, folder)


def _resume(folder: Path) -> None:
    if load_checkpoint(_model(), folder, 8192):
        assert all(bool(p.isfinite().all()) for p in _model().policy.parameters())
        assert 0 < _model().num_timesteps < 8192


def _validation(folder: Path) -> None:
    max((row["score"] for row in read_rows(folder) if row["timesteps"] < 8), default=0.0)


def _trained(folder: Path) -> None:
    write_options(folder, {"seed": 0, **configuration(Options(), Plant.calibrated())})


def _config(folder: Path) -> None:
    check_options(folder, {"seed": 0}, "comparison")
    begin_folder(Options(out=folder, resume=True), Plant.calibrated())


FIGURES = {name: [0.0, 1.0] for name in EpisodeMetrics.__annotations__} | {"stayed": [True, False]}


def _batches(folder: Path) -> None:
    Journal(folder / "batches.jsonl", {}).add("cell", FIGURES)


def _comparison(folder: Path) -> None:
    journal = Journal(folder / "batches.jsonl", {})
    if "cell" in journal:
        summary(journal.read("cell", partial(kept_metrics, episodes=2)))


START = np.ones(4)


def _searches(folder: Path) -> None:
    search = SearchResult(
        method="Nelder-Mead", start=START, z=START, error=1.0, evaluations=3, seconds=1.0,
        converged=True, message="",
    )  # fmt: skip
    Journal(folder / "searches.jsonl", {}).add("start 0", search.as_json())


def _calibration(folder: Path) -> None:
    journal = Journal(folder / "searches.jsonl", {})
    if "start 0" in journal:
        found = journal.read("start 0", partial(SearchResult.from_json, start=START))
        assert np.all(np.isfinite(found.z + found.error))


@cache
def _fit() -> Any:
    return recalibrate(prepared(Drive({"lag": 0.05})))


def _fits(folder: Path) -> None:
    problem, base = _fit()
    kept = FitCache(problem.plant, Journal(folder / "fits.jsonl", {}))
    evaluate(problem, kept("base", lambda: [base]))


@cache
def _state() -> tuple[Any, bytes]:
    env = gymnasium.make("EPValve-v0")
    env.reset(seed=0)
    return env, save_state(env).to_bytes()


def _restore(folder: Path) -> None:
    env, _ = _state()
    restore_state(env, SavedState.from_bytes(read_bytes(folder / "state")))
    observation, reward, *_ = env.step(1)
    assert np.all(np.isfinite([*observation, reward]))


def _measured(dialect: str) -> Use:
    return lambda folder: DIALECTS[dialect](folder / "run", switching())


def _imported(name: str) -> Use:
    return lambda folder: read_files([folder / name], ambient_bar=1.0)


MAPPING = {
    "format": "epv-mapping/1", "environment": {"temperature_K": 293.0, "pressure_bar": 1.0},
    "channels": {"p2": {"source": "P2_raw", "unit": "mbar gauge", "factor": 1.0}},
    "recordings": {"a.mf4": {"role": "calibration", "name": "test1"}},
}  # fmt: skip

_campaign = partial(write_campaign, campaign_of(switching()))

FORMATS: dict[str, tuple[Use, Use]] = {
    "plant.json": (lambda folder: save_plant(_diagnosed(), folder / "plant.json"), _plant),
    "next.json": (
        lambda folder: save_programmes(REPORT_SUITE, folder / "next.json"),
        lambda folder: load_programmes(folder / "next.json"),
    ),
    FILE_NAME: (_campaign, read_campaign),
    "test1.csv": (_campaign, read_campaign),
    "mapping.json": (
        _json(MAPPING, "mapping.json"),
        lambda folder: read_mapping(folder / "mapping.json"),
    ),
    CONTRACT_FILE: (_policy, _decide),
    WEIGHTS_FILE: (_policy, _decide),
    "recording.csv": (
        _table,
        lambda folder: read_columns(
            "recording.csv", read_bytes(folder / "recording.csv"), REQUIRED_COLUMNS
        ),
    ),
    "log.json": (_log, _openings),
    "drive-1.csv": (_log, _openings),
    "monitor.json": (lambda folder: white_model().save(folder / "monitor.json"), _monitor),
    "tuned.json": (
        lambda folder: save_tunings(load_tunings(), folder / "tuned.json", load_search()),
        lambda folder: load_tunings(folder / "tuned.json"),
    ),
    "checkpoints/0000001024.safetensors": (_checkpoint, _resume),
    VALIDATION_FILE: (
        lambda folder: (folder / VALIDATION_FILE).write_text(f"{','.join(ROW)}\n1,2,3,4,5,6,7\n"),
        _validation,
    ),
    CONFIG: (_trained, _config),
    GAP: (_gap, diagnosis_text),
    "batches.jsonl": (_batches, _comparison),
    "searches.jsonl": (_searches, _calibration),
    "fits.jsonl": (_fits, _fits),
    "state": (lambda folder: (folder / "state").write_bytes(_state()[1]), _restore),
    "run.csv": (lambda folder: text(folder / "run.csv", columns_of(switching())), _imported("run.csv")),
    "run.mf4": (_measured("MDF 4"), _imported("run.mf4")),
    "run.mat": (_measured("MATLAB 5"), _imported("run.mat")),
    "run.tdms": (_measured("TDMS"), _imported("run.tdms")),
    "run.parquet": (_measured("Parquet"), _imported("run.parquet")),
}
"""By the file's name: what fills a folder with a good one, and how it is used."""


@cache
def good(name: str) -> dict[str, bytes]:
    """The files of a folder with a good file of this name, by their path; the file is used once."""
    write, use = FORMATS[name]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write(folder)
        use(folder)
        paths = [path for path in folder.rglob("*") if path.is_file()]
        return {str(path.relative_to(folder)): path.read_bytes() for path in paths}
