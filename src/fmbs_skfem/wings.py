"""What stands beside the engine, and the names of modules that scripts and extensions may rely on
wherever these are.
"""

from __future__ import annotations

from .core import beside

#: loaded with the engine, for files and systems that have what is theirs
LOADED = ("contact", "parts", "control")

NAMES = {
    "core.expressions": "core.values.expressions",
    "core.fields": "core.values.fields",
    "core.mappings": "core.values.mappings",
    "core.problems": "core.values.problems",
    "core.responses": "core.values.responses",
    "core.tables": "core.values.tables",
    "core.validation": "core.storage.validation",
    "systems.joints": "systems.connections.joints",
    "systems.own_joints": "systems.connections.own_joints",
    "systems.loads": "systems.forces.loads",
    "systems.springs": "systems.forces.springs",
    "systems.own_forces": "systems.forces.own_forces",
    "systems.force_functions": "systems.forces.force_functions",
    "systems.probes": "systems.measures.probes",
    "systems.stresses": "systems.measures.stresses",
    "systems.contacts": "contact.contacts",
    "systems.contact_beams": "contact.beams",
    "systems.contact_states": "contact.states",
    "systems.controllers": "control.controllers",
    "systems.events": "control.events",
    "systems.monitors": "control.monitors",
    "dynamics.start": "control.live:start",
    "dynamics.LiveRun": "control.live:LiveRun",
    "dynamics.live": "control.live",
    "reduction.hyper_reduction": "reduction.hyper.hyper_reduction",
    "reduction.sampling": "reduction.hyper.sampling",
    "reduction.parts": "parts.bodies",
    "reduction.part_files": "parts.files",
    "reduction.excitation": "parts.excitation",
    "reduction.calibration": "families.calibration",
    "reduction.greedy": "families.greedy",
    "reduction.kriging": "families.kriging",
    "reduction.members": "families.members",
    "reduction.parametric_model": "families.parametric_model",
    "reduction.prediction": "families.prediction",
    "reduction.response_surfaces": "families.response_surfaces",
    "reduction.sensitivity": "families.sensitivity",
    "reduction.sweeps": "families.sweeps",
    "reduction.training": "families.training",
    "reduction.train": "families.training:train",
    "reduction.FinishedTraining": "families.training:FinishedTraining",
    "scenes.dynamic": "scenes.analyses.dynamic",
}


def tell(package: str) -> None:
    """Tell the engine."""
    beside.tell(
        [f"{package}.{name}" for name in LOADED],
        {f"{package}.{one}": f"{package}.{place}" for one, place in NAMES.items()},
    )
