"""Every command, and every report, ends with a command that can be pasted."""

import html
import importlib
import json
import re
import shlex
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")
from epv_env.common.command_line import NextStep
from epv_env.common.commands import commands
from epv_env.common.options import parse
from identification.gap.judge.verdict import AMBIGUOUS, KNOWN, NO_GAP, PARTIAL, UNKNOWN
from identification.report.page import write_page
from training.epv import PACKAGES

pytestmark = pytest.mark.training
COMMANDS = commands(PACKAGES)
VERDICTS = {
    NO_GAP: "train", KNOWN: "train", PARTIAL: "train", AMBIGUOUS: "bench", UNKNOWN: "gap",
}  # fmt: skip
ENDED = {
    "bench --out 'my bench'": "run",
    "bench --out next --programme next.json --plant valve.json": "run",
    "compare --controllers PWM PPO=policy": "sweep",
    "compare --quick": "sweep",
    "export policy --out c": "export",
    "export plant --out fmu --plant valve.json": "export",
    **{f"gap campaign --out {verdict} --plant valve.json": name for verdict, name in VERDICTS.items()},
    "import a.csv --out campaign --plant valve.json": "run",
    "log --out log": "monitor",
    "monitor log --out monitor": "monitor",
    "run campaign --out results": "gap",
    "run campaign --out results --stage quality --seed 3": "run",
    "sim-to-real --out loop": "compare",
    "sweep": "train",
    "sweep --controllers PWM PPO=policy": "export",
    "train": "compare",
    "train --quick": "train",
    "tune --out tuned.json --only PWM": "compare",
    "watch": "compare",
    "watch PWM --plant valve.json": "compare",
}
"""The next command's name after each line, in a folder that holds the policy `policy`."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = {f"{verdict}/gap.json": json.dumps({"verdict": verdict}) for verdict in VERDICTS}
    for file, text in {"policy/policy.json": "{}", **files}.items():
        Path(file).parent.mkdir()
        Path(file).write_text(text)


def test_every_command_is_here():
    assert {line.split()[0] for line in ENDED} == set(COMMANDS)


@pytest.mark.parametrize("line", ENDED)
def test_the_next_command_is_accepted(line, folder):
    name, *words = shlex.split(line)
    module = importlib.import_module(COMMANDS[name])
    program, following, *arguments = shlex.split(module.next_step(parse(module, name, words)).command())
    assert (program, following) == ("epv", ENDED[line])
    parse(importlib.import_module(COMMANDS[following]), following, arguments)


def test_a_report_ends_with_the_next_command(tmp_path):
    step = NextStep("to go on", ("gap", "my campaign", "--out", "gap"))
    write_page(tmp_path / "page.html", title="Page", sections=[], next_step=step)
    (line,) = re.findall(r"<pre>(.*)</pre>", (tmp_path / "page.html").read_text())
    assert html.unescape(line) == "epv gap 'my campaign' --out gap"
