"""The table of effects that the site shows, from the effects' records.

python -m docs.scripts.effects_table      # prints it
"""

from docs.studies.common import table as markdown_table
from epv_env.plant.effects.record import Size
from epv_env.plant.effects.registry import EFFECTS
from epv_env.plant.parameters import table


def effects_table() -> str:
    """One row for each effect: name, component, sizes with unit and range, form."""
    rows = [
        [
            f"`{effect.name}`",
            effect.component.replace("_", " "),
            ", ".join(_size(size) for size in effect.sizes),
            effect.form,
        ]
        for effect in EFFECTS
    ]
    return markdown_table(["Effect", "Component", "Size, range, unit", "Form"], rows)


def _size(size: Size) -> str:
    """Symbol, range and unit of a size."""
    row = table()[size.symbol]
    low, high = row.domain or (0.0, 0.0)
    unit = "" if row.unit == "1" else f" {row.unit}"
    return f"`{size.symbol}` {low:g} to {high:g}{unit}"


if __name__ == "__main__":
    print(effects_table())
