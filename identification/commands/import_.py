"""Turn measurement files (MDF, MATLAB, TDMS, Parquet, CSV) into a campaign.

The guide is docs/how-to/use-your-recordings.md.
"""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from epv_env.common.command_line import NextStep
from epv_env.common.options import Folder, Number, PlantFile
from epv_env.plant.plantfile import load_plant
from identification.commands import bench
from identification.importing.import_campaign import (
    import_text,
    read_files,
    read_source,
    source_table,
)
from identification.importing.mapping_file import MappingFile, read_mapping
from identification.recordings.campaign_files import check_campaign, check_vacant, write_campaign
from identification.recordings.recording import rules_of


@dataclass(frozen=True)
class Options:
    """The files, the mapping and the ambient conditions."""

    files: Annotated[
        Sequence[Path], {"nargs": "+", "metavar": "FILE"}, "MDF, MATLAB, TDMS, Parquet or text files"
    ]
    _: KW_ONLY
    out: Annotated[Folder, "folder of the campaign"]
    plant: Annotated[PlantFile, "plant file of another valve than the report's, for the checks"] = None
    mapping: Annotated[Path | None, "JSON file that says what names and units do not"] = None
    ambient_bar: Annotated[
        float | None, Number(float, 0.01, 100.0), "pressure of the environment [bar absolute]"
    ] = None
    gauge: Annotated[bool, "pressures are gauge where no unit says gauge or absolute"] = False
    temperature_K: Annotated[float | None, Number(float, 1.0, 1000.0), "of the environment [K]"] = None
    rate: Annotated[
        float | None, Number(float, 1.0, 1e7), "samples per second; default: the slowest channel's"
    ] = None
    name: Annotated[str | None, "of the campaign; default: the files' folder"] = None
    dry_run: Annotated[bool, "show everything and write nothing"] = False


def run(options: Options) -> None:
    """Show what the files hold and write the campaign. Raises ImportingError or CampaignError."""
    check_vacant(options.out)
    mapping = read_mapping(options.mapping) if options.mapping else MappingFile()
    sources = []
    for file in options.files:
        sources.append(read_source(file, mapping.missing))
        print(source_table(sources[-1]), end="\n\n")
    imported = read_files(
        sources,
        mapping=mapping,
        ambient_bar=options.ambient_bar,
        temperature_K=options.temperature_K,
        rate=options.rate,
        name=options.name,
        gauge=options.gauge,
        rules=rules_of(load_plant(options.plant)),
    )
    print(import_text(imported), end="\n\n")
    if options.dry_run:
        check_campaign(imported.campaign, options.out, imported.places)
        print("dry run: all checks passed, nothing is written; leave --dry-run out to import")
        return
    write_campaign(
        imported.campaign, options.out, provenance=imported.provenance(), places=imported.places
    )
    print(f"{len(imported.files)} recordings in {options.out}")


def next_step(options: Options) -> NextStep | None:
    """As after a bench; None after a dry run, which says what to leave out."""
    recorded = bench.Options(out=options.out, plant=options.plant)
    return None if options.dry_run else bench.next_step(recorded)
