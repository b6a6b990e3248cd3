"""Places of a model as terminals of an FMU (fmi-standard.org, FMI 3.0, 2.4.9): what a joint there would
connect stands together.

    force and torque in (flows, whose sum is zero where terminals meet), position, velocity and rotation out

A place is what variables have before the last dot of their names, as ports of parts are called.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree import ElementTree as xml

FILE = "terminalsAndIcons/terminalsAndIcons.xml"
FLOWS = "force", "torque"  #: how members of forces are called


def describe(variables: Iterable[tuple[str, str]]) -> xml.Element | None:
    """The file of terminals for variables, each with its causality; None where no place takes forces."""
    places: dict[str, dict[str, str]] = {}
    for name, causality in variables:
        place, dot, member = name.rpartition(".")
        if dot and causality in ("input", "output"):
            places.setdefault(place, {})[member] = causality
    found = {place: members for place, members in places.items() if is_port(members)}
    if not found:
        return None
    root = xml.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    group = xml.SubElement(root, "Terminals")
    for place, members in found.items():
        about = {"matchingRule": "plug", "description": "A place that forces act on"}
        terminal = xml.SubElement(group, "Terminal", {"name": place, **about})
        for member in members:
            kind = "inflow" if member.startswith(FLOWS) else "signal"
            names = {"variableName": f"{place}.{member}", "memberName": member}
            xml.SubElement(terminal, "TerminalMemberVariable", names | {"variableKind": kind})
    return root


def is_port(members: Mapping[str, str]) -> bool:
    """Whether forces go into a place and its positions come out, and nothing else."""
    return (
        any(name.startswith("position") for name in members)
        and any(name.startswith("force") for name in members)
        and all((one == "input") == name.startswith(FLOWS) for name, one in members.items())
    )
