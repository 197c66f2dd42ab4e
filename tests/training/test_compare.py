"""The comparison's command in its short form, its plan, its criteria, and its generated pages."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

pytest.importorskip("pandas")
pytest.importorskip("joblib")
pytest.importorskip("stable_baselines3")
import matplotlib.pyplot as plt

from controllers.hysteresis import Hysteresis
from controllers.oracle import Oracle
from controllers.supervised import SupervisorFile, save_settings
from controllers.supervisor_settings import SETTINGS
from epv_env.plant.consumption import MIXED
from epv_env.plant.plantfile import Plant
from epv_env.reward import RewardWeights
from tests.training.policies import random_layers, write_policy
from training.compare import limit_at_least_price, main, parse
from training.evaluation.controller_table import PLANTS
from training.evaluation.metrics import EpisodeMetrics
from training.evaluation.scenarios import EVALUATION, RANDOM, TUNING_REGION
from training.learners.policy_files import save_policy
from training.learners.student import END_TO_END_NAME, NAME, Student, policy_of
from training.studies.comparison.acceptance_criteria import (
    against_oracle,
    against_rival,
    lost_to_model_based,
    violation_criterion,
)
from training.studies.comparison.comparison_figures import trade_off_figure
from training.studies.comparison.comparison_report import PARTS, RESULTS_FILE, TABLES_FILE
from training.studies.comparison.contenders import (
    EXPENSIVE,
    TUNING,
    Contender,
    Expense,
    Sizes,
    chosen_run,
)
from training.studies.comparison.episode_blocks import joined_results, plan
from training.studies.comparison.score_tables import (
    ComparisonResults,
    figures,
    paired_comparisons,
    seed_differences,
    trade_off,
)
from training.studies.episode_tasks import Study
from training.studies.generated_pages import check_pages, fill, markdown
from training.studies.result_files import records
from training.tradeoff import variant

pytestmark = pytest.mark.training

SIZES = Sizes(named=10, random=20, bound=1000, tuning=5)
FIGURES = (
    "results.json", "tables.md", "excursions.png", "episode.png", "tradeoff.png",
    "comparison-scenarios.png", "comparison-means.png", "comparison-paired.png",
)  # fmt: skip


@dataclass
class Told(Hysteresis):
    """A controller that is shown the plant."""

    def watch(self, task):
        self.task = task


def controller(name, kind=Hysteresis):
    return kind(open_below=-0.1, shut_above=0.0, shut_lookahead=0.03, name=name)


def classic(name, kind=Hysteresis):
    return Contender(name=name, runs={name: controller(name, kind)})


def learned(seeds):
    runs = {f"PPO, seed {k}": controller(f"{k}") for k in range(seeds)}
    return Contender(name="PPO", runs=runs, learned=True)


def episodes(n, *, left=0, breakdown=0.3, rms=0.1, switchings=4.0, returned=-10.0):
    """n episodes whose figures are all the same, but that some left the band."""
    stayed = np.arange(n) >= left
    same = {f: np.zeros(n) for f in EpisodeMetrics.__dataclass_fields__}
    return EpisodeMetrics(
        **{
            **same, "stayed": stayed, "excursion_bar": np.where(stayed, breakdown, 0.7),
            "breakdown_bar": np.full(n, breakdown), "rms_bar": np.full(n, rms),
            "switchings_per_s": np.full(n, switchings), "episode_return": np.full(n, returned),
        }
    )  # fmt: skip


def comparison_of(**figures_of):
    """One classic contender for each name, PPO being the learned one; the same in every plant set."""
    contenders = [
        Contender(name="PPO", runs={"PPO": controller("PPO")}, learned=True) if name == "PPO"
        else classic(name, Told if "oracle" in name else Hysteresis)
        for name in figures_of
    ]  # fmt: skip
    results = {
        (name, plants, scenario): given
        for name, given in figures_of.items()
        for plants in PLANTS
        for scenario in (RANDOM, "steps")
    }
    return ComparisonResults(contenders, [RANDOM, "steps"], results)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("comparison")
    for seed in range(2):
        write_policy(random_layers(seed=seed, widths=(8, 8)), out / "seeds" / f"seed-{seed}")
    for seed in range(3):
        remembers = policy_of(Student(memory=4, width=8))
        folder = out / "memory" / f"seed-{seed}"
        save_policy(remembers, folder, control_period=5e-3, provenance={})
    learned = replace(policy_of(Student(memory=4, width=8)), name=END_TO_END_NAME)
    save_policy(learned, out / "end" / "seed-0", control_period=5e-3, provenance={})
    for seed in range(1, 3):  # settling takes seconds, and one of a kind shows that it is done
        save_settings(SupervisorFile(settings=SETTINGS), out / "memory" / f"seed-{seed}")
    page = out / "page.md"
    page.write_text("before\n<!-- generated: short -->\nold\n<!-- end: short -->\nafter\n")
    arguments = [
        "--quick", "--named", "2", "--random", "8", "--bound", "8", "--duration", "0.55",
        "--scenarios", RANDOM, "steps", "--workers", "1",
        "--out", str(out), "--policies", str(out / "seeds"), "--seeds", "2",
        "--recurrent", str(out / "memory"), "--recurrent-seeds", "3",
        "--end-to-end", str(out / "end"),
        "--pages", str(page), "--images", str(out / "i"),
    ]  # fmt: skip
    assert main(arguments) == 0
    return out, arguments


def test_the_short_form_writes_everything(finished):
    out, _ = finished
    assert {path.name for path in out.iterdir()} >= set(FIGURES)
    assert {path.name for path in (out / "i").iterdir()} == {n for n in FIGURES if n.endswith("png")}
    content = json.loads((out / RESULTS_FILE).read_text())
    names = [row["controller"] for row in content["figures"] if row["plants"] == "calibrated"]
    watched = [f"{END_TO_END_NAME}, supervised", f"{NAME}, supervised"]
    alone = [END_TO_END_NAME, NAME, "PPO"]
    several = [watched[1], NAME, "PPO"]
    assert [name for name in names if not name.endswith(", all seeds")][:5] == watched + alone
    assert {f"{name}, all seeds" for name in several} < set(names)
    assert {bar["controller"] for bar in content["bars"]} == {*watched, *alone}
    runs = [f"{watched[0]}, seed 0"] + [f"{watched[1]}, seed {k}" for k in range(3)]
    assert [row["run"] for row in content["seeds"]] == runs
    assert "hysteresis, extrapolating" in names
    assert content["chosen"]["PPO"] in ("PPO, seed 0", "PPO, seed 1")
    assert all(f"# {part}\n" in (out / TABLES_FILE).read_text() for part in PARTS)


def test_the_page_holds_the_table_between_its_markers(finished):
    text = (finished[0] / "page.md").read_text()
    assert text.startswith("before\n<!-- generated: short -->\n| ")
    assert text.endswith("|\n<!-- end: short -->\nafter\n")
    assert "old" not in text


def test_a_second_run_takes_what_is_there_and_says_the_same(finished, monkeypatch):
    """It draws the same, too; that takes long and is left out here."""
    monkeypatch.setattr("training.compare.write_figures", lambda *_, **__: None)
    out, arguments = finished
    before = {name: (out / name).read_bytes() for name in (RESULTS_FILE, "blocks.jsonl", "page.md")}
    assert main(arguments) == 0
    assert {name: (out / name).read_bytes() for name in before} == before


def test_each_seed_is_set_against_the_rival_in_the_same_episodes():
    """In half of the episodes the rival's rms error is 20 mbar larger, and it leaves in three."""
    own = replace(episodes(8), rms_bar=np.tile([0.08, 0.10], 4))
    c = comparison_of(PPO=own, rival=episodes(10, left=3, rms=0.1))
    (row,) = records(seed_differences(c, c.contenders[0], "rival"))
    assert (row["left"], row["rival_left"], row["episodes"]) == (0, 3, 8)
    assert row["rms_bar"] == pytest.approx(-0.01)
    assert -0.02 <= row["rms_bar_low"] < row["rms_bar"] < row["rms_bar_high"] <= 0.0
    assert row["switchings_per_s"] == row["switchings_per_s_high"] == 0.0


def counted(blocks):
    """Episodes by plant set and scenario."""
    counts = {}
    for block in blocks:
        for scenario in block.scenarios:
            key = block.plants, scenario
            counts[key] = counts.get(key, 0) + block.count
    return counts


def test_the_blocks_hold_as_many_episodes_as_the_sizes_say_in_batches():
    blocks = plan([classic("a")], [RANDOM, "steps"], SIZES)
    assert counted(blocks) == {
        ("calibrated", RANDOM): 20, ("calibrated", "steps"): 10, ("confidence", RANDOM): 1000,
        ("sensitive_ten_percent", RANDOM): 1000, ("sensitive_ten_percent", "steps"): 10,
    }  # fmt: skip
    assert max(block.count for block in blocks) <= 512
    assert len({block.name for block in blocks}) == len(blocks)


def test_scenarios_of_one_supply_and_voltage_run_side_by_side():
    blocks = plan([classic("a")], list(EVALUATION), SIZES)
    alone = {b.scenarios for b in blocks if b.plants == "calibrated" and len(b.scenarios) == 1}
    others = ("compressor off", "low supply", "low target", "low battery", RANDOM)
    assert alone == {(name,) for name in others}
    many = plan([classic("a")], list(EVALUATION), replace(SIZES, named=200))
    assert max(len(b.scenarios) * b.count for b in many) <= 512
    expected = {s: 200 if s != RANDOM else 20 for s in EVALUATION}
    assert {s: n for (p, s), n in counted(many).items() if p == "calibrated"} == expected


def test_an_episode_is_the_same_beside_other_scenarios_as_alone():
    """To the bit; and in which scenario it is matters."""
    tried = ["steps", "leak", "high target"]
    apart = [plan([classic("a")], [name], replace(SIZES, named=3))[0] for name in tried]
    (beside,) = (b for b in plan([classic("a")], tried, replace(SIZES, named=3)) if len(b.scenarios) > 1
                 and b.plants == "calibrated")  # fmt: skip
    study = Study(
        controllers={"a": controller("a")}, plant=Plant.calibrated(), scenario=MIXED, duration=0.8
    )
    together = joined_results([beside], {beside.name: beside.run(study)})
    alone = joined_results(apart, {block.name: block.run(study) for block in apart})
    assert together.keys() == alone.keys()
    returns = {key[2]: found.episode_return.tolist() for key, found in together.items()}
    assert returns == {key[2]: found.episode_return.tolist() for key, found in alone.items()}
    assert returns["steps"] != returns["leak"] != returns["high target"]


def test_every_scenario_can_be_run():
    """Also one whose supply is below the default targets."""
    blocks = plan([classic("a")], list(EVALUATION), replace(SIZES, named=1, random=1, bound=1))
    study = Study(
        controllers={"a": controller("a")}, plant=Plant.calibrated(), scenario=MIXED, duration=0.02
    )
    found = joined_results(blocks, {block.name: block.run(study) for block in blocks})
    assert {scenario for _, _, scenario in found} == set(EVALUATION)
    assert all(len(episodes) == 1 for episodes in found.values())


def test_an_expensive_controller_runs_the_first_of_the_others_episodes(monkeypatch):
    monkeypatch.setitem(EXPENSIVE, "slow", Expense(times=100, fewer=4, random=15))
    (slow, cheap) = (plan([classic(name)], ["steps"], SIZES)[0] for name in ("slow", "a"))
    assert (slow.first_seed, slow.count, cheap.count) == (cheap.first_seed, 3, 10)
    assert slow.episodes == 300  # its cost, in those of a cheap one
    random = counted(plan([classic("slow")], [RANDOM], SIZES))
    assert random == {
        ("calibrated", RANDOM): 15, ("confidence", RANDOM): 250, ("sensitive_ten_percent", RANDOM): 250
    }  # fmt: skip
    few = counted(plan([classic("slow")], [RANDOM], replace(SIZES, random=2)))
    assert few["calibrated", RANDOM] == 2


def test_the_training_seed_is_chosen_on_the_tuning_scenarios_alone():
    both = learned(2)
    results = {
        ("PPO, seed 0", TUNING_REGION, TUNING): episodes(5, returned=-20.0),
        ("PPO, seed 1", TUNING_REGION, TUNING): episodes(5, returned=-10.0),
        ("PPO, seed 0", "calibrated", RANDOM): episodes(5, returned=0.0),
        ("PPO, seed 1", "calibrated", RANDOM): episodes(5, returned=-99.0),
    }
    assert chosen_run(both, results) == "PPO, seed 1"
    left = {("PPO, seed 1", TUNING_REGION, TUNING): episodes(5, returned=-10.0, left=1)}
    assert chosen_run(both, results | left) == "PPO, seed 0"
    assert {block.plants for block in plan([both], [RANDOM], SIZES)} >= {TUNING_REGION}


def test_the_bound_is_met_with_enough_episodes_only():
    enough, few = comparison_of(PPO=episodes(4096)), comparison_of(PPO=episodes(1000))
    assert violation_criterion(enough, enough.contenders[0], "confidence", 1e-3).met
    assert not violation_criterion(few, few.contenders[0], "confidence", 1e-3).met
    once = comparison_of(PPO=episodes(4096, left=1))
    assert not violation_criterion(once, once.contenders[0], "confidence", 1e-3).met


@pytest.mark.parametrize(
    ("rival", "met"),
    [
        ({"breakdown": 0.4, "rms": 0.2}, [True, True]),
        ({"breakdown": 0.2, "rms": 0.2}, [False, True]),
        ({"breakdown": 0.4, "rms": 0.2, "switchings": 3.9}, [False, False]),
    ],
)
def test_a_rival_is_beaten_only_at_equal_or_fewer_switches(rival, met):
    c = comparison_of(PPO=episodes(50), other=episodes(50, **rival))
    assert [criterion.met for criterion in against_rival(c, *c.contenders)] == met


def add_variant(c, price, figures, name="PPO"):
    """A contender at another price of switching."""
    c.variants.append(variant(controller(name), price))
    c.results[f"{name}, price {price:g}", "calibrated", RANDOM] = figures


def test_a_rival_that_switches_less_is_met_at_another_price():
    """By the variant that switches most among those that switch no more; by none where it is worse."""
    c = comparison_of(PPO=episodes(50), other=episodes(50, breakdown=0.4, rms=0.15, switchings=3.0))
    figures_at = {2.0: (2.9, 0.12), 5.0: (1.0, 0.11), 1.0: (3.5, 0.10)}
    for price, (switchings, rms) in figures_at.items():
        add_variant(c, price, episodes(50, switchings=switchings, rms=rms))
    found = list(against_rival(c, *c.contenders))
    assert [(each.controller, each.met) for each in found] == [("PPO, price 2", True)] * 2
    assert "120 against 150 mbar" in found[1].measured
    c.results["PPO, price 2", "calibrated", RANDOM] = episodes(50, switchings=2.9, rms=0.2)
    assert [criterion.met for criterion in against_rival(c, *c.contenders)] == [True, False]


def test_the_oracle_is_a_limit_and_no_rival():
    c = comparison_of(PPO=episodes(50), oracle=episodes(20, breakdown=0.25, rms=0.05))
    assert c.contenders[1].privileged
    assert [criterion.met for criterion in against_oracle(c, *c.contenders)] == [True, False]


def test_what_lies_above_a_panel_of_the_tradeoff_is_named():
    far = episodes(50, breakdown=1.2)
    found = trade_off(comparison_of(PPO=episodes(50), far=far, pulse=episodes(50)), 50)
    figure = trade_off_figure(found)
    plt.close(figure)
    assert [axes.get_title() for axes in figure.axes] == ["above: far", "above: far", ""]


def test_how_near_the_oracle_cheaper_switching_comes_is_said_too():
    c = comparison_of(PPO=episodes(50), oracle=episodes(20, breakdown=0.25, rms=0.05))
    add_variant(c, 2.0, episodes(50, switchings=1.0, rms=0.01))
    add_variant(c, 0.0, episodes(50, switchings=90.0, rms=0.07))
    found = [(each.controller, each.met) for each in against_oracle(c, *c.contenders)]
    assert found == [("PPO", True), ("PPO", False), ("PPO, price 0", True), ("PPO, price 0", True)]
    add_variant(c, 0.0, episodes(20, switchings=90.0, rms=0.01, breakdown=0.1), name="oracle")
    found = [(each.controller, each.met) for each in against_oracle(c, *c.contenders)]
    assert found[4:] == [("PPO, price 0", False), ("PPO, price 0", False)]


def test_the_oracle_is_asked_at_the_least_price_below_the_usual_one():
    own, least = classic("PPO"), [replace(classic("PPO"), price=price) for price in (1.0, 0.1)]
    (limit,) = limit_at_least_price([*least, own])
    oracle = limit.runs["oracle, price 0.1"]
    assert isinstance(oracle, Oracle)
    assert oracle.weights == RewardWeights(switching=0.1)
    assert limit.privileged
    assert limit_at_least_price(least[:1]) == limit_at_least_price([]) == []


def test_where_a_model_based_rival_wins_is_listed():
    c = comparison_of(PPO=episodes(50), MPC=episodes(10, breakdown=0.2))
    found = lost_to_model_based(c, c.contenders[0])
    assert {(row["scenario"], row["figure"]) for row in found} == {
        (RANDOM, "largest breakdown"), ("steps", "largest breakdown"),
    }  # fmt: skip


def test_a_paired_comparison_says_by_how_much_and_how_often():
    c = comparison_of(PPO=episodes(50), other=episodes(10, rms=0.3))
    found = paired_comparisons(c, c.contenders[0]).set_index(["plants", "score"])
    row = found.loc[("calibrated", "rms_bar")]
    assert row["difference"] == pytest.approx(-0.2)
    assert row["better"] == 1.0
    assert found.loc[("calibrated", "episode_return"), "better"] == 0.5


def test_all_seeds_count_beside_the_chosen_one():
    both = learned(2)
    results = {
        (f"PPO, seed {k}", plants, RANDOM): episodes(10, left=k)
        for k in range(2)
        for plants in (*PLANTS, TUNING_REGION)
    }
    results |= {(run, TUNING_REGION, TUNING): episodes(2) for run in both.runs}
    table = figures(ComparisonResults([both], [RANDOM], results))
    rows = table.loc[table["plants"] == "calibrated"].set_index("controller")
    assert rows.loc["PPO", "C1_stayed"] == 1.0
    assert rows.loc["PPO, all seeds", "C1_stayed"] == pytest.approx(19 / 20)


def test_a_dominated_controller_is_off_the_front():
    c = comparison_of(
        good=episodes(9), worse=episodes(9, rms=0.2, breakdown=0.4), fast=episodes(9, switchings=1.0),
        oracle=episodes(9, switchings=0.5, rms=0.01),
    )  # fmt: skip
    found = trade_off(c, 5).set_index("controller")
    assert found["rms_error_bar_on_front"].to_dict() == {
        "good": False, "worse": False, "fast": True, "oracle": False,
    }  # fmt: skip
    assert set(found["episodes"]) == {5}


def test_pages_that_cannot_be_filled_are_refused(tmp_path):
    page = tmp_path / "page.md"
    for text, words in (
        ("plain", "asks for none of the parts"),
        ("<!-- generated: nonsense -->\n<!-- end: nonsense -->", "asks for none of the parts"),
        ("<!-- generated: short -->", "add it"),
    ):
        page.write_text(text)
        with pytest.raises(ValueError, match=words):
            check_pages([page], PARTS)
    with pytest.raises(ValueError, match="no page"):
        check_pages([tmp_path / "none.md"], PARTS)


def test_filling_a_page_twice_changes_nothing(tmp_path):
    page = tmp_path / "page.md"
    others = "<!-- generated: of another command -->\nx\n<!-- end: of another command -->\n"
    page.write_text(f"a\n<!-- generated: short -->\n<!-- end: short -->\nb\n{others}")
    parts = {"short": markdown(["x"], [["1"]])}
    fill(page, parts)
    once = page.read_text()
    fill(page, parts)
    written = "a\n<!-- generated: short -->\n| x |\n| --- |\n| 1 |\n<!-- end: short -->\nb\n"
    assert page.read_text() == once == written + others


@pytest.mark.parametrize(
    "arguments", [["--duration", "0"], ["--scenarios", "steps"], ["--scenarios", "flood"]]
)
def test_wrong_options_are_refused(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        parse(arguments)
    assert stop.value.code == 2
    assert arguments[0] in capsys.readouterr().err
