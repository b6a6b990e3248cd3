"""A scene and its meshes, read, assembled and judged before any run; and results compared with
their checksums.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csgraph

from ..bodies import body as bodies
from ..bodies import edge_directions, plate
from ..bodies.from_matrices import rigidity
from ..core.errors import Contradiction, InputError, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.display import DisplayUnits, largest_of
from ..dynamics import initial, rest
from ..dynamics.diagnoses.step_size import find_cornered_drives
from ..scenes import build, consistency, plausibility, where
from ..shapes.surface import Surface
from ..systems import compiled, free_motions, layouts
from ..systems.connections import edges, hinged_rims
from ..systems.connections import mechanism as mechanisms
from ..systems.connections.redundancy import rows_of, without_redundant
from ..systems.system import driven_rows
from . import job as jobs
from . import reports
from .job import Job
from .result import ReportTable, Result
from .running import check_summary, estimates, exportable

if TYPE_CHECKING:
    from ..bodies.body import Body
    from ..scenes import Scene
    from ..scenes.figures import BodyFigures as Facts
    from ..systems import System
    from ..systems.connections.mechanism import Dependence, Mechanism

NAME = "check.json"
LISTED = 6  #: motions that are shown
PLACES = 30  #: named places that are shown
LOST = 0.5  #: part of the kinetic energy of the given initial motion that joints may take away
AGREE = 1e-9  #: of the size of the scene: linear rows that miss each other by less agree


@dataclass(frozen=True, repr=False, kw_only=True)
class Check(Result):
    """What a scene is."""

    scene: Scene
    system: System  #: in the form that is solved
    mechanism: Mechanism


def check_scene(job: Job, scene: Scene, target: str | None = None, tables: bool = False) -> Check:
    """The judgement of a scene, in few lines or in `tables`; where its model is to be exported to a
    `target`, InputError for what that cannot have.
    """
    build.check_functions(scene)
    parts = {part.name: part for part in build.parts(scene, None, job.allow_outside)}
    raw = build.of_parts(scene, list(parts.values()), pictures=False)
    if target is not None:
        exportable.require(scene, raw, f"--for {target}")
    raw = lighter(raw) if scene.analysis.drawn else raw
    known = plausibility.figures(scene, parts)
    notify(*find_odd(scene, known))
    redundant = [one for one in contradictions(raw) if not meets(one, raw.constraints.edges)]
    counted = mechanism(scene, raw)
    notify(*judge_mechanism(scene, raw, counted))
    reduced, initial = solved_form(scene, raw)
    eliminated = raw.size - reduced.size
    report: dict[str, Any] = {
        "status": "ok",
        **jobs.facts(scene, raw, reduced),
        "redundant_constraints": len(raw.constraints.names)
        - eliminated
        - len(reduced.constraints.names),
        "redundant": [
            {"row": dependence.row, "follows_from": dependence.on} for dependence in redundant
        ],
        "mass": sum(figure.mass for figure in known.values()),
        "bodies": [describe_body(figure, parts[name], counted) for name, figure in known.items()],
        "joints": dict(Counter(joint for joint, _ in raw.constraints.names)),
        "edges": [held for joint in scene.joints.values() if (held := held_edge(joint, parts))],
        "mechanism": mechanism_report(counted) | {"free_motions": free_motions_of(raw, counted)},
        "initial": initial,
        "estimates": estimates.estimates(scene, raw, reduced),
        "outputs": [column for output in raw.outputs.values() for column in output.columns],
        "notices": job.notices,
        **({"accuracy": str(job.wanted)} if job.wanted else {}),
    }
    reports.write_report(jobs.settle_folder(job, [NAME], report["fingerprint"], NAME), report, NAME)
    about = f"{report['scene']}: {raw.size} coordinates, {counted.mobility} degrees of freedom of rigid bodies"
    found = "what the scene leaves open of step and cells is found when it runs; the estimates count with some step and its meshes"
    short = check_summary.summarise(report, str(job.path), job.changes)
    shown = view(report) if tables else short
    lines = [*shown, *([f"accuracy {job.wanted}: {found}"] if job.wanted else [])]
    return Check(
        about=about, report=report, lines=lines, scene=scene, system=reduced, mechanism=counted
    )


def meets(one: Dependence, held: tuple[str, ...]) -> bool:
    """Whether a row of a held edge follows from those of held edges alone: they meet."""
    return all(row.partition(".")[0] in held for row in (one.row, *one.on))


def held_edge(joint: Any, parts: Mapping[str, Body]) -> dict[str, Any]:
    """The nodes of a held edge, and how many of them are corners, which have all of their slopes
    held; nothing of other joints.
    """
    if (
        not isinstance(joint, edges.Edge)
        or (body := parts.get(joint.body)) is None
        or not isinstance(body.space, Surface)
    ):
        return {}
    if edge_directions.derivatives(body.space.space) is None:
        return {}
    nodes, corners = edge_directions.corners(
        body.space, plate.edge(f"joint '{joint.name}'", body.space, joint.edges)
    )
    return {"joint": joint.name, "nodes": nodes, "corners": corners}


def compare_checksums(job: Job) -> Result:
    """The results in the folder of a job beside their checksums."""
    from ..results import segments  # with all that draws, which no scene needs

    found = reports.verify_checksums(job.path)
    if segments.exists(job.path):
        segments.read(job.path)
        found.append(job.path / segments.FOLDER)
    if not found:
        raise InputError(
            say(
                f"{job.path}",
                "a scene, or a folder with results",
                "a folder without a report",
                "name a file",
            )
        )
    text = "as written: " + ", ".join(map(str, found))
    return Result(
        about=text, report={"status": "ok", "verified": found, "notices": job.notices}, lines=[text]
    )


def find_odd(scene: Scene, known: Mapping[str, Facts]) -> Iterator[str]:
    """What is hardly meant, but for what was shown when the scene was read."""
    shown = {keys for keys, _ in consistency.notices(scene)}
    for finding in plausibility.findings(scene, known):
        if finding.keys not in shown:
            yield f"{where(scene, *finding.keys)}: {finding}"


def contradictions(raw: System) -> tuple[Dependence, ...]:
    """Redundant rows; those that contradict what they follow from, or drive what is held already,
    stop the check.
    """
    found = mechanisms.redundant(raw)
    wrong = sorted((one for one in found if one.gap > AGREE * raw.scale), key=lambda one: -one.gap)
    if wrong:
        listed = ", ".join(
            f"{one.row} by {one.gap:.3g} m with {' and '.join(one.on)}" for one in wrong
        )
        worst = tuple((one.row, one.gap) for one in wrong)
        others = [row for one in wrong for row in one.on]
        raise Contradiction(
            say("joints contradict each other", "rows that agree", listed, "remove or move one"),
            worst,
            others,
        )
    if driven := mechanisms.driven_against(raw, found):
        raise mechanisms.conflict(driven)
    return found


def mechanism(scene: Scene, raw: System) -> Mechanism:
    """Degrees of freedom, where the analysis takes the system."""
    scene.analysis.examine(scene, raw)
    found = mechanisms.analyse(raw)
    swings = hinged_rims.find(raw).shape[1]
    more = {
        key: getattr(found, key) + swings for key in ("mobility", "gruebler", "at_start", "free")
    }
    return replace(found, **more) if swings else found


def judge_mechanism(scene: Scene, raw: System, found: Mechanism) -> Iterator[str]:
    """Bodies that float, a singular start, nothing that moves, and drives with corners."""
    for group in found.floating if scene.analysis.floats else ():
        named = " and ".join(f"'{name}'" for name in group.bodies)
        text = f"no joint ties {named} to the ground: {'they move' if len(group.bodies) > 1 else 'it moves'} freely"
        yield f"{where(scene, 'bodies', group.bodies[0])}: {text}"
    if found.at_start > found.mobility:
        yield f"the start is a singular position: {found.at_start} degrees of freedom there, {found.mobility} near it"
    if scene.analysis.moves:
        if not raw.elastic and not found.mobility:
            yield "nothing can move: all bodies are rigid, and joints leave no degree of freedom"
        yield from find_cornered_drives(raw, scene.analysis.instants())


def lighter(raw: System) -> System:
    """A wide system at rest without its mass, of which check reads nothing, and which would fill
    the memory.
    """
    if raw.size < layouts.WIDE or raw.v0.any() or driven_rows(raw.constraints).any():
        return raw
    empty = type(raw.mass)(raw.mass.shape)
    return replace(raw, mass=empty, metric=empty)


def solved_form(scene: Scene, raw: System) -> tuple[System, dict[str, Any]]:
    """The form the scene is solved in, and what its joints make of the initial state; velocities
    are those of motions alone.
    """
    reduced = without_redundant(build.chosen_form(scene, raw))
    if not scene.analysis.moves:
        scene.analysis.require_joints(reduced)
        return reduced, {
            "position_change": float(np.abs(reduced.lift(reduced.x0) - raw.x0).max(initial=0.0))
        }
    analysis = build.dynamic(scene)
    whole = raw
    begin = reduced
    if not analysis.drawn:
        x, v, _ = rest.in_equilibrium(reduced, analysis.newton)
        begin = replace(reduced, x0=x, v0=v)
        whole = replace(raw, x0=reduced.lift(x), v0=np.asarray(reduced.lift.matrix @ v))
    gaps = velocity_gaps(whole)
    x, v = initial.admissible(begin, analysis.scheme)
    taken = np.asarray(reduced.lift.matrix @ v)
    given, left = (float(u @ (raw.mass @ u)) for u in (whole.v0, taken))
    lost = max(0.0, 1.0 - left / given) if given > 0.0 else 0.0
    if lost > LOST:
        listed = ", ".join(f"{name} by {gap:.3g} m/s" for name, gap in gaps[:3])
        got = f"{100 * lost:.3g} % of their kinetic energy against {listed}"
        raise InputError(
            say(
                where(scene, "initial"),
                "velocities that the joints permit",
                got,
                "give motions of all joined bodies",
            )
        )
    moved = float(np.abs(reduced.lift(x) - raw.x0).max(initial=0.0))
    return (
        reduced,
        {
            "position_change": moved,
            "velocity_change": float(np.abs(taken - whole.v0).max(initial=0.0)),
            "energy_lost": lost,
            "worst_velocities": [{"row": name, "gap": gap} for name, gap in gaps[:5]],
        },
    )


def velocity_gaps(raw: System) -> list[tuple[str, float]]:
    """Rows that the given velocities break, the largest first.

        Phi_q v + Phi_t

    Phi_t by differences over 2 us.
    """
    if not raw.constraints.names:
        return []
    (rows, z) = rows_of(raw)
    d = 1e-6
    first, second, third = (
        replace(rows, signals=compiled.signal_table(raw, np.array([k * d]))[0])(z)[0]
        for k in range(3)
    )
    gap = np.abs(rows(z)[1] @ raw.v0[rows.used] + (4 * second - 3 * first - third) / (2 * d))
    bound = 1e-6 * max(1.0, float(np.abs(raw.v0).max(initial=0.0)))
    return [
        (".".join(raw.constraints.names[k]), float(gap[k]))
        for k in np.argsort(-gap)
        if gap[k] > bound
    ]


def describe_body(figure: Facts, part: Body, counted: Mechanism) -> dict[str, Any]:
    """A body in the report."""
    cells = figure.cells
    return {
        "name": figure.name,
        "cells": 0 if cells is None else cells.count,
        "dofs": part.reference.size,
        "mass": figure.mass,
        "rigid_motions": counted.bodies[figure.name],
        "extent": figure.extent,
        **geometry(figure, part),
        **of_matrices(part),
        "wave_speed": figure.wave_speed,
        "slenderness": figure.slenderness,
        "sag": figure.sag,
        "weight_strain": figure.weight_strain,
        "mesh": None if cells is None else asdict(cells),
    }


def of_matrices(part: Body) -> dict[str, Any]:
    """Centre of mass [m], principal inertia [kg m2] and interfaces of a body of matrices; nothing of
    others.
    """
    if part.linear is None:
        return {}
    center, inertia = rigidity(part)
    kinds = {
        name: ("average (RBE3)" if name in part.fits else "rigid (RBE2)", 6) for name in part.frames
    } | dict.fromkeys(part.places, ("node", 3))
    return {
        "center": center.tolist(),
        "principal_inertia": np.linalg.eigvalsh(inertia).tolist(),
        "interfaces": {
            name: {"couples": couples, "coordinates": count}
            for name, (couples, count) in kinds.items()
        },
    }


def geometry(figure: Facts, part: Body) -> dict[str, Any]:
    """Where a body is in the reference: the box around its points [m], its length [m] or area [m2],
    pieces and named places [m].

    Functions that share no mass belong to different pieces; those without any, as axes of rims
    across a plate, to none.
    """
    points = bodies.positions(part)
    names = [*part.frames, *(name for name in part.places if name not in part.frames)]
    places = {
        name: (bodies.probe(part, bodies.locate(part, name)) @ part.reference)[0].tolist()
        for name in names
    }
    pieces = 1
    if part.space is not None and part.shapes is None and part.linear is None:
        heavy = np.flatnonzero(part.mass.diagonal() > 0.0)
        pieces = int(
            csgraph.connected_components(
                part.mass[heavy][:, heavy], directed=False, return_labels=False
            )
        )
    return {
        "box": [points.min(axis=0).tolist(), points.max(axis=0).tolist()],
        "length": figure.length,
        "area": figure.area,
        "pieces": pieces,
        "places": places,
    }


def mechanism_report(found: Mechanism) -> dict[str, Any]:
    """Degrees of freedom in the report: by rank and by Gruebler's formula, with every joint."""
    return {
        "rigid_motions": sum(found.bodies.values()),
        "joints": [asdict(joint) for joint in found.joints],
        "degrees_of_freedom": found.mobility,
        "gruebler": found.gruebler,
        "overconstrained": [
            {"row": one.row, "follows_from": one.on} for one in found.overconstrained
        ],
        "at_start": found.at_start,
        "left_by_drives": found.free,
        "floating": [group.bodies for group in found.floating],
    }


def free_motions_of(raw: System, counted: Mechanism) -> list[str]:
    """The motions that drives leave, in words; none in a singular position, where there are more
    than near it.
    """
    found = (
        [*map(str, free_motions.left_by_drives(raw)), *hinged_rims.named(raw)]
        if counted.free
        else []
    )
    return found if len(found) == counted.free else []


def view(found: dict[str, Any]) -> list[Any]:
    """The tables of a checked scene."""
    columns = (
        "name",
        "cells",
        "dofs",
        "mass",
        "rigid_motions",
        "extent",
        "wave_speed",
        "slenderness",
        "sag",
    )
    titles = (
        "body",
        "cells",
        "dofs",
        "mass [kg]",
        "rigid motions",
        "size [m]",
        "wave speed [m/s]",
        "slenderness",
        "sag / length",
    )
    display = DisplayUnits.of(found)
    rows = [[body[key] for key in columns] for body in found["bodies"]]
    keys = ("count", "size_ratio", "aspect", "angle", "jacobian")
    meshes = [
        (body["name"], *(body["mesh"][key] for key in keys))
        for body in found["bodies"]
        if body["mesh"]
    ]
    counted = {joint["name"]: joint for joint in found["mechanism"]["joints"]}
    joints = [joint_row(name, count, counted.get(name)) for name, count in found["joints"].items()]
    facts = [
        (key, found[key])
        for key in (
            "dofs",
            "constraints",
            "unknowns",
            "multipliers",
            "redundant_constraints",
            "mass",
        )
    ]
    facts += [
        (f"initial {key}", value)
        for key, value in found["initial"].items()
        if isinstance(value, float) and value > 1e-9
    ]
    parts = [
        f"{found['scene']} ({found['analysis']}): the scene is valid",
        ReportTable("Bodies", *display.columns(titles, rows)),
        *where_bodies_are(found["bodies"], display),
        ReportTable("Joints", ("joint", "constraints", "rigid motions taken", "ties"), joints),
        mechanism_table(found["mechanism"]),
        ReportTable(
            "System",
            ("", ""),
            [*facts, *((f"estimated {key}", value) for key, value in found["estimates"].items())],
        ),
    ]
    parts += [
        f"{one['joint']}: {one['corners']} of {one['nodes']} nodes are held as corners"
        for one in found["edges"]
    ]
    parts += [
        f"free motion after drives: {motion}"
        for motion in found["mechanism"]["free_motions"][:LISTED]
    ]
    redundant = [(one["row"], ", ".join(one["follows_from"])) for one in found["redundant"]]
    parts += (
        [ReportTable("Redundant rows", ("row", "follows from"), redundant)] if redundant else []
    )
    heads = ("mesh of", "cells", "largest / smallest", "aspect", "angle [deg]", "Jacobian ratio")
    return [*parts[:2], *([ReportTable("Meshes", heads, meshes)] if meshes else []), *parts[2:]]


def where_bodies_are(found: list[dict[str, Any]], display: DisplayUnits) -> list[Any]:
    """The tables of boxes and of named places, of which the first are shown."""
    unit, size = display.find(
        "m", largest_of(np.array([body["box"] for body in found])), prefixes=False
    )
    boxes = [
        (
            body["name"],
            *(point(at, body["extent"], size) for at in body["box"]),
            f"{body['length'] / size:.6g} {unit}"
            if body["length"]
            else f"{body['area']:.6g} m2"
            if body["area"]
            else "-",
            body["pieces"],
        )
        for body in found
    ]
    places = [
        (f"{body['name']}.{name}", point(at, body["extent"], size))
        for body in found
        for name, at in body["places"].items()
    ]
    more = (
        [f"and {len(places) - PLACES} more places, all of them with --json"]
        if len(places) > PLACES
        else []
    )
    tables = [
        ReportTable(
            "Geometry",
            ("body", f"from [{unit}]", f"to [{unit}]", "length or area", "pieces"),
            boxes,
        )
    ]
    return [
        *tables,
        *([ReportTable("Places", ("place", f"at [{unit}]"), places[:PLACES])] if places else []),
        *more,
        *tables_of_matrices([body for body in found if "interfaces" in body]),
    ]


def tables_of_matrices(found: list[dict[str, Any]]) -> list[Any]:
    """The tables of what bodies of matrices are as rigid ones, and of their interfaces."""
    if not found:
        return []
    rigid = [
        (
            body["name"],
            point(body["center"], body["extent"], 1.0),
            ", ".join(f"{x:.5g}" for x in body["principal_inertia"]),
        )
        for body in found
    ]
    interfaces = [
        (f"{body['name']}.{name}", one["couples"], one["coordinates"])
        for body in found
        for name, one in body["interfaces"].items()
    ]
    heads = ("body of matrices", "centre of mass [m]", "principal inertia [kg m2]")
    return [
        ReportTable("Matrices", heads, rigid),
        ReportTable("Interfaces", ("place", "couples", "coordinates"), interfaces),
    ]


def point(at: list[float], extent: float, size: float) -> str:
    """A point in a table, in a unit of some size; coordinates that are nothing beside the extent of
    its body are 0.
    """
    return "(" + ", ".join(f"{x / size if abs(x) > 1e-12 * extent else 0.0:.5g}" for x in at) + ")"


def joint_row(name: str, constraints: int, counted: dict[str, Any] | None) -> tuple[object, ...]:
    """A joint, or the axes of a frame, in the table."""
    if counted is None:
        return name, constraints, "-", "axes of a frame, or the place of a joint"
    ends = [*counted["bodies"], *(["ground"] if counted["ground"] else [])]
    return (
        name,
        constraints,
        counted["rows"],
        " - ".join(ends) + (" (driven)" if counted["driven"] else ""),
    )


def mechanism_table(found: dict[str, Any]) -> ReportTable:
    """Gruebler's count beside the count by rank."""
    taken = sum(joint["rows"] for joint in found["joints"] if not joint["driven"])
    involved = {
        name.partition(".")[0]: None
        for one in found["overconstrained"]
        for name in (one["row"], *one["follows_from"])
    }
    excess = f"{len(found['overconstrained'])} ({', '.join(involved)})" if involved else "0"
    rows = [
        ("rigid motions of all bodies", found["rigid_motions"]),
        ("taken by joints, one by one", taken),
        ("degrees of freedom by Gruebler's count", found["gruebler"]),
        ("redundant constraints (rigid bodies)", excess),
        ("degrees of freedom by rank", found["degrees_of_freedom"]),
        ("free motions after drives", found["left_by_drives"]),
    ]
    return ReportTable("Mechanism", ("", ""), rows)
