"""An effect's record is complete, and what is missing is named."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

import epv_env.plant
from epv_env.plant.effects.law import SLOTS, Terms
from epv_env.plant.effects.record import Constant, Effect, EffectError, Size
from epv_env.plant.effects.registry import CONSTANTS, EFFECTS
from epv_env.plant.parameters import Parameters, table

PLANT = Path(epv_env.plant.__file__).parent

SIZE = Size(
    symbol="k_new", unit="N", domain=(0.0, 1.0), meaning="a new force", trials=(0.1,), drawn=(0.01, 0.5)
)
COMPLETE = Effect(
    name="new_force", component="armature", form="+ k", source="a data sheet", sizes=(SIZE,)
)


def source(folder: Path, pattern: str = "*.py") -> str:
    """The text of a folder's files."""
    return "\n".join(path.read_text(encoding="utf-8") for path in sorted(folder.glob(pattern)))


def unread_constants(constants: tuple[Constant, ...]) -> list[str]:
    """Constants that no compiled function reads; `with_laws` reads those of laws by their names."""
    text = source(PLANT) + re.sub(r"name=\S+", "", source(PLANT / "effects"))
    text += " ".join(f".law{slot}_{name}" for slot in SLOTS for name in ("effect", *Terms._fields))
    text += ".coil_start"  # it sets the state at the start
    return [row.name for row in constants if not re.search(rf"\.{row.name}\b", text)]


def unused_symbols(record: Effect) -> list[str]:
    """Sizes of an effect without constants of its own that nothing outside of its record uses."""
    text, own = source(PLANT), source(PLANT / "effects")
    return [
        s for s in record.symbols if not record.rows and f'"{s}"' not in text and f'p["{s}"]' not in own
    ]


def test_every_size_is_a_parameter_that_is_off_at_zero():
    for size in (size for record in EFFECTS for size in record.sizes):
        row = table()[size.symbol]
        assert row.domain
        assert row.domain[0] <= 0.0 <= row.domain[1]
        assert Parameters.calibrated()[size.symbol] == 0.0
        for sizes in (size.trials, size.drawn or (), size.swept or ()):
            assert all(row.domain[0] <= value <= row.domain[1] for value in sizes)


def test_the_equations_use_every_effect():
    assert unread_constants(CONSTANTS) == []
    assert [symbol for record in EFFECTS for symbol in unused_symbols(record)] == []


def test_an_effect_that_the_equations_forget_is_found():
    row = Constant("new_force", lambda p: p["k_new"])
    assert unread_constants((row,)) == ["new_force"]
    assert unused_symbols(COMPLETE) == ["k_new"]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"component": "engine"}, "unknown component 'engine': choose one of solenoid"),
        ({"form": ""}, "form is empty"),
        ({"source": ""}, "source is empty"),
        ({"sizes": ()}, "it has no size: give at least one"),
        ({"alternatives": {"a": ("k_other",)}}, "alternatives name k_other: give a Size for each"),
        ({"sizes": (replace(SIZE, unit=""),)}, "k_new lacks its unit or its meaning"),
        ({"sizes": (replace(SIZE, domain=(1.0, 2.0)),)}, "0 lies outside the domain of k_new"),
        ({"sizes": (replace(SIZE, trials=()),)}, "no size has trials"),
        ({"sizes": (replace(SIZE, drawn=None),)}, "no variant has drawn ranges"),
        ({"sizes": (replace(SIZE, scatter=1.0),)}, "k_new needs both scatter and difference"),
    ],
)
def test_what_a_record_lacks_is_one_sentence(change, sentence):
    with pytest.raises(EffectError, match=r"^effect 'new_force': ") as caught:
        replace(COMPLETE, **change)
    assert sentence in str(caught.value)
