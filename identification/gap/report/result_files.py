"""The files of a diagnosis for programs: gap.json and, where one was found, the missing term."""

from pathlib import Path
from typing import Any

from epv_env.common.json_files import write_json
from identification.gap.diagnosis import Diagnosis
from identification.gap.report.json_export import as_json
from identification.gap.report.remainder import remainder, term_table

GAP, TERM = "gap.json", "missing_term.json"


def write_results(
    diagnosis: Diagnosis, folder: Path, next_experiment: str = "", **further: Any
) -> dict[str, Any]:
    """Write gap.json and, where a state explains what remains, missing_term.json.

    A missing term of an earlier diagnosis in the folder is removed.

    Args:
        diagnosis: what to write.
        folder: where to; made where it is missing.
        next_experiment: a sentence, empty where none was sought.
        further: other fields of gap.json.

    Returns:
        The content of gap.json.
    """
    (folder / TERM).unlink(missing_ok=True)
    term = remainder(diagnosis).term
    if term:
        write_json(folder / TERM, term_table(term), allow_nan=False)
    content = {**as_json(diagnosis, next_experiment, TERM if term else None), **further}
    write_json(folder / GAP, content, allow_nan=False)
    return content
