"""What extensions of one's own are made of: this list stays, wherever its names are defined.

    from fmbs_skfem.extend import Joint, At, fields, quantity

Joints, loads, outputs, bodies, analyses and monitors that scenes name; laws, forces and joints in
symbols; hyper-reductions; elements of other interpolations. `docs/extensions.md` has a recipe for
every kind.
"""

from __future__ import annotations

from .bodies import own_laws, rigid
from .bodies.body import Body
from .control.monitors import Monitor
from .core.declared import Declared
from .core.errors import InputError, SolverError
from .core.notices import notify
from .core.values.expressions import of_time
from .core.values.fields import Count, Position, Time, quantity
from .core.values.problems import Problem
from .dynamics import GeneralizedAlpha
from .dynamics.observers import Observer
from .reduction import HyperReduction, Level, ecsw, sampling
from .reduction.hyper.hyper_reduction import Rule, register
from .scenes.analyses import Analysis, Form, History, States, StateTable, Work
from .scenes.analyses.dynamic import Dynamic
from .scenes.bodies import SceneBody
from .scenes.schema import Scene
from .shapes import surface
from .shapes.surface import Parent, Surface
from .shapes.table import check_table
from .systems import At, System, fields, joints, loads, probes
from .systems.connections.joints import Joint
from .systems.connections.own_joints import OwnJoint
from .systems.forces.force_functions import force
from .systems.forces.loads import Load
from .systems.forces.own_forces import OwnForce, norm
from .systems.measures.probes import Probe, Sensed
from .systems.places import Draft
from .systems.system import Output

__all__ = [
    "Analysis",
    "At",
    "Body",
    "Count",
    "Declared",
    "Draft",
    "Dynamic",
    "Form",
    "GeneralizedAlpha",
    "History",
    "HyperReduction",
    "InputError",
    "Joint",
    "Level",
    "Load",
    "Monitor",
    "Observer",
    "Output",
    "OwnForce",
    "OwnJoint",
    "Parent",
    "Position",
    "Probe",
    "Problem",
    "Rule",
    "Scene",
    "SceneBody",
    "Sensed",
    "SolverError",
    "StateTable",
    "States",
    "Surface",
    "System",
    "Time",
    "Work",
    "check_table",
    "ecsw",
    "fields",
    "force",
    "joints",
    "loads",
    "norm",
    "notify",
    "of_time",
    "own_laws",
    "probes",
    "quantity",
    "register",
    "rigid",
    "sampling",
    "surface",
]
