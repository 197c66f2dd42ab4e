"""An FMU called as its standard says, without any package: what the tests of FMUs share."""

import ctypes
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

DOUBLES = ctypes.POINTER(ctypes.c_double)
LOGGER_2 = ctypes.CFUNCTYPE(
    None,
    ctypes.c_void_p,
    ctypes.c_char_p,
    ctypes.c_int,
    ctypes.c_char_p,
    ctypes.c_char_p,
    ctypes.c_char_p,
)
"""FMI 2's logger has a variable list of arguments; our units pass one, the sentence."""
LOGGER_3 = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
OK, ERROR = 0, 3


class Callbacks(ctypes.Structure):
    """fmi2CallbackFunctions."""

    _fields_ = (
        ("logger", LOGGER_2),
        ("allocate", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
        ("finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


class Unit:
    """An FMU unpacked and loaded, of either version."""

    def __init__(self, content: bytes, folder: Path):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            archive.extractall(folder)
        self.folder = folder
        self.description = xml.parse(folder / "modelDescription.xml").getroot()
        self.version = int(self.description.attrib["fmiVersion"][0])
        self.token = self.description.attrib["guid" if self.version == 2 else "instantiationToken"]
        names = self.description.iter("ScalarVariable" if self.version == 2 else "Float64")
        self.references = {each.attrib["name"]: int(each.attrib["valueReference"]) for each in names}
        (library,) = folder.glob("binaries/*/*")
        self.code = ctypes.CDLL(str(library))
        for name in ("Instantiate", "InstantiateCoSimulation"):
            if hasattr(self.code, f"fmi{self.version}{name}"):
                getattr(self.code, f"fmi{self.version}{name}").restype = ctypes.c_void_p

    def function(self, name: str) -> Any:
        """A function of the standard by its name without prefix."""
        return getattr(self.code, f"fmi{self.version}{name}")


class Instance:
    """One instance of a unit; `said` collects what it logs."""

    def __init__(self, unit: Unit, *, token: str | None = None):
        self.unit = unit
        self.said: list[str] = []
        text = (unit.token if token is None else token).encode()
        if unit.version == 2:
            log = LOGGER_2(lambda _, name, status, category, form, text: self.said.append(text.decode()))
            self.calls = Callbacks(log, None, None, None, None)
            self.handle = unit.function("Instantiate")(
                b"unit", 1, text, None, ctypes.byref(self.calls), 0, 0
            )
        else:
            self.calls = LOGGER_3(lambda _, status, category, text: self.said.append(text.decode()))
            self.handle = unit.function("InstantiateCoSimulation")(
                b"unit",
                text,
                None,
                False,
                False,
                False,
                False,
                None,
                ctypes.c_size_t(0),
                None,
                self.calls,
                None,
            )
        self.time = 0.0

    def call(self, name: str, *arguments: Any) -> int:
        """The status of a call."""
        return self.unit.function(name)(ctypes.c_void_p(self.handle), *arguments)

    def start(self, parameters: Mapping[str, float] | None = None) -> "Instance":
        """Initialise with these parameters."""
        end = (False, ctypes.c_double(0.0), ctypes.c_double(0.0), False, ctypes.c_double(0.0))
        if self.unit.version == 2:
            assert self.call("SetupExperiment", *end) == OK
            assert self.call("EnterInitializationMode") == OK
        else:
            assert self.call("EnterInitializationMode", *end) == OK
        assert self.set(parameters or {}) == OK, self.said
        assert self.call("ExitInitializationMode") == OK, self.said
        return self

    def _values(self, name: str, names: list[str], values: Any) -> int:
        references = (ctypes.c_uint * len(names))(*(self.unit.references[each] for each in names))
        n = ctypes.c_size_t(len(names))
        if self.unit.version == 2:
            return self.call(f"{name}Real", references, n, values)
        return self.call(f"{name}Float64", references, n, values, n)

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
        flags = [ctypes.c_bool() for _ in range(3)]
        last = ctypes.c_double()
        more = [ctypes.byref(each) for each in (*flags, last)] if self.unit.version == 3 else []
        status = self.call("DoStep", *numbers, *more)
        self.time += step if status == OK else 0.0
        return status

    def saved(self) -> ctypes.c_void_p:
        """A saved state."""
        state = ctypes.c_void_p()
        assert self.call(self._state("Get{}"), ctypes.byref(state)) == OK
        return state

    def restore(self, state: ctypes.c_void_p, time: float) -> None:
        """Go back to a saved state, which was saved at a time [s]."""
        assert self.call(self._state("Set{}"), state) == OK
        self.time = time

    def bytes_of(self, state: ctypes.c_void_p) -> bytes:
        """A saved state as bytes."""
        size = ctypes.c_size_t()
        assert self.call(self._state("Serialized{}Size"), state, ctypes.byref(size)) == OK
        content = ctypes.create_string_buffer(size.value)
        assert self.call(self._state("Serialize{}"), state, content, size) == OK
        return content.raw

    def state_of(self, content: bytes) -> ctypes.c_void_p | None:
        """A saved state from bytes, or None if the unit refuses them."""
        state = ctypes.c_void_p()
        name = self._state("DeSerialize{}" if self.unit.version == 2 else "Deserialize{}")
        status = self.call(name, content, ctypes.c_size_t(len(content)), ctypes.byref(state))
        return state if status == OK else None

    def _state(self, form: str) -> str:
        return form.format("FMUstate" if self.unit.version == 2 else "FMUState")

    def free(self) -> None:
        """End the instance."""
        self.unit.function("FreeInstance")(ctypes.c_void_p(self.handle))
