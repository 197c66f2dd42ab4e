"""Commands by name. A command is one module of a package of commands; nothing lists the modules.

A command's module has

- its help line as the first line of its docstring,
- `Options`, a dataclass that declares the options (epv_env/common/options.py),
- `run(options)`, which raises ValueError or OSError with one sentence for what it cannot use,
- `next_step(options)`, which says what to run after it, or None where that depends on the user,
- `QUICK` if it has an option `quick`: what that sets, as {option: value}.

The file's name is the command's: `sim_to_real.py` is `sim-to-real`, `import_.py` is `import`.
An option `out` is a folder of results, which one process at a time writes.
"""

import ast
import difflib
import importlib
import pkgutil
import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from importlib.metadata import version
from importlib.resources import files

from threadpoolctl import threadpool_limits

from epv_env.common.command_line import fail_clearly
from epv_env.common.extras import DISTRIBUTION, missing_package
from epv_env.common.options import parse
from epv_env.common.results_folder import only_writer


def main(
    packages: Sequence[str],
    *,
    program: str,
    arguments: Sequence[str] | None = None,
    given: Mapping[str, str] = {},
) -> int:
    """Run the command that the first argument names; returns the exit status.

    Args:
        packages: names of packages of commands.
        program: what the user types before the command's name.
        arguments: None for those of the process.
        given: by command, a function that its `run` gets, too, as "MODULE:NAME": its package may not
            import it.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    return fail_clearly(lambda: _run_named(commands(packages), program, words, given))


def main_of(module: str, *, program: str, arguments: Sequence[str] | None = None) -> int:
    """Run the command of one module, such as "training.commands.train"; returns the exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    return fail_clearly(lambda: _run(module, program, words))


def commands(packages: Sequence[str]) -> dict[str, str]:
    """Modules of all commands by the commands' names, in alphabetical order."""
    modules = {
        module.name.strip("_").replace("_", "-"): f"{package}.{module.name}"
        for package in packages
        for module in pkgutil.iter_modules(importlib.import_module(package).__path__)
    }
    return dict(sorted(modules.items()))


def help_line(module: str) -> str:
    """First line of a module's docstring, without an import: its packages may be missing."""
    package, _, name = module.rpartition(".")
    text = files(package).joinpath(f"{name}.py").read_text(encoding="utf-8")
    return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]


def _run_named(
    known: Mapping[str, str], program: str, arguments: list[str], given: Mapping[str, str]
) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        width = max(map(len, known))
        lines = [f"  {name:{width}}  {help_line(module)}" for name, module in known.items()]
        print(f"usage: {program} COMMAND [options]", "", *lines, "", sep="\n")
        print(f"{program} COMMAND --help lists its options, {program} --version the version")
        return 0
    if arguments[0] == "--version":
        print(program, version(DISTRIBUTION))
        return 0
    name, *rest = arguments
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"`{program}` lists them"
        raise ValueError(f"there is no command {name!r}: {hint}")
    return _run(known[name], f"{program} {name}", rest, *filter(None, [given.get(name)]))


def _run(name: str, program: str, arguments: list[str], *given: str) -> int:
    try:
        module = importlib.import_module(name)
        options = parse(module, program, arguments)
        out = getattr(options, "out", None)
        alone = nullcontext() if out is None else only_writer(out)
        # The matrices are small: threads of the linear algebra would only wait for each other.
        with threadpool_limits(1, user_api="blas"), alone:
            module.run(
                options, *(lambda *words, of=of: pkgutil.resolve_name(of)(*words) for of in given)
            )
        if step := module.next_step(options):
            print(f"\n{step}")
    except ModuleNotFoundError as error:
        extra = name.partition(".")[0]  # named as the package
        sentence = missing_package(error.name or "", preferred=extra)
        if sentence is None:
            raise
        raise ValueError(f"{program}: {sentence}") from None
    return 0
