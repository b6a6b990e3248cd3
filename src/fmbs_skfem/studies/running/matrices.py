"""Bodies of a scene as matrices, for other programs and for `type: matrices`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.io import mmwrite
from scipy.sparse import coo_array, csr_array

from ...bodies.body import Body, locate, probe
from ...core.algebra.linalg import alike
from ...core.errors import InputError, say
from ...dynamics.near_state.linear import linearise
from ...scenes import build
from ...scenes.matrices import Bundle, write_bundle
from ...systems import assemble, free_motions
from .. import job as jobs
from .. import parts, reports
from ..job import Job
from ..result import ReportTable, Result

READ = 1e-9  #: share of a function at a place, over the largest, that counts


def export(job: Job, name: str) -> Result:
    """Stiffness, mass and nodes of a body of a scene, as NAME.npz with its sets, and as Matrix
    Market and a table.
    """
    scene = jobs.read_scene(job)
    body, _ = parts.body_of(job, scene, name, "--matrices")
    bundle = of_body(job, body, name)
    files = [f"{name}.npz", f"{name}_K.mtx", f"{name}_M.mtx", f"{name}_nodes.csv"]
    out = jobs.settle_folder(job, files, f"matrices of {name}")
    report = {
        "status": "ok",
        "body": name,
        "nodes": len(bundle.nodes),
        "entries": bundle.stiffness.nnz,
        "sets": {key: len(ids) for key, ids in bundle.sets.items()},
        "provenance": reports.provenance(scene),
        "notices": job.notices,
    }
    lines: list[ReportTable | str] = [
        ReportTable(
            f"'{name}' as matrices",
            ("", "value"),
            [
                ("nodes and gradients", str(report["nodes"])),
                ("entries of K", str(report["entries"])),
            ],
        )
    ]
    if out is not None:
        write_bundle(out / files[0], bundle)
        for file, matrix in zip(files[1:3], (bundle.stiffness, bundle.mass), strict=True):
            mmwrite(out / file, coo_array(matrix), symmetry="symmetric", precision=17)
        rows = np.column_stack([bundle.numbers, bundle.nodes])
        head = "number, x [m], y [m], z [m]"
        np.savetxt(
            out / files[3], rows, ["%d", *["%.17g"] * 3], delimiter=", ", header=head, comments=""
        )
        report["files"] = files
        lines.append(f"written: {', '.join(str(out / file) for file in files)}")
    return Result(
        about=f"{name}: {len(bundle.nodes)} nodes and gradients", report=report, lines=lines
    )


def of_body(job: Job, body: Body, name: str) -> Bundle:
    """A body by K and M of its reference, its rims as sets of nodes and gradients.

    InputError for a body in the plane, and for one whose reference has no stiffness in some
    direction.
    """
    where = f"--matrices {name}"
    if body.dim != 3:
        raise InputError(say(where, "a body in space", "one in the plane", "take dimension 3"))
    scene = jobs.read_scene(job)
    model: Any = scene.bodies[name]
    free = body
    if body.frames and hasattr(model, "rims"):
        bare = replace(scene, bodies={**scene.bodies, name: replace(model, rims={})})
        found = build.parts(bare, allow_outside=job.allow_outside)
        free = next(one for one in found if one.name == name)
    system = assemble([free], pictures=False)
    free_motions.refuse_limp(where, system)
    K = csr_array(linearise(system).stiffness)
    n = len(free.reference)
    sets = slaved(body)
    for key in free.places:
        row = probe(free, locate(free, key)).toarray()[0]
        sets[key] = np.flatnonzero(np.abs(row) > READ * np.abs(row).max()) + 1
    return Bundle(
        free.reference + np.outer(free.constant, system.origin),
        np.arange(n) + 1,
        sets,
        csr_array(0.5 * (K + K.T)),
        alike(csr_array(0.5 * (free.mass + free.mass.T)), 3),
        None,
        free.constant,
    )


def slaved(body: Body) -> dict[str, np.ndarray]:
    """Numbers of the nodes and gradients that follow each rim of a body: those that read its frame,
    and those beside them that stay zero.
    """
    if body.spread is None:
        return {}
    read = {
        name: np.asarray(abs(body.spread[:, first : first + 4]).sum(axis=1)).ravel() > 0.0
        for name, first in body.frames.items()
    }
    still = np.flatnonzero(np.asarray(abs(body.spread).sum(axis=1)).ravel() == 0.0)
    found = {name: np.flatnonzero(ids) for name, ids in read.items()}
    if len(still) and found:
        # neighbours in the numbering: gradients of a node stand beside it
        near = np.stack([np.abs(still[:, None] - ids).min(axis=1) for ids in found.values()])
        for k, name in enumerate(list(found)):
            found[name] = np.union1d(found[name], still[near.argmin(axis=0) == k])
    return {name: ids + 1 for name, ids in found.items()}
