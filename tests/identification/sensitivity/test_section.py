"""The study's section can be written, and its data is JSON."""

import json

from epv_env.plant.parameters import Parameters
from identification.report.page import Picture, write_page
from identification.sensitivity.global_indices import (
    ranges,
    sobol_indices,
    total_error_model,
)
from identification.sensitivity.section import SensitivityStudy, sensitivity_json, sensitivity_section
from tests.identification.sensitivity.test_collinearity import nominal_sensitivities
from tests.identification.sensitivity.test_one_at_a_time import exact


def short_study() -> SensitivityStudy:
    p, symbols = Parameters.nominal(), ["d1", "R"]
    model, bounds = total_error_model(p, symbols), ranges(p, symbols)
    return SensitivityStudy(
        one_at_a_time=exact(),
        outputs=nominal_sensitivities(),
        indices=sobol_indices(model, symbols, bounds, samples=8, seed=1),
    )


def test_section_and_data(tmp_path):
    study = short_study()
    section = sensitivity_section(study)
    assert [verdict.status for verdict in section.verdicts] == ["good", "note", "note"]
    assert sum(isinstance(block, Picture) for block in section.blocks) == 2
    write_page(tmp_path / "page.html", title="Sensitivity", sections=[section])
    data = json.loads(json.dumps(sensitivity_json(study), allow_nan=False))
    assert data["collinearity"]["all_sensitive"] is None
    assert set(data["sobol"]) == {"d1", "R"}
