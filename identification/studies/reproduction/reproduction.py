"""The report's tables beside ours: reproduce.json and reproduce.html."""

from pathlib import Path
from typing import Any

from epv_env.plant.parameters import Parameters
from identification.bench.programmes import REPORT_SUITE
from identification.bench.session import run_bench
from identification.pipeline.identification import Identification
from identification.quality.assessment import assess_recording
from identification.quality.section import as_json as quality_json
from identification.quality.section import quality_section
from identification.report.page import Section
from identification.report.result_files import write_results
from identification.sensitivity.printed_agreement import sensitivity_tables
from identification.sensitivity.sensitivity_section import sensitivity_section
from identification.sensitivity.sensitivity_study import run_sensitivity_study
from identification.studies.reproduction.bench_tables import bench_json, bench_section
from identification.studies.reproduction.errata import errata_json, errata_section


def reproduce(out: Path, *, seed: int = 0) -> list[Section]:
    """Compute every table, write both files into `out`, and return the sections.

    Tables 8 and 9 need no bench; 2 to 4 and 10 to 15 come from a virtual one with Table 12 as truth.
    """
    study = run_sensitivity_study()
    campaign = run_bench(REPORT_SUITE, Parameters.calibrated(), seed=seed)
    identification = Identification(campaign, out / "reproduce.jsonl", seed=seed)
    quality = assess_recording(campaign.with_role("quality")[0], campaign.pressure)
    content: dict[str, Any] = {
        **sensitivity_tables(study.one_at_a_time),
        "virtual_bench": {"tables2to4": quality_json(quality), **bench_json(identification)},
        "slips": errata_json(),
    }
    sections = [
        sensitivity_section(study, report_2003=True),
        bench_section(identification),
        quality_section(quality, report_2003=True),
        errata_section(),
    ]
    title = "The report SCL-001/2003 beside its reproduction"
    write_results(out, "reproduce", title=title, sections=sections, content=content, report_2003=True)
    return sections
