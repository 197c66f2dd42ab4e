"""C from the plant's compiled functions: one C function for each Python function, by its syntax tree.

So the equations of an FMU are those of epv_env/plant by construction. Only what such functions consist
of is known here: numbers, named tuples of numbers, arithmetic, comparisons, branches and fixed loops.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from training.deploy.fmu.expressions import CFunction
from training.deploy.fmu.function_body import Body, definition
from training.deploy.fmu.tracing import Symbol, TranslationError, written

HELPERS = """\
static inline double lesser(double a, double b) { return a < b ? a : b; }
static inline double greater(double a, double b) { return a > b ? a : b; }
"""
"""What the translated functions call beside math.h."""


@dataclass(kw_only=True)
class Translation:
    """C of functions and of all that they call, each once, in an order in which C can read them."""

    structures: dict[type, str] = field(default_factory=dict)
    """C types by named tuple; a result of several values becomes a structure of its own."""
    texts: list[str] = field(default_factory=list)
    _functions: dict[tuple[Any, tuple[str, ...]], CFunction] = field(default_factory=dict)
    _results: dict[tuple[str, ...], str] = field(default_factory=dict)

    def structure(self, kind: type) -> str:
        """The C type of a named tuple of numbers, declared when it is first needed."""
        if kind not in self.structures:
            name = kind.__name__
            fields = "".join(f"    double {each};\n" for each in kind._fields)  # type: ignore[attr-defined]
            self.texts.append(f"typedef struct {{\n{fields}}} {name};\n")
            self.structures[kind] = name
        return self.structures[kind]

    def result(self, types: tuple[str, ...]) -> str:
        """The C type of several values that a function returns together, `part0` and so on."""
        if types not in self._results:
            name = f"parts_{len(self._results)}"
            fields = "".join(f"    {each} part{k};\n" for k, each in enumerate(types))
            self.texts.append(f"typedef struct {{\n{fields}}} {name};\n")
            self._results[types] = name
        return self._results[types]

    def parts(self, name: str) -> tuple[str, ...]:
        """Types of the values in a structure that `result` named. Raises KeyError for another one."""
        return {name: types for types, name in self._results.items()}[name]

    def function(self, function: Callable[..., Any], types: tuple[str, ...]) -> CFunction:
        """Translate a function whose arguments have these C types. Raises TranslationError."""
        python = getattr(function, "py_func", function)
        key = (python, types)
        if key not in self._functions:
            found = [done for (other, _), done in self._functions.items() if other is python]
            if found:
                raise TranslationError(
                    f"{python.__name__} is called with arguments of different types: C needs one"
                )
            from_text = python.__code__.co_filename == "<string>"
            text, self._functions[key] = (
                self._traced(python, types) if from_text else Body(self, python, types).translated()
            )
            self.texts.append(text)
        return self._functions[key]

    def _traced(self, python: Callable[..., Any], types: tuple[str, ...]) -> tuple[str, CFunction]:
        """C of a function that primitives/compiled.py generated from text: one expression, traced."""
        kinds = {name: kind for kind, name in self.structures.items()}
        names = list(inspect.signature(python).parameters)
        arguments = [
            kinds[kind](*(Symbol(f"{name}->{each}") for each in kinds[kind]._fields))  # type: ignore[attr-defined]
            if kind in kinds
            else Symbol(name)
            for name, kind in zip(names, types, strict=True)
        ]
        result = python(*arguments)
        kind = self.structures[type(result)]
        members = ",\n        ".join(f".{each} = {written(v)}" for each, v in result._asdict().items())
        taken = {known.name for known in self._functions.values()}
        name = python.__name__ if python.__name__ not in taken else f"{python.__name__}_{len(taken)}"
        done = CFunction(name=name, result=kind)
        return definition(
            done, dict(zip(names, types, strict=True)), f"    return ({kind}){{\n        {members}}};\n"
        ), done
