"""Every purpose has episodes of its own: what the commands use ends before the next purpose begins."""

from itertools import pairwise

import pytest

pytest.importorskip("stable_baselines3")

from controllers.hysteresis import Hysteresis
from epv_env.plant.plantfile import Plant
from training import benchmark, compare, export, sweep
from training.deploy.settings import SETTINGS
from training.evaluation import seeds
from training.learners.distillation import Distillation
from training.learners.hyperparameters import Hyperparameters
from training.studies.comparison.contenders import TUNING, Contender, Sizes
from training.studies.comparison.episode_blocks import plan
from training.studies.sweeps.episode_plan import Size, cells, chosen_points, searches
from training.studies.sweeps.worst_case_search import Effort

pytestmark = pytest.mark.training

Span = tuple[int, int]
"""First seed, and the one after the last."""


def joined(*spans: Span) -> Span:
    firsts, ends = zip(*spans, strict=True)
    return min(firsts), max(ends)


def compared() -> dict[str, Span]:
    """The blocks of a whole comparison, with those on which one of the training seeds is chosen."""
    chosen = compare.parse([])
    runs = {f"{k}": Hysteresis(open_below=-0.1, shut_above=0.0) for k in range(2)}
    sizes = Sizes(named=chosen.named, random=chosen.random, bound=chosen.bound, tuning=chosen.tuning)
    blocks = plan([Contender(name="PPO", runs=runs, learned=True)], chosen.scenarios, sizes)
    spans = [(TUNING in b.scenarios, (b.first_seed, b.first_seed + b.count)) for b in blocks]
    return {
        "tuning": joined(*(span for tuned, span in spans if tuned)),
        "evaluation": joined(*(span for tuned, span in spans if not tuned)),
    }


def swept() -> Span:
    """The batches and searches of a whole sweep."""
    chosen = sweep.parse([])
    effort = Effort(screened=chosen.screened, generations=chosen.generations)
    size = Size(episodes=chosen.episodes, joint_episodes=chosen.joint_episodes, effort=effort)
    plant = Plant.calibrated()
    points = chosen_points(plant, chosen.designs, chosen.factors, size, chosen.seed)
    batches = [batch for cell in cells(points, ["any"], size, chosen.seed) for batch in cell.batches]
    hunts = searches(plant, ["any"], size, chosen.seed)
    return joined(
        *((batch.first_seed, batch.first_seed + batch.episodes) for batch in batches),
        *((hunt.first_seed, hunt.first_seed + 2 * effort.screened) for hunt in hunts),
    )


def used() -> dict[str, Span]:
    """The seeds that the commands use by default, by purpose."""
    h, d, chosen = Hyperparameters(), Distillation(), compare.parse([])
    exported = export.parse(["policy", "--out", "ecu"])
    trained = chosen.seeds * h.num_envs
    counted = {
        "training": (seeds.TRAINING_SEED, trained),
        "validation": (seeds.VALIDATION_SEED, max(h.validation_episodes, d.validation_episodes)),
        "distillation": (seeds.DISTILLATION_SEED, chosen.recurrent_seeds * d.rounds * d.episodes),
        "calibration": (seeds.CALIBRATION_SEED, SETTINGS.episodes),
        "states": (seeds.STATES_SEED, SETTINGS.episodes),
        "closed loop": (seeds.CLOSED_LOOP_SEED, exported.episodes),
        "timing": (seeds.TIMING_SEED, 1),
        "benchmark": (seeds.BENCHMARK_SEED, benchmark.parse([]).episodes),
    }
    spans = {purpose: (first, first + count) for purpose, (first, count) in counted.items()}
    return {**spans, **compared(), "sweep": swept()}


def shared(spans: dict[str, Span]) -> list[tuple[str, str]]:
    """Purposes of which one begins before the other has ended."""
    ordered = sorted(spans, key=lambda purpose: spans[purpose])
    return [(a, b) for a, b in pairwise(ordered) if spans[a][1] > spans[b][0]]


def test_no_purpose_meets_anothers_episodes():
    assert shared(used()) == []


def test_episodes_that_two_purposes_meet_are_seen():
    begin, end = used()["sweep"]
    back = seeds.SWEEP_SEED - seeds.VALIDATION_SEED
    assert shared({**used(), "sweep": (begin - back, end - back)}) == [("validation", "sweep")]
    assert shared({**used(), "training": (0, seeds.TUNING_SEED + 1)}) == [("training", "tuning")]


def test_every_first_seed_is_where_a_purpose_begins():
    firsts = sorted(seed for name, seed in vars(seeds).items() if name.endswith("_SEED"))
    assert sorted(begin for begin, _ in used().values()) == firsts
    assert min(b - a for a, b in pairwise(firsts)) >= 1_000_000


def test_a_training_seed_that_would_meet_the_tuning_is_refused():
    assert seeds.training_seeds(3, 256) == range(768, 1024)
    assert seeds.training_seeds(3905, 256)[-1] < seeds.TUNING_SEED
    with pytest.raises(ValueError, match=r"training seed 3906 .* give one up to 3905"):
        seeds.training_seeds(3906, 256)


def test_a_distillation_that_would_meet_the_sweeps_is_refused():
    assert seeds.distillation_seeds(2, 100)[0] == seeds.DISTILLATION_SEED + 200
    with pytest.raises(ValueError, match=r"training seed 10 .* give one up to 9"):
        seeds.distillation_seeds(10, 100_000)


def test_a_sweep_that_would_meet_the_exports_episodes_is_refused(capsys):
    assert sweep.parse(["--seed", "995904"]).seed == 995904
    with pytest.raises(SystemExit):
        sweep.parse(["--seed", "995905"])
    assert "with 4096 episodes give one up to 995904" in capsys.readouterr().err
