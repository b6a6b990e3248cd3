"""Systems of bodies, joints, loads and probes."""

from ..core.beside import names_of
from . import fields
from .assembly import Motion, Rayleigh, assemble, eliminate
from .checks import check_force, check_joint, check_system
from .compiled import Compiled, compile_system
from .connections import joints
from .forces import along_lines, bushing, controls, gauges, line_loads, loads, springs
from .measures import (
    line_places,
    line_stresses,
    orientations,
    probes,
    recovered,
    sensors,
    stresses,
    utilisation,
)
from .operators import constraints, force, strain_energy, tangent
from .places import At
from .prepared import Prepared, alike, prepare
from .system import System, change_coordinates

__all__ = [
    "At",
    "fields",
    "joints",
    "line_loads",
    "loads",
    "springs",
    "along_lines",
    "controls",
    "bushing",
    "probes",
    "line_places",
    "line_stresses",
    "orientations",
    "sensors",
    "gauges",
    "stresses",
    "recovered",
    "utilisation",
    "Rayleigh",
    "Motion",
    "System",
    "assemble",
    "eliminate",
    "change_coordinates",
    "force",
    "tangent",
    "constraints",
    "strain_energy",
    "Compiled",
    "compile_system",
    "Prepared",
    "prepare",
    "alike",
    "check_joint",
    "check_force",
    "check_system",
]

__getattr__ = names_of(__name__)
