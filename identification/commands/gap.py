"""Which effect causes the gap between model and recordings.

The guide is docs/how-to/diagnose-a-gap.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any

from epv_env.common.command_line import NextStep
from epv_env.common.files import decoded
from epv_env.common.options import Folder, PlantFile, Seed
from identification.gap.diagnosis import Diagnosis
from identification.gap.report.gap_json import GAP as GAP_FILE
from identification.gap.report.sentences import verdict_sentence
from identification.valve_gap import diagnose, operation


@dataclass(frozen=True)
class Options:
    """What is diagnosed, the nominal model, the catalogue, and where the results go."""

    campaign: Annotated[Path, "folder with campaign.json or log.json (docs/reference/files.md)"]
    _: KW_ONLY
    logs: Annotated[bool, "the folder holds the log of a control unit, not a campaign"] = False
    out: Folder
    seed: Annotated[Seed, "of resampling"] = 0
    plant: Annotated[PlantFile, "plant file of the nominal model; default: Table 10"] = None
    without: Annotated[
        Sequence[str], {"action": "append", "metavar": "CAUSE"}, "leave out of the catalogue"
    ] = ()
    controller: Annotated[
        str | None, "that wrote the log, as `epv compare` takes them: report what the gap costs it"
    ] = None


def run(
    options: Options, sections: Callable[[Path, Path | None, str], diagnose.More] | None = None
) -> None:
    """Diagnose the campaign, and say what the verdict means. Raises ValueError.

    sections: about the controller of a log with a plant file.
    """
    read: Callable[..., Diagnosis] = (
        operation.diagnose_log if options.logs else diagnose.diagnose_campaign
    )
    about: dict[str, Any] = {name: getattr(options, name) for name in ("plant", "without", "seed")}
    if options.controller is not None:
        if not (options.logs and sections):
            raise ValueError("--controller is of `epv gap LOGS --logs`: no other command knows it")
        about["more"] = sections(options.campaign, options.plant, options.controller)
    found = read(options.campaign, options.out, **about)
    say(found, options.out)
    written = (diagnose.REPORT, GAP_FILE, diagnose.PLANT)
    print(f"written: {', '.join(str(options.out / name) for name in written)}")


def next_step(options: Options) -> NextStep:
    """What the verdict in the folder of results asks for."""
    verdict = decoded(options.out / GAP_FILE, remedy="diagnose again")["verdict"]
    after = operation.next_step if options.logs else diagnose.next_step
    return after(verdict, options.campaign, options.out, options.plant)


def say(found: Diagnosis, out: Path) -> None:
    """Print what the verdict means, and what to record next."""
    content = decoded(out / GAP_FILE, remedy="diagnose again")
    print(verdict_sentence(found)[1])
    if content["next_experiment"]:
        print(content["next_experiment"])
