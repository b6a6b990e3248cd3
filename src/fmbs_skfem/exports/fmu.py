"""A model in C as an FMU for co-simulation, FMI 2.0.4 or 3.0 (fmi-standard.org): its description,
sources and binaries.

    y(t + H) = doStep(u, H),   u held over the communication step H, which is divided into steps of the model,
    or u + u' t + u'' t^2 / 2 + u''' t^3 / 6 with derivatives (FMI 2), or lines between values of its steps (FMI 3)

Value references count time, parameters, inputs and outputs, in this order. Outputs do not depend on
inputs of the same instant, so that no algebraic loop goes through the model; a directional
derivative is that of outputs at the end of a step by inputs held over it.
"""

from __future__ import annotations

import hashlib
import io
import uuid
import zipfile
from collections.abc import Iterable, Mapping
from typing import NamedTuple
from xml.etree import ElementTree as xml

from .. import __version__
from ..core.printing.program import array
from ..core.storage.records import dataclass
from ..core.values.display import SI, DisplayUnits
from ..core.values.problems import printable
from ..core.values.units import measure
from . import reference, shapes, terminals
from .binaries import Binary
from .c_files import CModel
from .reference import TrainingMotion
from .shapes import ShownPoints
from .text import number, replaced, template

#: what messages of a model are about, in the order of fmu.c
CATEGORIES = {
    "logStatusWarning": "Inputs outside of the range of the training",
    "logStatusDiscard": "Values that are refused, and steps that did not converge",
    "logStatusError": "Calls that are not allowed",
    "logSteps": "Communication steps that are not the step of the model",
}
#: units in which people read numbers of these, where they have typed no other one
USUAL = {
    "rad": "deg",
    "rad/s": "rpm",
}
FIRST = (1980, 1, 1, 0, 0, 0)  #: time of files in the archive: the same model gives the same bytes


class Variable(NamedTuple):
    """A variable of an FMU; its value reference is its place."""

    name: str
    unit: str
    causality: str  #: independent, parameter, input or output
    start: float | None = None
    range: tuple[float, float] | None = None
    nominal: float | None = None
    display: str = ""  #: unit in which people read it, where that is another one
    fixed: bool = False  #: whether a motion keeps it
    size: int = 0  #: of an array, 0 for a number
    discrete: bool = False  #: whether it changes at events alone


@dataclass(frozen=True)
class FMU:
    """An FMU without its binaries: texts by their names in the archive, and a skin."""

    version: int  #: of FMI, 2 or 3
    name: str  #: of the model, that of its binaries
    token: str  #: by which a binary knows its description
    variables: tuple[Variable, ...]
    files: Mapping[str, str]
    skin: bytes = b""  #: of its bodies at the start, where it has a shape


def variables_of(model: CModel, shape: ShownPoints | None = None) -> tuple[Variable, ...]:
    """Time, parameters, inputs and outputs, and points of bodies as an array; a name that is taken
    goes on with what the variable is, as one of blanks is called.
    """
    found = [Variable("time", "s", "independent")]
    for name, (unit, low, high, middle) in model.parameters.items():
        fixed = name not in model.tunable
        found.append(
            Variable(name, unit, "parameter", middle, (low, high), abs(middle) or None, fixed=fixed)
        )
    found += [
        Variable(name, unit, "input", start, model.ranges.get(name))
        for name, (unit, start) in model.inputs.items()
    ]
    found += [
        Variable(one.name, one.unit, "output", discrete=one.name in model.counted)
        for one in model.columns
    ]
    if shape is not None:
        found.append(Variable("shape", "m", "output", size=len(shape.offset)))
    taken = set[str]()
    distinct = []
    for one in found:
        name = " ".join(one.name.split()) or one.causality  # neither line feeds nor tabs
        while name in taken:
            name += f" ({one.causality})"
        taken.add(name)
        distinct.append(one._replace(name=name))
    return tuple(distinct)


def shown(one: Variable, display: DisplayUnits) -> Variable:
    """The variable with the unit in which people read it: one that they typed, else with the prefix
    that its numbers ask for.
    """
    largest = max((abs(value) for value in (*(one.range or ()), one.nominal or 0.0)), default=0.0)
    unit, _ = display.find(one.unit, largest)
    unit = USUAL.get(unit, unit)
    return one._replace(display="" if unit == one.unit or one.causality == "independent" else unit)


def write(
    model: CModel,
    version: int,
    title: str,
    description: str = "",
    display: DisplayUnits = SI,
    motion: TrainingMotion | None = None,
    shape: ShownPoints | None = None,
) -> FMU:
    """The texts of an FMU for a model in C; tools show its numbers in units of `display`, and compare
    it with a `motion`; in FMI 3 points of a `shape` are an output.
    """
    variables = tuple(shown(one, display) for one in variables_of(model, shape))
    known = repr((__version__, version, model.source, model.header, variables)).encode()
    token = f"{{{uuid.UUID(hashlib.sha256(known).hexdigest()[:32])}}}"
    wrapper = f"{model.name}_fmi{version}.c"
    found = FMU(version, model.name, token, variables, {})
    sources = [f"{model.name}.c", wrapper]
    describe = description2 if version == 2 else description3
    files = {
        "modelDescription.xml": text_of(describe(found, model, title, description, sources)),
        f"sources/{model.name}.c": model.source,
        f"sources/{model.name}.h": model.header,
        f"sources/{wrapper}": wrapper_of(found, shape),
    }
    if version == 3:
        files["sources/buildDescription.xml"] = text_of(build_description(model.name, sources))
    if shape is not None:
        files[shapes.FILE] = shapes.text_of(shape)
    if (ports := terminals.describe((one.name, one.causality) for one in variables)) is not None:
        files[terminals.FILE] = text_of(ports)
    if motion is not None:
        outputs = [one.name for one in variables if one.causality == "output" and not one.size]
        names = dict(zip((one.name for one in model.columns), outputs, strict=True))
        related = {
            name: one if isinstance(one, str) else text_of(one)
            for name, one in reference.texts_of(motion, title, names).items()
        }
        files |= related
        files[f"{reference.FOLDER}/fmi-ls-manifest.xml"] = text_of(reference.manifest(related))
    skin = b"" if shape is None else shape.skin
    return FMU(version, model.name, token, variables, files, skin)


def wrapper_of(fmu: FMU, shape: ShownPoints | None) -> str:
    """The functions of FMI in C."""
    arrays = []
    if shape is not None:
        arrays = [
            array("SHAPE_MATRIX", "double", shape.matrix),
            array("SHAPE_OFFSET", "double", shape.offset),
        ]
    rows = []
    for one in fmu.variables:
        if one.causality in ("parameter", "input"):
            low, high = one.range or (1.0, -1.0)
            rows.append(
                f"    {{{quoted(one.name)}, {number(low)}, {number(high)}, {quoted(one.unit)}, {int(one.fixed)}}},"
            )
    words = {
        "NAME": fmu.name,
        "TOKEN_OF_MODEL": fmu.token,
        "SIZE_OF_SHAPE": len(shape.offset) if shape is not None else 0,
        "ARRAYS_OF_SHAPE": "\n".join(arrays),
        "TABLE_OF_GIVEN": "\n".join(rows or ['    {"", 1.0, -1.0, "", 0},']),
    }
    return replaced(
        replaced(template(f"fmi{fmu.version}.c"), {"SHARED_PART": template("fmu.c")}), words
    )


def quoted(text: str) -> str:
    """A text as a constant of C: other than letters, digits and what is harmless as octal numbers
    of its bytes.
    """
    plain = (chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in text.encode())
    return f'"{"".join(plain)}"'


def text_of(root: xml.Element) -> str:
    """A file of elements, in which texts from elsewhere stand without control characters: XML has
    no place for them.
    """
    for element in root.iter():
        for key, value in element.attrib.items():
            element.set(key, printable(value))
    xml.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{xml.tostring(root, encoding="unicode")}\n'


def head(fmu: FMU, title: str, description: str, **more: str) -> xml.Element:
    about = {"description": " ".join(f"{title}. {description}".split())}
    tool = {"generationTool": f"fmbs_skfem {__version__}", "variableNamingConvention": "flat"}
    return xml.Element(
        "fmiModelDescription",
        {"fmiVersion": f"{fmu.version}.0", "modelName": fmu.name, **more, **about, **tool},
    )


def add_units(root: xml.Element, variables: Iterable[Variable]) -> None:
    """Units with their powers of kg, m, s and rad."""
    units = xml.SubElement(root, "UnitDefinitions")
    for unit in sorted({one.unit for one in variables if one.unit}):
        quantity = measure(f"1 {unit}")
        powers = {
            name: power
            for name, power in zip(("kg", "m", "s", "rad"), quantity.exponents, strict=True)
            if power
        }
        place = xml.SubElement(units, "Unit", name=unit)
        if all(power.denominator == 1 for power in powers.values()):
            factor = {} if quantity.value == 1.0 else {"factor": number(quantity.value)}
            xml.SubElement(
                place, "BaseUnit", {name: str(power) for name, power in powers.items()} | factor
            )
        for name in sorted({one.display for one in variables if one.unit == unit and one.display}):
            size = measure(f"1 {name}").value / quantity.value
            xml.SubElement(place, "DisplayUnit", name=name, factor=number(1.0 / size))


def add_common(root: xml.Element, fmu: FMU, model: CModel) -> None:
    add_units(root, fmu.variables)
    categories = xml.SubElement(root, "LogCategories")
    for name, meaning in CATEGORIES.items():
        xml.SubElement(categories, "Category", name=name, description=meaning)
    xml.SubElement(
        root,
        "DefaultExperiment",
        startTime="0.0",
        stopTime=number(model.duration),
        stepSize=number(model.step),
    )


def attributes(one: Variable) -> dict[str, str]:
    """What both versions say of a number."""
    numbers = {"start": one.start, "nominal": one.nominal}
    if one.range is not None:
        numbers |= {"min": one.range[0], "max": one.range[1]}
    unit = ({"unit": one.unit} if one.unit else {}) | (
        {"displayUnit": one.display} if one.display else {}
    )
    return unit | {key: number(value) for key, value in numbers.items() if value is not None}


def kinds(one: Variable) -> dict[str, str]:
    initial = {"parameter": "exact", "output": "calculated"}.get(one.causality)
    variability = "discrete" if one.discrete else "continuous"
    if one.causality == "parameter":
        variability = "fixed" if one.fixed else "tunable"
    return {"causality": one.causality, "variability": variability} | (
        {"initial": initial} if initial else {}
    )


def places(variables: Iterable[Variable], causality: str) -> list[int]:
    return [k for k, one in enumerate(variables) if one.causality == causality]


def can_do(names: Iterable[str], model: CModel) -> dict[str, str]:
    """Capabilities of a model; by inputs that drive joints it has no derivatives."""
    return {name: "false" if model.drives and "Derivative" in name else "true" for name in names}


def description2(
    fmu: FMU, model: CModel, title: str, about: str, sources: list[str]
) -> xml.Element:
    """modelDescription.xml of FMI 2.0."""
    root = head(fmu, title, about, guid=fmu.token, numberOfEventIndicators="0")
    can = (
        "canHandleVariableCommunicationStepSize",
        "canInterpolateInputs",
        "canGetAndSetFMUstate",
        "canSerializeFMUstate",
        "providesDirectionalDerivative",
    )
    own = xml.SubElement(root, "CoSimulation", {"modelIdentifier": fmu.name} | can_do(can, model))
    files = xml.SubElement(own, "SourceFiles")
    for name in sources:
        xml.SubElement(files, "File", name=name)
    add_common(root, fmu, model)
    group = xml.SubElement(root, "ModelVariables")
    for k, one in enumerate(fmu.variables):
        place = xml.SubElement(
            group, "ScalarVariable", {"name": one.name, "valueReference": str(k)} | kinds(one)
        )
        xml.SubElement(place, "Real", attributes(one))
    structure = xml.SubElement(root, "ModelStructure")
    outputs, given = places(fmu.variables, "output"), places(fmu.variables, "parameter")
    for name, known in (("Outputs", []), ("InitialUnknowns", given)):
        if outputs:
            part = xml.SubElement(structure, name)
            for k in outputs:
                xml.SubElement(
                    part,
                    "Unknown",
                    index=str(k + 1),
                    dependencies=" ".join(str(j + 1) for j in known),
                )
    return root


def description3(
    fmu: FMU, model: CModel, title: str, about: str, sources: list[str]
) -> xml.Element:
    """modelDescription.xml of FMI 3.0; sources are in buildDescription.xml."""
    root = head(fmu, title, about, instantiationToken=fmu.token)
    can: tuple[str, ...] = (
        "canHandleVariableCommunicationStepSize", "canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives",
        "providesAdjointDerivatives", "providesIntermediateUpdate", "canReturnEarlyAfterIntermediateUpdate",
    )  # fmt: skip
    if model.events:
        can = (*can, "hasEventMode")
    xml.SubElement(
        root,
        "CoSimulation",
        {"modelIdentifier": fmu.name, "fixedInternalStepSize": number(model.step)}
        | can_do(can, model),
    )
    add_common(root, fmu, model)
    group = xml.SubElement(root, "ModelVariables")
    for k, one in enumerate(fmu.variables):
        between = one.causality in ("input", "output")
        place = xml.SubElement(
            group,
            "Float64",
            {"name": one.name, "valueReference": str(k)}
            | kinds(one)
            | ({"intermediateUpdate": "true"} if between else {})
            | attributes(one),
        )
        if one.size:
            xml.SubElement(place, "Dimension", start=str(one.size))
    structure = xml.SubElement(root, "ModelStructure")
    outputs, given = places(fmu.variables, "output"), places(fmu.variables, "parameter")
    for name, known in (("Output", []), ("InitialUnknown", given)):
        for k in outputs:
            xml.SubElement(
                structure, name, valueReference=str(k), dependencies=" ".join(map(str, known))
            )
    return root


def build_description(name: str, sources: list[str]) -> xml.Element:
    """buildDescription.xml of FMI 3.0: how the sources are compiled."""
    root = xml.Element("fmiBuildDescription", fmiVersion="3.0")
    files = xml.SubElement(
        xml.SubElement(root, "BuildConfiguration", modelIdentifier=name),
        "SourceFileSet",
        language="C99",
    )
    for one in sources:
        xml.SubElement(files, "SourceFile", name=one)
    return root


def pack(fmu: FMU, binaries: Iterable[Binary]) -> bytes:
    """The archive."""
    files = {name: text.encode() for name, text in fmu.files.items()}
    files |= {shapes.SKIN: fmu.skin} if fmu.skin else {}
    files |= {f"binaries/{one.folder}/{fmu.name}.{one.ending}": one.content for one in binaries}
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, FIRST)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return held.getvalue()
