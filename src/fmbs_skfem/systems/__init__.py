"""Systems of bodies, joints, loads and probes."""

from . import (
    bushing,
    contact_beams,
    contact_states,
    contacts,
    controllers,
    controls,
    events,
    fields,
    gauges,
    joints,
    loads,
    monitors,
    probes,
    springs,
    stresses,
)
from .assembly import Motion, Rayleigh, assemble, eliminate
from .checks import check_force, check_joint, check_system
from .compiled import Compiled, compile_system
from .operators import constraints, force, strain_energy, tangent
from .places import At
from .system import System, change_coordinates

__all__ = [
    "At",
    "fields",
    "joints",
    "loads",
    "springs",
    "contacts",
    "contact_beams",
    "contact_states",
    "controls",
    "controllers",
    "events",
    "monitors",
    "bushing",
    "probes",
    "gauges",
    "stresses",
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
    "check_joint",
    "check_force",
    "check_system",
]
