"""Commands that the pages show, and the tests that run each of them in a short form."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]

SHORT_FORMS: dict[str, str] = {
    "python -m identification bench": "tests/identification/test_commands.py",
    "python -m identification import": "tests/identification/importing",
    "python -m identification run": "tests/identification/test_commands.py",
    "python -m identification gap": "tests/identification/valve_gap/test_diagnose.py",
    "python -m identification blind": "tests/identification/blind/test_command.py",
    "python -m docs.examples.tank": "tests/test_tank_example.py",
    "python -m docs.examples.thermal_lab": "tests/test_recorded_examples.py",
    "python -m docs.examples.toy_car": "tests/test_recorded_examples.py",
    "python -m docs.examples.research.cleanrl_style": "tests/test_research_examples.py",
    "python -m docs.examples.research.sb3_contrib": "tests/test_research_examples.py",
    "python -m docs.examples.research.tianshou_dqn": "tests/test_research_examples.py",
    "python -m docs.examples.research.torchrl_ppo": "tests/test_research_examples.py",
    "python -m docs.examples.pendulum": "tests/test_recorded_examples.py",
    "python -m docs.studies.reproduction.study": "tests/studies/test_reproduction.py",
    "python -m docs.studies.coverage.study": "tests/studies/test_coverage.py",
    "python docs/scripts/film.py": "tests/test_docs.py",
    "python training/compare.py": "tests/training/test_compare.py",
    "python training/sweep.py": "tests/training/test_sweep.py",
    "python training/train_ppo.py": "tests/training/test_commands.py",
    "epv": "tests/test_fuzzing.py",
    "epv compare": "tests/training/test_compare.py",
    "epv export": "tests/training/test_export.py",
    "epv sim-to-real": "tests/training/test_sim_to_real.py",
    "epv sweep": "tests/training/test_sweep.py",
    "epv tune": "tests/training/test_tune.py",
    "python -m docs.studies.comparison.study": "tests/training/test_studies.py",
    "python -m docs.studies.robustness.study": "tests/training/test_studies.py",
    "python -m docs.studies.sim_to_real.study": "tests/training/test_studies.py",
    "python -m training.epv": "tests/training",
    "python -m mkdocs": "tests/test_docs.py",
    "tensorboard": "tests/training/test_tracking.py",
    "cc": "tests/training/test_export.py",
    "fmpy": "tests/training/fmu/test_archive.py",
    "./parity": "tests/training/test_export.py",
    "./bench": "tests/training/test_export.py",
}
"""Test file or folder by the words that a command begins with; the longest beginning counts."""

NOT_RUN: dict[str, str] = {
    "python -m pytest": "it is the suite",
    "python -m tests.benchmarks": "measurements; they need a quiet machine",
    "python -m venv": "installation: the suite runs in its result",
    "python3 -m venv": "installation: the suite runs in its result",
    "python -m pip": "installation: the suite runs in its result",
    "pip install": "installation: the suite runs in its result",
    ".": "activates the environment",
    "cd": "changes the folder",
    "unzip": "the tests of FMUs unpack them with Python",
    "python -m ruff": "part of `make check`",
    "python -m pyright": "part of `make check`",
}
"""Why a command has no short form, by the words that it begins with."""


def shell_blocks(text: str) -> Iterator[str]:
    """The `sh` blocks of a page, without their indentation."""
    for block in re.findall(r"^ *```sh\n(.*?)^ *```", text, re.S | re.M):
        yield re.sub(r"^ +", "", block, flags=re.M)


def commands(shell: str) -> list[list[str]]:
    """The commands of shell lines as lists of words, without comments and assignments."""
    found = []
    for line in shell.replace("\\\n", " ").splitlines():
        for part in line.split("#")[0].split("&&"):
            words = shlex.split(part)
            while words and re.fullmatch(r"\w+=\S*", words[0]):
                words.pop(0)
            if words and words[0].startswith(".venv"):
                words[0] = Path(words[0]).name
            if words:
                found.append(words)
    return found


def recipe(target: str) -> str:
    """The lines of a target of the Makefile and of the targets that it needs, variables filled in.

    Raises KeyError if there is no such target.
    """
    text = (ROOT / "Makefile").read_text(encoding="utf-8").replace("\\\n", " ")
    variables = dict(re.findall(r"^(\w+) :?\??= ?(.*)$", text, re.M))
    rules = {
        name: (needs.split(), body)
        for name, needs, body in re.findall(r"^([a-z][a-z-]*%?):([^#\n]*).*\n((?:\t.*\n?)*)", text, re.M)
    }
    study = target.removeprefix("study-")
    needs, body = rules[target if study == target else "study-%"]
    body = body.replace("$*", study)
    for _ in range(3):  # a variable may hold another one
        body = re.sub(r"\$\((\w+)\)", lambda found: variables.get(found[1], ""), body)
    needed = "\n".join(recipe(name) for name in needs if name in rules)
    return needed + "\n" + re.sub(r"^\t[@-]?", "", body, flags=re.M)


def beginning(words: list[str]) -> str | None:
    """The longest entry of SHORT_FORMS or NOT_RUN that the command begins with.

    An entry that ends in an option counts if the command has that option anywhere.
    """
    entries = sorted({**SHORT_FORMS, **NOT_RUN}, key=lambda entry: -len(entry.split()))
    for entry in entries:
        wanted = entry.split()
        options = [word for word in wanted if word.startswith("--")]
        plain = [word for word in wanted if word not in options]
        if words[: len(plain)] == plain and set(options) <= set(words):
            return entry
    return None
