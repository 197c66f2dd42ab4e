"""The section can be written, and its data is JSON."""

import json

from identification.report.page import Table, write_page
from identification.sensitivity.section import sensitivity_json, sensitivity_section
from tests.identification.sensitivity.test_collinearity import nominal_sensitivities
from tests.identification.sensitivity.test_one_at_a_time import exact


def test_section_and_data(tmp_path):
    section = sensitivity_section(exact(), nominal_sensitivities())
    assert [verdict.status for verdict in section.verdicts] == ["good", "note"]
    errors, pairs = section.blocks
    assert isinstance(errors, Table)
    assert isinstance(pairs, Table)
    assert len(errors.rows) == len(exact())
    assert ["V2, alphaPV", "infinite"] in [sorted_pair(row) for row in pairs.rows]
    write_page(tmp_path / "page.html", title="Sensitivity", sections=[section])
    data = json.loads(json.dumps(sensitivity_json(exact(), nominal_sensitivities()), allow_nan=False))
    assert data["collinearity"]["all_sensitive"] is None
    assert data["exact"]["R"]["sensitive"]


def sorted_pair(row):
    return [", ".join(sorted(row[0].split(", "))), row[1]]
