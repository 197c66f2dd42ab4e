"""Which generated tables are of the present code, and one command that measures the others again.

    python -m docs.studies.freshness [STUDY ...] [--list | --old]

The marker of a table names its study and a code: the digest of every file of this repository that the
study imports, and of the data beside them. Comments, docstrings and layout do not count.
"""

import argparse
import ast
import hashlib
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from epv_env.common.files import write_text

ROOT = Path(__file__).parents[2]
"""The repository's root."""
STUDIES: dict[str, tuple[float, tuple[str, ...]]] = {
    "reproduction": (1, ("study",)),
    "device": (15, ("study",)),
    "coverage": (20, ("study",)),
    "rare": (20, ("statement --episodes 30000",)),
    "learning": (60, ("study --seeds 3",)),
    "monitor": (60, ("study",)),
    "blind": (80, ("study --trials 100 --seed 5044", "study --trials 100 --seed 5045 --forms strong")),
    "logs": (90, ("study --valves 60",)),
    "sim_to_real": (120, ("study --seeds 3",)),
    "comparison": (20, ("study",)),
}
"""Rough minutes on two cores, and the modules that make the published tables, with their options."""
PACKAGES = ("epv_env", "controllers", "identification", "training")
DATA = ("*.json", "trained/*")
"""Files beside a package's module that it may read: parameters, tunings, the policy."""
PRESENTATION = re.compile("docs/studies/(common|freshness)|epv_env/render/|.*/report/page|.*/plots")
"""Paths of modules that change no figure."""
TABLE = re.compile(
    r"<!-- generated: (?P<name>[\w ]+), study (?P<study>\w+), code (?P<code>\w+) -->\n"
    r"(?P<text>.*?)<!-- end: (?P=name) -->",
    re.DOTALL,
)
# A table that is old on purpose begins with this line; one without figures with NOT_MEASURED.
OLD = "Measured on commit {}; the code has changed since: `make studies ARGS={}` measures it again."
NOT_MEASURED = "Not measured"


def meaning(node: Any) -> Any:
    """What a syntax tree says without docstrings, the same in every version of Python."""
    if isinstance(node, list):
        prose = (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant) for item in node)
        return [meaning(item) for item, skipped in zip(node, prose, strict=True) if not skipped]
    if isinstance(node, ast.AST):
        fields = ((name, value) for name, value in ast.iter_fields(node) if value != [])
        return type(node).__name__, *((name, meaning(value)) for name, value in fields)
    return repr(node)


@cache
def read(path: Path) -> tuple[bytes, frozenset[Path]]:
    """Digest of a module, and the files of this repository that it imports or names in a string."""
    tree = ast.parse(path.read_bytes())
    names, paths = set[str](), set[Path]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names.add(node.value.partition(":")[0])
    for parts in (name.split(".") for name in names):
        if parts[0] in (*PACKAGES, "docs", "tests") and all(map(str.isidentifier, parts)):
            places = [ROOT.joinpath(*parts[: k + 1]) for k in range(len(parts))]
            paths |= {p for q in places for p in (q.with_suffix(".py"), q / "__init__.py") if p.exists()}
    shown = {path for path in paths if PRESENTATION.match(path.relative_to(ROOT).as_posix())}
    return hashlib.sha256(repr(meaning(tree)).encode()).digest(), frozenset(paths - shown)


@cache
def dependencies(study: str) -> dict[str, bytes]:
    """Digests of all files on which a study's figures depend, by path from the root."""
    modules, new = set[Path](), set((ROOT / "docs/studies" / study).glob("*.py"))
    while new:
        modules |= new
        new = {path for module in new for path in read(module)[1]} - modules
    found = {module: read(module)[0] for module in modules}
    for folder in {module.parent for module in modules if module.stem != "__init__"}:
        if folder.relative_to(ROOT).parts[0] in PACKAGES:
            for path in (path for pattern in DATA for path in folder.glob(pattern)):
                found[path] = hashlib.sha256(path.read_bytes()).digest()
    return {path.relative_to(ROOT).as_posix(): found[path] for path in sorted(found)}


@cache
def code_of(study: str) -> str:
    """The code that a table of this study bears if it is measured now."""
    return hashlib.sha256(repr(dependencies(study)).encode()).hexdigest()[:12]


def pages() -> list[Path]:
    """Pages with tables of studies."""
    return [ROOT / "README.md", *sorted((ROOT / "docs/studies").glob("*/README.md"))]


def stale_tables() -> Iterator[tuple[Path, re.Match[str]]]:
    """Each table that was measured on other code, with its page."""
    for page in pages():
        for table in TABLE.finditer(page.read_text(encoding="utf-8")):
            if not table["text"].startswith(NOT_MEASURED) and table["code"] != code_of(table["study"]):
                yield page, table


def says_so(table: re.Match[str]) -> bool:
    """Whether the first line of a stale table says that it is old."""
    line = re.escape(OLD.format("COMMIT", table["study"])).replace("COMMIT", "[0-9a-f]{7,40}")
    return re.match(f"{line}\n", table["text"]) is not None


def commit_of(page: Path, code: str) -> str:
    """The commit that wrote a page's tables of this code."""
    log = ["git", "log", "-1", "--format=%h", "-S", f"code {code} ", "--", str(page)]
    return subprocess.run(log, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def measure(run: str) -> bool:
    """Run a study's module with its options; whether that succeeded."""
    return subprocess.call([sys.executable, "-m", *f"docs.studies.{run}".split()], cwd=ROOT) == 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure what is stale, the cheapest first; each study goes on where it was stopped."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("studies", nargs="*", help=f"these only, of {', '.join(STUDIES)}")
    parser.add_argument("--list", action="store_true", help="say what is stale, and measure nothing")
    parser.add_argument("--old", action="store_true", help="say on the pages which tables are old")
    options = parser.parse_args(arguments)
    if unknown := set(options.studies) - set(STUDIES):
        parser.error(f"no study: {', '.join(sorted(unknown))}; there are {', '.join(STUDIES)}")
    stale = [each for each in stale_tables() if each[1]["study"] in (options.studies or STUDIES)]
    names = [name for name in STUDIES if name in {table["study"] for _, table in stale}]
    print("\n".join(f"{name}: about {STUDIES[name][0]} min" for name in names) or "nothing is stale")
    if options.old:
        for page, table in (each for each in stale if not says_so(each[1])):
            commit = commit_of(page, table["code"]) or parser.error(
                f"{page}: commit {table['name']!r} first"
            )
            line = OLD.format(commit, table["study"])
            old = table.group().replace("-->\n", f"-->\n{line}\n\n", 1)
            write_text(page, page.read_text(encoding="utf-8").replace(table.group(), old))
    elif not options.list:
        runs = [f"{name}.{run}" for name in names for run in STUDIES[name][1]]
        return int(not min(map(measure, runs), default=True))  # all run, even if one fails
    return 0


if __name__ == "__main__":
    sys.exit(main())
