"""Regret is the difference to the bound in the same episodes, with its interval."""

import json
from dataclasses import fields

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("optuna")

from training import regret
from training.evaluation.metrics import EpisodeMetrics

pytestmark = pytest.mark.training


def metrics(**own):
    """Twelve episodes whose figures are all 1 but for `own`."""
    columns = {entry.name: np.ones(12) for entry in fields(EpisodeMetrics)}
    return EpisodeMetrics(**{**columns, "stayed": np.ones(12, dtype=bool), **own})


def test_the_table_shows_what_each_loses_and_ranks_by_the_return():
    spread = np.linspace(-1, 1, 12)
    found = {
        "bound": metrics(episode_return=-100.0 + spread),
        "poor": metrics(episode_return=-120.0 + 2 * spread, rms_bar=np.full(12, 1.1)),
        "good": metrics(episode_return=-105.0 + spread, stayed=np.arange(12) > 1),
    }
    table = regret.regret_table(found, "bound")
    assert list(table["controller"]) == ["good", "poor"]
    assert list(table["return lost"]) == pytest.approx([5.0, 20.0])
    assert list(table["rms error [mbar]"]) == pytest.approx([0.0, 100.0])
    assert list(table["left"]) == [2, 0]
    poor = table.iloc[1]
    assert poor["return lost, low"] < 20 < poor["return lost, high"]
    assert table.iloc[0]["return lost, low"] == pytest.approx(5.0)  # the same in every episode


def test_the_command_in_its_shortest_form(tmp_path, capsys):
    arguments = ["--quick", "--workers", "1", "--out", str(tmp_path)]
    assert regret.main(arguments) == 0
    content = json.loads((tmp_path / "regret.json").read_text())
    assert [row["controller"] for row in content["rows"]] == ["pulse"]
    assert "| pulse | 0 |" in capsys.readouterr().out
    before = (tmp_path / "blocks.jsonl").read_text()
    assert regret.main(arguments) == 0
    assert (tmp_path / "blocks.jsonl").read_text() == before  # nothing is run again


def test_a_row_of_the_page_has_every_figure():
    table = pd.DataFrame(
        [
            {"controller": "a", "left": 1}
            | {
                f"{figure.heading}{end}": 1.5
                for figure in regret.FIGURES
                for end in ("", ", low", ", high")
            }
        ]
    )
    row = regret.as_markdown(table).splitlines()[-1]
    assert row == "| a | 1 |" + " 1.5 (1.5 to 1.5) |" * len(regret.FIGURES)
