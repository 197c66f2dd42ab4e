"""modelDescription.xml and buildDescription.xml of an FMU."""

import math
from xml.etree import ElementTree as xml

from training.deploy.fmu.units import DISPLAY, base_units
from training.deploy.fmu.variables import Model, Variable

MAIN = {"2.0": "fmi2.c", "3.0": "fmi3.c"}
"""The only file to compile, by version of the standard."""
CAUSALITY = {"time": "independent"}
"""What the standard calls a kind of variable where it has another word."""


def model_description(model: Model, version: str, token: str) -> bytes:
    """The description of a model after a version of the standard. Raises UnitError."""
    old = version == "2.0"
    root = xml.Element(
        "fmiModelDescription",
        {
            "fmiVersion": version,
            "modelName": model.name,
            "guid" if old else "instantiationToken": token,
            "description": model.description,
            "generationTool": "epv-valve",
            "license": "MIT",
            "variableNamingConvention": "structured",
        },
    )
    state = "FMUstate" if old else "FMUState"
    unit = xml.SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": model.identifier,
            "canHandleVariableCommunicationStepSize": "true",
            f"canGetAndSet{state}": "true",
            f"canSerialize{state}": "true",
        },
    )
    if old:
        xml.SubElement(xml.SubElement(unit, "SourceFiles"), "File", name=MAIN[version])
    _units(xml.SubElement(root, "UnitDefinitions"), model)
    xml.SubElement(xml.SubElement(root, "LogCategories"), "Category", name="logStatusError")
    experiment = {"startTime": "0.0", "stopTime": repr(model.stop), "stepSize": repr(model.step)}
    xml.SubElement(root, "DefaultExperiment", experiment)
    variables = xml.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(model.variables):
        (_scalar_variable if old else _float64)(variables, variable, reference)
    _structure(xml.SubElement(root, "ModelStructure"), model, old)
    return _text(root)


def build_description(model: Model) -> bytes:
    """How to compile the sources of an FMU 3.0."""
    root = xml.Element("fmiBuildDescription", fmiVersion="3.0")
    build = xml.SubElement(root, "BuildConfiguration", modelIdentifier=model.identifier)
    files = xml.SubElement(build, "SourceFileSet", language="C99")
    xml.SubElement(files, "SourceFile", name=MAIN["3.0"])
    return _text(root)


def _text(root: xml.Element) -> bytes:
    xml.indent(root)
    return xml.tostring(root, encoding="UTF-8", xml_declaration=True)


def _units(definitions: xml.Element, model: Model) -> None:
    """Every unit that a variable has, as powers of the base units."""
    for name in sorted({variable.unit for variable in model.variables} - {"1"}):
        unit = xml.SubElement(definitions, "Unit", name=name)
        powers = {base: str(power) for base, power in base_units(name).items()}
        xml.SubElement(unit, "BaseUnit", powers)
        if name in DISPLAY:
            shown, factor = DISPLAY[name]
            xml.SubElement(unit, "DisplayUnit", name=shown, factor=repr(factor))


def _names(variable: Variable, reference: int) -> dict[str, str]:
    """What both versions say of a variable alike."""
    fixed = {"parameter": "fixed", "output": "discrete" if variable.discrete else "continuous"}
    attributes = {
        "name": variable.name,
        "valueReference": str(reference),
        "description": variable.meaning,
        "causality": CAUSALITY.get(variable.kind, variable.kind),
        "variability": fixed.get(variable.kind, "continuous"),
    }
    initial = {"parameter": "exact", "output": "calculated", "local": "calculated"}.get(variable.kind)
    return attributes | ({"initial": initial} if initial else {})


def _numbers(variable: Variable) -> dict[str, str]:
    """Unit, range and start of a variable."""
    attributes = {} if variable.unit == "1" else {"unit": variable.unit}
    if variable.unit == "Pa":
        attributes["displayUnit"] = DISPLAY["Pa"][0]
    for name, value in (("min", variable.low), ("max", variable.high)):
        if math.isfinite(value):
            attributes[name] = repr(float(value))
    return attributes | ({"start": repr(float(variable.start))} if variable.settable else {})


def _scalar_variable(parent: xml.Element, variable: Variable, reference: int) -> None:
    """A variable in FMI 2.0."""
    element = xml.SubElement(parent, "ScalarVariable", _names(variable, reference))
    xml.SubElement(element, "Real", _numbers(variable))


def _float64(parent: xml.Element, variable: Variable, reference: int) -> None:
    """A variable in FMI 3.0."""
    xml.SubElement(parent, "Float64", _names(variable, reference) | _numbers(variable))


def _structure(structure: xml.Element, model: Model, old: bool) -> None:
    """The outputs, which all depend on the inputs; FMI 2.0 counts variables from one."""
    for parent, name in (("Outputs", "Output"), ("InitialUnknowns", "InitialUnknown")):
        within = xml.SubElement(structure, parent) if old else structure
        for reference, variable in enumerate(model.variables):
            if variable.kind != "output":
                continue
            if old:
                xml.SubElement(within, "Unknown", index=str(reference + 1))
            else:
                xml.SubElement(structure, name, valueReference=str(reference))
