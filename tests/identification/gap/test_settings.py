"""Settings hold all judgement of the diagnosis, and each one reaches the place that it governs."""

import ast
from collections.abc import Iterator
from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import pytest

import identification.gap
from identification.gap.design.settings import DesignSettings
from identification.gap.diagnosis import diagnose
from identification.gap.experiment_design import expected_information
from identification.gap.fit.settings import FitSettings
from identification.gap.gap_json import as_json
from identification.gap.locate.settings import LocalisationSettings
from identification.gap.model.settings import PreparationSettings, TimeScaleSettings
from identification.gap.rank.settings import RankingSettings
from identification.gap.reduce.settings import ReductionSettings
from identification.gap.settings import DiagnosisSettings, ReportSettings
from tests.identification.gap.tanks import without_gap
from tests.identification.gap.test_expected_information import Gauge, diagnosed, two

FOLDER = Path(identification.gap.__file__).parent
DEFINITIONS = {"FLOOR", "LAGS", "LEAST", "MEDIAN_TO_SD", "STEP_TO_SD", "PREFIXES", "POWER_PREFIXES"}
"""Numbers that are definitions, and no judgement."""

SAFEGUARDS = {"ACTIVE_SET_ITERATIONS", "PIVOTS", "ROUNDING"}
"""Ends of iterations that find one exact solution, and rounding there: no judgement either."""

STAGES = (
    PreparationSettings,
    TimeScaleSettings,
    FitSettings,
    RankingSettings,
    LocalisationSettings,
    ReductionSettings,
    DesignSettings,
    ReportSettings,
)


def modules() -> Iterator[tuple[Path, ast.Module]]:
    for path in sorted(FOLDER.rglob("*.py")):
        yield path, ast.parse(path.read_text(encoding="utf-8"))


def numeric_constants(module: ast.Module) -> set[str]:
    """Upper-case names of a module that hold a number."""
    found = set()
    for statement in module.body:
        if isinstance(statement, ast.Assign):
            numbers = [
                node
                for node in ast.walk(statement.value)
                if isinstance(node, ast.Constant) and isinstance(node.value, (int, float))
            ]
            names = [
                node.id
                for target in statement.targets
                for node in ast.walk(target)
                if isinstance(node, ast.Name) and node.id.isupper()
            ]
            found.update(names if numbers else [])
    return found


def test_no_module_keeps_a_number_of_judgement():
    allowed = DEFINITIONS | SAFEGUARDS
    constants = {path.name: numeric_constants(module) - allowed for path, module in modules()}
    assert len(constants) > 30
    assert {name: found for name, found in constants.items() if found} == {}


def test_a_number_of_judgement_would_be_found():
    module = ast.parse("NEAR = 250.0\nFEW, MOST = 2, (1, 4)\nNAME = 'near'\nnear = 3\n")
    assert numeric_constants(module) == {"NEAR", "FEW", "MOST"}


def test_no_two_settings_have_the_same_name():
    names = [field.name for stage in STAGES for field in fields(stage)]
    assert len(names) == len(set(names))


def test_every_setting_is_described():
    for path, module in modules():
        if path.name != "settings.py":
            continue
        for record in (node for node in module.body if isinstance(node, ast.ClassDef)):
            if record.name == "DiagnosisSettings":
                continue
            body = [node for node in record.body if isinstance(node, ast.AnnAssign)]
            described = [
                following
                for node, following in zip(record.body, [*record.body[1:], None], strict=True)
                if isinstance(node, ast.AnnAssign) and isinstance(following, ast.Expr)
            ]
            assert len(described) == len(body), record.name


def test_every_setting_is_used():
    used = {
        node.attr
        for _, module in modules()
        for node in ast.walk(module)
        if isinstance(node, ast.Attribute)
    }
    assert {field.name for stage in STAGES for field in fields(stage)} - used == set()


@cache
def content(settings: DiagnosisSettings) -> dict:
    """gap.json of a tank without a gap, whose probabilities lie between 0 and 1."""
    return as_json(diagnose(without_gap(), settings=settings))


@pytest.mark.parametrize(
    ("stage", "changes"),
    [
        ("fit", {"difference_step": 1e-2}),
        ("fit", {"thorough_iterations": 0}),
        ("ranking", {"prior_no_cause": 1e-3}),
        ("ranking", {"form_readings": 5.0}),
        ("ranking", {"no_cause_doubt": 1.0}),
        ("localisation", {"windows": 7}),
        ("localisation", {"regime_block": 0.1}),
        ("reduction", {"interval_level": 0.5}),
        ("report", {"listed_causes": 1}),
        ("report", {"systematic_form_error": 0.5}),
    ],
)
def test_a_changed_setting_changes_the_diagnosis(stage, changes):
    default = DiagnosisSettings()
    changed = replace(default, **{stage: replace(getattr(default, stage), **changes)})
    assert content(changed) != content(default)


def test_equal_settings_give_the_same_diagnosis():
    assert content(DiagnosisSettings()) == as_json(diagnose(without_gap()))


def test_changed_settings_change_the_next_experiment():
    found = diagnosed(exact=False)
    plan = Gauge((4.0,), exact=False)

    def entropy(settings: DesignSettings) -> float:
        (gain,) = expected_information(found.problem, plan, two(found), settings)
        return gain.expected_entropy

    assert entropy(DesignSettings(outcomes=20)) != entropy(DesignSettings())
    assert entropy(DesignSettings(form_error=0.5)) != entropy(DesignSettings())
