"""The files of an FMU: sources, descriptions, and a binary for this platform; packed as one archive."""

import hashlib
import io
import math
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
import uuid
import zipfile
from pathlib import Path
from string import Template

from training.deploy.compiled_export import STRICT
from training.deploy.fmu.model_description import build_description, model_description
from training.deploy.fmu.variables import Model, Variable
from training.deploy.quantisation import ExportError

TEMPLATES = Path(__file__).parent / "templates"
VERSIONS = ("2.0", "3.0")
"""Versions of the standard."""
COMMON = {"2.0": ("component.h", "fmi2.c"), "3.0": ("component.h", "fmi3.c", "fmi3_absent.h")}
"""Templates of the standard's functions by version; the C file is the one to compile."""
SYSTEMS = {"Linux": ("linux", "so"), "Darwin": ("darwin", "dylib"), "Windows": ("windows", "dll")}
"""Name and ending of a shared library by system."""
OLD_NAMES = {"linux": "linux", "darwin": "darwin", "windows": "win"}
"""Folder of binaries in FMI 2.0, before the number of bits."""
LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""Date of every file in the archive: the same model gives the same archive."""


def fmu_sources(model: Model, version: str) -> dict[str, str]:
    """Text of the C files by name. version: of the standard, one of VERSIONS."""
    fields = {
        "title": model.name,
        "token": token(model),
        "references": "\n".join(f"    {each.in_c}," for each in model.variables),
        "table": "\n".join(_row(each) for each in model.variables),
    }
    return model.sources | {
        name: Template((TEMPLATES / name).read_text(encoding="utf-8")).substitute(fields)
        for name in (*COMMON[version], "variables.h")
    }


def token(model: Model) -> str:
    """What tells this model from others: binary and description must agree on it."""
    digest = hashlib.sha256(repr(model).encode()).hexdigest()
    return f"{{{uuid.uuid5(uuid.NAMESPACE_OID, digest)}}}"


def _row(variable: Variable) -> str:
    """A variable in C."""
    numbers = (variable.low, variable.high, variable.start)
    text = ", ".join(
        repr(float(x)) if math.isfinite(x) else ("-" if x < 0 else "") + "INFINITY" for x in numbers
    )
    return f'    {{"{variable.name}", {variable.kind.upper()}, {text}}},'


def compiler_words(compiler: str) -> list[str]:
    """The words of a compiler's command; none if there is no such program."""
    words = shlex.split(compiler)
    return words if words and shutil.which(words[0]) else []


def binary(sources: dict[str, str], identifier: str, compiler: str) -> dict[str, bytes]:
    """The shared library for this platform by its path in an FMU 2.0, empty without a compiler.

    Raises ExportError where the compiler does not accept the code.
    """
    words = compiler_words(compiler)
    if not words:
        return {}
    _, ending = SYSTEMS.get(platform.system(), SYSTEMS["Linux"])
    main = next(name for name in sources if name.endswith(".c") and name.startswith("fmi"))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="utf-8")
        target = folder / f"{identifier}.{ending}"
        done = subprocess.run(
            [*words, *STRICT, "-fPIC", "-shared", main, "-lm", "-o", target.name],
            cwd=folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            complaint = next((s for s in done.stderr.splitlines() if "error" in s), done.stderr)
            raise ExportError(f"{words[0]} does not compile the FMU: {complaint.strip()}")
        return {target.name: target.read_bytes()}


def binary_folder(version: str) -> str:
    """The folder of this platform's binaries in an FMU."""
    system, _ = SYSTEMS.get(platform.system(), SYSTEMS["Linux"])
    if version == "2.0":
        return f"{OLD_NAMES[system]}{64 if sys.maxsize > 2**32 else 32}"
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine())
    return f"{machine}-{system}"


def fmu(model: Model, version: str, compiler: str) -> bytes:
    """The archive of an FMU, with a binary if the compiler (a command) is there.

    Raises ExportError where the compiler does not accept the code.
    """
    sources = fmu_sources(model, version)
    files = {f"sources/{name}": text.encode() for name, text in sources.items()}
    files["modelDescription.xml"] = model_description(model, version, token(model))
    if version == "3.0":
        files["sources/buildDescription.xml"] = build_description(model)
    for name, content in binary(sources, model.identifier, compiler).items():
        files[f"binaries/{binary_folder(version)}/{name}"] = content
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, LONG_AGO)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, files[name])
    return stream.getvalue()
