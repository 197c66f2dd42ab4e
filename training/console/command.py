"""The console command `epv`: every command of the project by one name.

epv                    lists the commands
epv train --quick      does what python training/train_ppo.py --quick does
epv run CAMPAIGN ...   does what python -m identification run CAMPAIGN ... does
"""

import difflib
import importlib
import sys
from collections.abc import Sequence
from typing import NamedTuple

from epv_env.common.command_line import fail_clearly
from epv_env.common.extras import missing_package

IDENTIFICATION = "identification.__main__"


class Entry(NamedTuple):
    """One command. Its module is imported only when it is called: some need packages of an extra."""

    module: str
    """Whose `main` takes the command's arguments."""
    help: str
    """What it does, in one line."""


COMMANDS: dict[str, Entry] = {
    "train": Entry("training.train_ppo", "train a policy and compare it with classic controllers"),
    "compare": Entry("training.compare", "compare all controllers on the same unseen episodes"),
    "benchmark": Entry(
        "training.benchmark", "train the algorithms of stable-baselines3, and score them"
    ),
    "regret": Entry("training.regret", "what controllers lose against the causal bound"),
    "hard-scenarios": Entry("training.hard_scenarios", "controllers on scenarios beyond training"),
    "sweep": Entry("training.sweep", "robustness against parameters, effects and conditions"),
    "tune": Entry("training.tune", "search the classic controllers' settings"),
    "tradeoff": Entry("training.tradeoff", "optimise controllers at several prices of switching"),
    "timing": Entry("training.timing", "time of a decision against the control period"),
    "bode": Entry("training.bode", "Bode diagram of the PWM controller's loop"),
    "export": Entry("training.export", "turn a policy into C and ONNX"),
    "export-fmu": Entry("training.export_fmu", "turn the plant or a policy into an FMU"),
    "sim-to-real": Entry("training.sim_to_real", "train, deploy, diagnose, retrain, deploy again"),
    "bench": Entry(IDENTIFICATION, "write a campaign of a virtual bench whose truth is known"),
    "import": Entry(IDENTIFICATION, "turn measurement files into a campaign"),
    "run": Entry(IDENTIFICATION, "all stages of the identification: plant.json and report.html"),
    "gap": Entry(IDENTIFICATION, "which effect explains what the model misses"),
    "blind": Entry(IDENTIFICATION, "how often the diagnosis is right on hidden causes"),
}
"""Every command, in the order of the list that `epv` prints."""


def overview() -> str:
    """The list of commands."""
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {entry.help}" for name, entry in COMMANDS.items()]
    return "\n".join(
        ["usage: epv COMMAND [options]", "", *lines, "", "epv COMMAND --help lists its options"]
    )


def run(arguments: Sequence[str]) -> int:
    """Run one command; returns the exit status. Raises ValueError for an unknown one."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print(overview())
        return 0
    name, *rest = arguments
    entry = COMMANDS.get(name)
    if entry is None:
        close = difflib.get_close_matches(name, COMMANDS, n=1)
        hint = f"did you mean {close[0]!r}?" if close else "`epv` lists them"
        raise ValueError(f"there is no command {name!r}: {hint}")
    sys.argv[0] = "epv" if entry.module == IDENTIFICATION else f"epv {name}"  # argparse shows it
    own = arguments if entry.module == IDENTIFICATION else rest
    try:
        return importlib.import_module(entry.module).main(list(own))
    except ModuleNotFoundError as error:
        extra = entry.module.partition(".")[0]  # named as the folder
        sentence = missing_package(error.name or "", preferred=extra)
        if sentence is None:
            raise
        raise ValueError(f"epv {name}: {sentence}") from None


def main() -> int:
    """The entry point of the console script."""
    return fail_clearly(lambda: run(sys.argv[1:]))


if __name__ == "__main__":
    sys.exit(main())
