"""The translation to C: what it knows it translates, and what it does not know it names."""

import pytest

from epv_env.plant.primitives import inlined
from training.deploy.fmu.c_functions import NUMBER, PlantC
from training.deploy.fmu.formulas import Symbol, written
from training.deploy.translation import ExportError

LIMIT = 0.1


@inlined
def limited(x, high=LIMIT):
    """x, at most `high`."""
    y = x
    if x > high:
        y = high
    return y


@inlined
def both(x):
    """Two numbers."""
    return limited(x), x**2


@inlined
def summed(x):
    """Their sum."""
    a, b = both(x)
    a += b
    return a


@inlined
def unknown(x):
    """Holds a list, which C does not have."""
    return [x][0]


@inlined
def reordered(x):
    """Assigns values that depend on each other."""
    a, b = x, 1.0
    a, b = b, a
    return a - b


def test_a_function_and_those_it_calls_become_c():
    translation = PlantC()
    assert translation.function(summed, (NUMBER,)).result == "double"
    text = "\n".join(translation.texts)
    assert text.index("double limited(") < text.index("both(") < text.index("double summed(")
    assert "limited(x, 0.1)" in text
    assert "pow(x, 2.0)" in text


def test_values_are_taken_before_the_first_is_assigned():
    translation = PlantC()
    translation.function(reordered, (NUMBER,))
    assert "taken = {b, a};\n        a = taken.part0;\n        b = taken.part1;" in translation.texts[-1]


def test_what_has_no_form_in_c_is_named():
    with pytest.raises(ExportError, match=r"\[x\]"):
        PlantC().function(unknown, (NUMBER,))


def test_a_formula_is_written_down():
    np = pytest.importorskip("numpy")
    x = Symbol("x")
    formula = np.where(x < 2, 1 / np.maximum(x, 0.5), np.sqrt(3.0) * x)
    assert written(formula) == "((x < 2.0) ? (1.0 / greater(x, 0.5)) : (1.7320508075688772 * x))"


def test_an_operation_without_a_form_in_c_is_named():
    np = pytest.importorskip("numpy")
    with pytest.raises(ExportError, match=r"np\.sin"):
        np.sin(Symbol("x"))
