"""The notebook of the documentation: run, with its outputs kept in the file, and shown as a page.

    python -m docs.scripts.notebook      # runs the cells and keeps what they print and draw

The cells run in one namespace, one after another. A cell shows what it prints, its figures of pyplot,
and a figure that is the value of its last line.
"""

import ast
import base64
import io
import json
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

NOTEBOOK = Path(__file__).parents[1] / "start" / "ten-cells.ipynb"
"""The file, in the format of Jupyter (nbformat 4)."""
Cell = dict[str, Any]


def read() -> dict[str, Any]:
    """The notebook with its outputs."""
    return json.loads(NOTEBOOK.read_text(encoding="utf-8"))


def run(cells: list[Cell]) -> None:
    """Run the cells of code and put their outputs into them."""
    namespace: dict[str, Any] = {}
    plt.close("all")
    for number, cell in enumerate(cells, start=1):
        if cell["cell_type"] == "code":
            cell["outputs"] = list(_outputs("".join(cell["source"]), f"<cell {number}>", namespace))


def _outputs(source: str, name: str, namespace: dict[str, Any]) -> Iterator[Cell]:
    *body, last = ast.parse(source).body
    printed, value = io.StringIO(), None
    with redirect_stdout(printed):
        exec(compile(ast.Module(body, []), name, "exec"), namespace)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), name, "eval"), namespace)
        else:
            exec(compile(ast.Module([last], []), name, "exec"), namespace)
    if text := printed.getvalue():
        yield {"output_type": "stream", "name": "stdout", "text": text.splitlines(keepends=True)}
    for figure in [plt.figure(number) for number in plt.get_fignums()]:
        yield _picture(figure)
        plt.close(figure)
    if isinstance(value, Figure):
        yield _picture(value)


def _picture(figure: Figure) -> Cell:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=100)
    data = {"image/png": base64.b64encode(stream.getvalue()).decode("ascii")}
    return {"output_type": "display_data", "data": data, "metadata": {}}


def pictures() -> dict[str, bytes]:
    """The pictures by their paths in the site, in the order of the page."""
    shown = [output for cell in read()["cells"] for output in cell.get("outputs", [])]
    data = [output["data"]["image/png"] for output in shown if "data" in output]
    folder = NOTEBOOK.parent.name
    return {
        f"{folder}/{NOTEBOOK.stem}-{number}.png": base64.b64decode(each)
        for number, each in enumerate(data, start=1)
    }


def page() -> str:
    """Cells and outputs as Markdown."""
    parts, paths = [], iter(pictures())
    for cell in read()["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", []):
            if "data" in output:
                parts.append(f"![What this cell draws]({Path(next(paths)).name})")
            else:
                parts.append(f"```text\n{''.join(output['text']).rstrip()}\n```")
    return "\n\n".join(parts)


def main() -> None:
    """Run the notebook and write it back."""
    notebook = read()
    run(notebook["cells"])
    NOTEBOOK.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
