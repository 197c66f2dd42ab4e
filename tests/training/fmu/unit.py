"""An FMU called as its standard says, without any package: what the tests of FMUs share."""

import ctypes
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

LOGGER = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, *[ctypes.c_char_p, ctypes.c_int, *[ctypes.c_char_p] * 3]
)
"""The standard's logger has a variable list of arguments; our units pass one, the sentence."""
OK, ERROR = 0, 3


class Callbacks(ctypes.Structure):
    """fmi2CallbackFunctions."""

    _fields_ = (
        ("logger", LOGGER),
        ("allocate", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
        ("finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


class Unit:
    """An FMU unpacked and loaded."""

    def __init__(self, content: bytes, folder: Path):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            archive.extractall(folder)
        self.folder = folder
        self.description = xml.parse(folder / "modelDescription.xml").getroot()
        self.token = self.description.attrib["guid"]
        names = self.description.iter("ScalarVariable")
        self.references = {each.attrib["name"]: int(each.attrib["valueReference"]) for each in names}
        (library,) = folder.glob("binaries/*/*")
        self.code = ctypes.CDLL(str(library))
        self.code.fmi2Instantiate.restype = ctypes.c_void_p

    def function(self, name: str) -> Any:
        """A function of the standard by its name without prefix."""
        return getattr(self.code, f"fmi2{name}")


class Instance:
    """One instance of a unit; `said` collects what it logs."""

    def __init__(self, unit: Unit, *, token: str | None = None):
        self.unit = unit
        self.said: list[str] = []
        text = (unit.token if token is None else token).encode()
        log = LOGGER(lambda _, name, status, category, form, text: self.said.append(text.decode()))
        self.calls = Callbacks(log, None, None, None, None)
        self.handle = unit.function("Instantiate")(
            b"unit", 1, text, None, ctypes.byref(self.calls), 0, 0
        )
        self.time = 0.0

    def call(self, name: str, *arguments: Any) -> int:
        """The status of a call."""
        return self.unit.function(name)(ctypes.c_void_p(self.handle), *arguments)

    def start(self, parameters: Mapping[str, float] | None = None) -> "Instance":
        """Initialise with these parameters."""
        end = (False, ctypes.c_double(0.0), ctypes.c_double(0.0), False, ctypes.c_double(0.0))
        assert self.call("SetupExperiment", *end) == OK
        assert self.call("EnterInitializationMode") == OK
        assert self.set(parameters or {}) == OK, self.said
        assert self.call("ExitInitializationMode") == OK, self.said
        return self

    def _values(self, name: str, names: list[str], values: Any) -> int:
        references = (ctypes.c_uint * len(names))(*(self.unit.references[each] for each in names))
        n = ctypes.c_size_t(len(names))
        return self.call(f"{name}Real", references, n, values)

    def set(self, values: Mapping[str, float]) -> int:
        """The status of setting variables."""
        return self._values("Set", list(values), (ctypes.c_double * len(values))(*values.values()))

    def get(self, *names: str) -> list[float]:
        """Values of variables."""
        values = (ctypes.c_double * len(names))()
        assert self._values("Get", list(names), values) == OK, self.said
        return list(values)

    def step(self, step: float, **inputs: float) -> int:
        """The status of a step with these inputs."""
        assert self.set(inputs) == OK, self.said
        return self.step_from(self.time, step)

    def step_from(self, time: float, step: float) -> int:
        """The status of a step from a time [s]."""
        numbers = (ctypes.c_double(time), ctypes.c_double(step), True)
        status = self.call("DoStep", *numbers)
        self.time += step if status == OK else 0.0
        return status

    def saved(self) -> ctypes.c_void_p:
        """A saved state."""
        state = ctypes.c_void_p()
        assert self.call("GetFMUstate", ctypes.byref(state)) == OK
        return state

    def restore(self, state: ctypes.c_void_p, time: float) -> None:
        """Go back to a saved state, which was saved at a time [s]."""
        assert self.call("SetFMUstate", state) == OK
        self.time = time

    def bytes_of(self, state: ctypes.c_void_p) -> bytes:
        """A saved state as bytes."""
        size = ctypes.c_size_t()
        assert self.call("SerializedFMUstateSize", state, ctypes.byref(size)) == OK
        content = ctypes.create_string_buffer(size.value)
        assert self.call("SerializeFMUstate", state, content, size) == OK
        return content.raw

    def state_of(self, content: bytes) -> ctypes.c_void_p | None:
        """A saved state from bytes, or None if the unit refuses them."""
        state = ctypes.c_void_p()
        status = self.call(
            "DeSerializeFMUstate", content, ctypes.c_size_t(len(content)), ctypes.byref(state)
        )
        return state if status == OK else None
