"""An FMU after FMI 2.0: its variables and description, sources, a library for this platform, packed."""

import hashlib
import io
import math
import platform
import sys
import tempfile
import uuid
import zipfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree as xml

from training.deploy.c_code import filled
from training.deploy.compiled import build, compiler_words

TEMPLATES = Path(__file__).parent / "templates"
MAIN = "fmi2.c"
"""The only file to compile: the functions of the standard."""
SYSTEMS = {"Linux": ("linux", "so"), "Darwin": ("darwin", "dylib"), "Windows": ("windows", "dll")}
"""Name and ending of a shared library by system."""
FOLDERS = {"linux": "linux", "darwin": "darwin", "windows": "win"}
"""Folder of binaries, before the number of bits."""
LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""Date of every file in the archive: the same model gives the same archive."""
KINDS = {
    "input": {"causality": "input", "variability": "continuous"},
    "parameter": {"causality": "parameter", "variability": "fixed", "initial": "exact"},
    "output": {"causality": "output", "variability": "continuous", "initial": "calculated"},
    "local": {"causality": "local", "variability": "continuous", "initial": "calculated"},
    "time": {"causality": "independent", "variability": "continuous"},
}
"""What the standard says of a kind of variable."""

BASE = {
    "kg": {"kg": 1}, "m": {"m": 1}, "s": {"s": 1}, "A": {"A": 1}, "K": {"K": 1}, "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "S": {"kg": -1, "m": -2, "s": 3, "A": 2},
    "1": {},
}  # fmt: skip
"""Powers of the base units by symbol."""

DISPLAY = {"Pa": ("bar", 1e-5), "m": ("mm", 1e3), "s": ("ms", 1e3)}
"""Unit in which a tool may show a quantity, and how many of it make one, by SI unit."""


class UnitError(ValueError):
    """A unit is not one of those that an FMU's description is written with."""


Kind = Literal["input", "parameter", "output", "local", "time"]


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One variable; its value reference is its place in the model's list. SI units."""

    name: str
    """Name in the FMU: the symbol of docs/explanation/plant-model.md, or state.SYMBOL."""
    kind: Kind
    """What an importer may do with it; the independent variable is of the kind "time"."""
    unit: str
    """SI unit as the parameter table writes it; "1" for none."""
    meaning: str
    """What it is, in a line."""
    start: float = 0.0
    """Value at the start of an input or parameter [unit]."""
    low: float = -math.inf
    """Least value of an input or parameter [unit]."""
    high: float = math.inf
    """Greatest value of an input or parameter [unit]."""
    discrete: bool = False
    """Whether it changes at instants only: importers then hold it, and end steps at its edges."""


@dataclass(frozen=True, kw_only=True)
class Model:
    """All that an FMU is made of."""

    name: str
    """Name of the model."""
    identifier: str
    """The same as a name in C and of the binary."""
    description: str
    """What it is, in a sentence."""
    variables: tuple[Variable, ...]
    """In the order of their value references."""
    sources: dict[str, str]
    """Text of the C files that stand behind the standard's functions, by name; `model.h` is included."""
    step: float
    """Communication step that fits the model [s]."""
    stop: float = 1.0
    """Length of a simulation that shows what the model does [s]."""


def base_units(unit: str) -> dict[str, int]:
    """Powers of the base units of a unit such as `V s/(A m)`. Raises UnitError for an unknown one."""
    numerator, _, denominator = unit.partition("/")
    powers: Counter[str] = Counter()
    for text, sign in ((numerator, 1), (denominator, -1)):
        for factor in text.strip("()").split():
            symbol, _, power = factor.partition("^")
            if symbol not in BASE:
                raise UnitError(f"unit {unit!r} holds {symbol!r}: add it to {__name__}.BASE")
            for base, exponent in BASE[symbol].items():
                powers[base] += sign * int(power or 1) * exponent
    return {base: exponent for base, exponent in powers.items() if exponent}


def model_description(model: Model) -> bytes:
    """modelDescription.xml of a model. Raises UnitError."""
    root = xml.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=token(model),
        description=model.description,
        generationTool="epv-valve",
        license="MIT",
        variableNamingConvention="structured",
    )
    unit = xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model.identifier,
        canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    xml.SubElement(xml.SubElement(unit, "SourceFiles"), "File", name=MAIN)
    definitions = xml.SubElement(root, "UnitDefinitions")
    for name in sorted({variable.unit for variable in model.variables} - {"1"}):
        unit = xml.SubElement(definitions, "Unit", name=name)
        powers = {base: str(power) for base, power in base_units(name).items()}
        xml.SubElement(unit, "BaseUnit", powers)
        if name in DISPLAY:
            shown, factor = DISPLAY[name]
            xml.SubElement(unit, "DisplayUnit", name=shown, factor=repr(factor))
    xml.SubElement(xml.SubElement(root, "LogCategories"), "Category", name="logStatusError")
    experiment = {"startTime": "0.0", "stopTime": repr(model.stop), "stepSize": repr(model.step)}
    xml.SubElement(root, "DefaultExperiment", experiment)
    variables = xml.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(model.variables):
        _scalar_variable(variables, variable, reference)
    structure = xml.SubElement(root, "ModelStructure")
    for name in ("Outputs", "InitialUnknowns"):  # they depend on all inputs; variables count from one
        within = xml.SubElement(structure, name)
        for number, variable in enumerate(model.variables, start=1):
            if variable.kind == "output":
                xml.SubElement(within, "Unknown", index=str(number))
    xml.indent(root)
    return xml.tostring(root, encoding="UTF-8", xml_declaration=True)


def _scalar_variable(parent: xml.Element, variable: Variable, reference: int) -> None:
    """A variable, with its unit, range and start."""
    attributes = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.meaning,
        **KINDS[variable.kind],
        **({"variability": "discrete"} if variable.discrete else {}),
    }
    element = xml.SubElement(parent, "ScalarVariable", attributes)
    numbers = {} if variable.unit == "1" else {"unit": variable.unit}
    if variable.unit == "Pa":
        numbers["displayUnit"] = DISPLAY["Pa"][0]
    for name, value in (("min", variable.low), ("max", variable.high)):
        if math.isfinite(value):
            numbers[name] = repr(float(value))
    if variable.kind in ("input", "parameter"):
        numbers["start"] = repr(float(variable.start))
    xml.SubElement(element, "Real", numbers)


def fmu_sources(model: Model) -> dict[str, str]:
    """Text of the C files by name."""
    references, rows = [], []
    for variable in model.variables:
        references.append(f"    V_{variable.name.replace('.', '_')},")
        numbers = (variable.low, variable.high, variable.start)
        text = ", ".join(repr(float(number)).replace("inf", "INFINITY") for number in numbers)
        rows.append(f'    {{"{variable.name}", {variable.kind.upper()}, {text}}},')
    fields = {
        "title": model.name,
        "token": token(model),
        "references": "\n".join(references),
        "table": "\n".join(rows),
    }
    names = ("component.h", MAIN, "variables.h")
    return model.sources | {name: filled(TEMPLATES / name, fields) for name in names}


def token(model: Model) -> str:
    """What tells this model from others: binary and description must agree on it."""
    digest = hashlib.sha256(repr(model).encode()).hexdigest()
    return f"{{{uuid.uuid5(uuid.NAMESPACE_OID, digest)}}}"


def _binary(sources: dict[str, str], identifier: str, compiler: str) -> dict[str, bytes]:
    """The shared library for this platform by its path in an FMU, empty without a compiler."""
    words = compiler_words(compiler)
    if not words:
        return {}
    system, ending = SYSTEMS.get(platform.system(), SYSTEMS["Linux"])
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="utf-8")
        built = build(words, folder, "-fPIC", "-shared", MAIN, "-lm", output=f"{identifier}.{ending}")
        bits = 64 if sys.maxsize > 2**32 else 32
        return {f"{FOLDERS[system]}{bits}/{built.name}": built.read_bytes()}


def fmu(model: Model, compiler: str) -> bytes:
    """The archive of an FMU, with a binary if the compiler (a command) is there.

    Raises ExportError where the compiler does not accept the code.
    """
    sources = fmu_sources(model)
    files = {f"sources/{name}": text.encode() for name, text in sources.items()}
    files["modelDescription.xml"] = model_description(model)
    for name, content in _binary(sources, model.identifier, compiler).items():
        files[f"binaries/{name}"] = content
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, LONG_AGO)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, files[name])
    return stream.getvalue()
