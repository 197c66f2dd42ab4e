"""Identify the valve from a campaign: plant.json and report.html, or one stage of them.

The stages are data quality, sensitivity, calibration, confidence and validation. Finished searches are
kept in the folder of results, so that stages which are run one by one share them.
"""

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from epv_env.common.command_line import NextStep, beside
from epv_env.common.options import Count, Folder, PlantFile, Seed
from epv_env.plant.plantfile import load_plant
from identification.calibration.calibrate import STARTS
from identification.pipeline import run as pipeline
from identification.pipeline.identification import Identification, summary_section
from identification.pipeline.run import STAGES
from identification.recordings.campaign_files import read_campaign
from identification.recordings.recording import campaign_facts, rules_of
from identification.report.page import as_text, write_results

JOURNAL = "searches.jsonl"
"""File of the finished searches in the folder of results."""


@dataclass(frozen=True)
class Options:
    """The campaign, the folder of results, the stage, the seed and the number of starts."""

    campaign: Annotated[str, "folder with campaign.json and the recordings (docs/reference/files.md)"]
    _: KW_ONLY
    out: Folder
    stage: Annotated[
        str | None,
        {"choices": [stage.name for stage in STAGES]},
        "write the page and the JSON file of this stage only "
        f"({'; '.join(f'{stage.name}: {stage.help}' for stage in STAGES)})",
    ] = None
    plant: Annotated[
        PlantFile, "plant file of another valve than the report's, as its data sheet has it"
    ] = None
    seed: Annotated[Seed, "of starts, draws and resampling"] = 0
    starts: Annotated[Count, "searches of each method"] = STARTS


def run(options: Options) -> None:
    """Run all stages on the campaign, or one. Raises CampaignError."""
    plant = load_plant(options.plant) if options.plant else None
    campaign = read_campaign(options.campaign, rules_of(load_plant(options.plant)))
    identification = Identification(
        campaign, options.out / JOURNAL, plant=plant, seed=options.seed, starts=options.starts
    )
    if options.stage:
        _run_stage(options, identification)
        return
    pipeline.run(identification, options.out, next_step(options))
    print(as_text([summary_section(identification)]))
    print(f"written: {options.out / pipeline.PLANT_FILE}, {options.out}/report.html and report.json")


def next_step(options: Options) -> NextStep:
    """Diagnose what the model lacks; after one stage, run them all with the same searches."""
    if options.stage:
        same = ("--seed", options.seed, "--starts", options.starts)
        words = ("run", options.campaign, "--out", options.out, *same)
        return NextStep("to run all stages and write plant.json", words, options.plant)
    words = ("gap", options.campaign, "--out", beside(options.out, "gap"))
    return NextStep("to find out what the model lacks", words, options.plant)


def _run_stage(options: Options, identification: Identification) -> None:
    stage = next(stage for stage in STAGES if stage.name == options.stage)
    sections, content = stage.compute(identification)
    write_results(
        options.out,
        stage.name,
        content,
        title=f"{stage.name}: {options.campaign}",
        sections=sections,
        facts=campaign_facts(identification.campaign),
        next_step=next_step(options),
    )
    print(as_text(sections))
    print(f"\nwritten: {options.out / stage.name}.html and .json")
