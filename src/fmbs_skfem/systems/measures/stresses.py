r"""Strains, stresses and section forces at a place, as outputs, with axes that move with the body.

    surfaces    E(z) = E + z k,  S(z) = N/t + 12 z M/t^3 at z = -t/2, 0, t/2 along n; N = A C:E, M = B C:k (`stress_recovery`)
    principal   s1, s2 = (s11 + s22)/2 +- sqrt((s11 - s22)^2/4 + s12^2),   angle of direction 1:  tan 2a = 2 s12 / (s11 - s22)
    cables      N along the line and M, which balance the loads on either side                                  (`cable_sections`)

Components 1 and 2 refer to two orthonormal tangents of the reference shape, which the body carries
along: axis 1 is the x axis of the scene as far as the surface allows (where it is nearly normal to
x, the y axis), axis 2 = normal x axis 1. Stresses and forces of surfaces are those of Piola and
Kirchhoff, which are the true ones where strains are small. A positive M of a surface stretches the
face z = t/2; that of a cable in the plane turns it counter-clockwise along its length, in space M
is about the binormal.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np

from ...bodies.body import Body, locate
from ...bodies.solids import solid_law
from ...bodies.stress_recovery import principal
from ...core.notices import notify, remark
from ...core.storage.records import dataclass
from ...core.values.fields import quantity
from ...shapes import line
from ...shapes.solids.solid import Solid
from ...shapes.surface import Surface
from .. import fields
from ..places import At, Draft
from ..system import Output
from . import beam_sections, cable_sections, solid_points
from .probes import Probe, Sensed, Sizes
from .surface_points import counts, recovered, surface_point

FACES = ("bottom", "middle", "top")
Face = Annotated[
    Literal["top", "middle", "bottom"],
    "on the face at t/2 along the normal, in the middle surface, or at -t/2",
]
NEAR = 1e-9  #: part of a line by which two places on it may be apart that are one
STRAINS = ("axial or membrane strain", "curvature")
COMPONENTS = ("11", "22", "12")
TENSOR = (*COMPONENTS, "1", "2", "angle")
CABLE_PLANE = ("N", "M")
CABLE_SPACE = ("N", "M", "Mx", "My", "Mz")
RESULTANTS = ("N11", "N22", "N12", "N1", "N2", "M11", "M22", "M12", "M1", "M2")
MEMBRANE = RESULTANTS[:5]


def principal_axes(tensor: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Principal values s1 >= s2 (...) and the angle of direction 1 from axis 1 [rad] of tensors 11,
    22, 12 (3, ...).

        s1, s2 = (s11 + s22)/2 +- sqrt((s11 - s22)^2/4 + s12^2),    tan 2a = 2 s12 / (s11 - s22)

    The values have the unit of the tensor.
    """
    return *principal(tensor), 0.5 * np.arctan2(tensor[2], 0.5 * (tensor[0] - tensor[1]))


def axes_text(axes: np.ndarray) -> str:
    """Axes 1 and 2 of the reference, rows of (2, c), in words."""
    shown = [", ".join(f"{value + 0.0:.4g}" for value in np.round(axis, 6)) for axis in axes]
    return f"axis 1 ({shown[0]}), axis 2 ({shown[1]}) of the reference"


class Tensor(Probe, ABC):
    """A symmetric tensor at a named point: of a plate or shell with its principal values and the
    angle of the first [rad], of a solid with its principal values.

    Columns are NAME_11, NAME_22, NAME_12, NAME_1, NAME_2 and NAME_angle, or NAME_xx, NAME_yy,
    NAME_zz, NAME_xy, NAME_yz, NAME_zx, NAME_1, NAME_2 and NAME_3. InputError where the point does
    not exist.
    """

    at: fields.OnSurface
    face: Face
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        part = draft.layout.body(where, self.at)
        if isinstance(part.space, Solid):
            node = solid_points.node_of(where, part, self.at.place)
            columns = tuple(f"{name}_{one}" for one in (*solid_points.TENSOR, *solid_points.VALUES))
            found = solid_points.facts(where, draft, part, node)
            return self.output(draft, columns, labels=solid_points.LABELS, **found)
        tell_coarse(where, part)
        point = surface_point(where, draft, self.at)
        text = axes_text(point.axes)
        turn = f"angle from axis 1 to the first principal direction, {text}"
        labels = (
            *(f"{part}, {text}" for part in COMPONENTS),
            "first principal value",
            "second principal value",
            turn,
        )
        parameters = (float(FACES.index(self.face)), *point.parameters)
        columns = tuple(f"{name}_{part}" for part in TENSOR)
        facts = {**point.facts(self.at.body), "parameters": parameters}
        return self.output(draft, columns, [point.rows], labels=labels, **facts)

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        if output.law is not None:
            return (cls.unit,) * len(output.columns)
        return (*(cls.unit,) * 5, "rad")

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        if output.law is not None:
            return 9, len(solid_points.LABELS), output.law.rows - 1
        rows, parameters = counts(output.parameters[1], dim)
        return rows, len(TENSOR), 1 + parameters


def tell_coarse(where: str, part: Body) -> None:
    """A remark of what the shape functions of a part leave out of strains, of a line also of
    forces, in its training.

    Nothing is said of full bodies, nor of parts whose training has not kept its errors.
    """
    if part.shapes is None or part.cells is None or not (errors := part.shapes.strain_errors).size:
        return
    largest = np.abs(part.shapes.trained).max(axis=0)
    if isinstance(part.space, Surface):
        known = [f"{errors[0] * largest.max():.2g} of membrane strain"]
    else:
        # of a beam both curvatures and torsion are in the second error, whose largest value is that
        # of the larger one
        strain, curvature = errors * [largest[0], largest[1:].max()]
        if part.profile is None:
            EA, EI = part.cells.section[:2].max(axis=(1, 2))
        else:
            EA, EI = (part.profile.stiffness[:, rows, rows].max() for rows in (0, [4, 5]))
        known = [
            f"{strain:.2g} of axial strain (N: {strain * EA:.2g} N)",
            f"{curvature:.2g} 1/m of curvature (M: {curvature * EI:.2g} N m)",
        ]
    shares = [
        f"{value:.2g} of the largest {kind}" for kind, value in zip(STRAINS, errors, strict=False)
    ]
    what = f"the shape functions of part '{part.name}' leave out {' and '.join(known)} in its training, {' and '.join(shares)}"
    remark(
        f"{where}: {what}; forces and stresses at points err by as much, however small they are: train with a smaller tolerance"
    )


@dataclass(frozen=True)
class StressTensor(Tensor):
    """Stress [Pa] at a named point: of a plate or shell 11, 22, 12, principal values 1 and 2, angle
    [rad] of the first to axis 1; of a solid xx, yy, zz, xy, yz, zx and principal values 1, 2 and 3.

    A solid's is the true (Cauchy) stress in the axes of its mesh, which turn with the material, the
    mean of those of the cells there. Of surfaces axis 1 is the x axis of the scene as far as the surface allows, axis 2 normal to it in the
    surface; both move with the body. It is the second stress of Piola and Kirchhoff, the true one
    where strains are small.

    {type: stress_tensor, at: plate.corner, face: bottom}
    """

    at: fields.OnSurface
    face: Face = "top"
    unit: ClassVar[str] = "Pa"

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        if output.law is not None:
            u = solid_points.gradients(sensed)
            return solid_points.tensor_columns(solid_points.stresses(output, u))
        stress = recovered(output.parameters[1:], sensed.values).stress[int(output.parameters[0])]
        return [*stress, *principal_axes(stress)]


@dataclass(frozen=True)
class StrainTensor(Tensor):
    """Green's strain [-] at a named point: of a plate or shell 11, 22, 12, principal values 1 and
    2, angle [rad] of the first; of a solid xx, yy, zz, xy, yz, zx and principal values 1, 2 and 3.

    Axes as those of `stress_tensor`; 12 is half of the angle of shear.

    {type: strain_tensor, at: plate.corner, face: middle}
    """

    at: fields.OnSurface
    face: Face = "top"

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        if output.law is not None:
            return solid_points.tensor_columns(solid_law.strains(solid_points.gradients(sensed)))
        found = recovered(output.parameters[1:], sensed.values)
        strain = (
            found.strain
            + (0.5 * output.parameters[0] - 0.5) * output.parameters[2] * found.curvature
        )
        return [*strain, *principal_axes(strain)]


@dataclass(frozen=True)
class SectionForces(Probe):
    """Forces and moments of the section at a place of a cable or beam, or at a named point of a
    plate or shell.

    Cables have the axial force N [N] and the bending moment M [N m], in the plane with its sign
    (counter-clockwise along the line), in space with its vector Mx, My, Mz: what balances the loads
    beyond the place, without damping. N does so on coarse meshes too, some cells away from forces
    inside the line; M has the error of the curvature. Beams with torsion have N, Vy, Vz [N] and T,
    My, Mz [N m] along and about the axes of the section at the place: x along the beam, y and z
    across; of those that warp the bimoment B = -E I_w kappa_x' of Vlasov [N m^2], too; in the plane N,
    V, to the left of the line, and M, counter-clockwise. Plates and shells have membrane forces N11,
    N22, N12 [N/m] and moments M11, M22, M12 [N] a length, positive where they stretch the face at
    t/2, with principal values N1, N2, M1, M2; stresses and axes are those of `stress_tensor`, lengths
    those of the reference.

    {type: section_forces, at: beam.left}
    """

    at: fields.Place
    unit: ClassVar[str] = "N"
    calls = ()

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        part = draft.layout.body(where, self.at)
        tell_coarse(where, part)
        if isinstance(part.space, Surface):
            point = surface_point(where, draft, self.at)
            words = RESULTANTS if part.dim == 3 else MEMBRANE
            text = axes_text(point.axes)
            labels = tuple(
                f"{word}, {text}" if len(word) == 3 else "principal value" for word in words
            )
            columns = tuple(f"{name}_{word}" for word in words)
            return self.output(
                draft, columns, [point.rows], labels=labels, **point.facts(self.at.body)
            )
        beam = part.directors is not None
        if beam:
            xi = np.array([float(locate(part, self.at.place))])  # type: ignore[arg-type]
            rows, parameters = beam_sections.beam_point(part, xi)
        else:
            xi = np.array([cable_sections.place_of(where, part, self.at)])
            rows, numbers = cable_sections.sections(part, xi)
            parameters = numbers.numbers
        warn_of_jump(where, draft, part, self.at)
        of_beam = beam_sections.forces_of(parameters, part.dim) if beam else {}
        names = tuple(of_beam) or (CABLE_PLANE if part.dim == 2 else CABLE_SPACE)
        columns = tuple(f"{name}_{word}" for word in names)
        wide = draft.layout.spread(part, rows)
        return self.output(draft, columns, [wide], parameters=parameters)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        if beam_sections.reads_beam(output.parameters):
            forces = beam_sections.read_places(output.parameters, sensed.values)[1][..., 0]
            forces = forces if sensed.dim == 3 else beam_sections.in_plane(forces)
            return [*forces[:6], -forces[6]] if len(output.columns) == 7 else list(forces[:6])
        if cable_sections.reads_cable(output.parameters):
            cable = cable_sections.CableSections.of(output.parameters)
            return [one[:, 0] for one in cable_sections.forces(cable, sensed.values)]
        found = recovered(output.parameters, sensed.values)
        t = output.parameters[1]
        (below, middle, above) = found.stress
        N = t * middle
        M = t**2 * (above - below) / 12.0
        columns = [*N, *principal(N)[:2], *M, *principal(M)[:2]]
        return columns[: len(output.columns)]

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        if beam_sections.reads_beam(output.parameters):
            dim = 2 if len(output.columns) == len(beam_sections.PLANE) else 3
            return tuple(beam_sections.forces_of(output.parameters, dim).values())
        if cable_sections.reads_cable(output.parameters):
            return ("N", *("N m",) * (len(output.columns) - 1))
        return ("N/m",) * 5 + ("N",) * (len(output.columns) - 5)

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        if beam_sections.reads_beam(output.parameters):
            columns = len(beam_sections.forces_of(output.parameters, dim))
            return beam_sections.rows_of(output.parameters, dim), columns, None
        if cable_sections.reads_cable(output.parameters):
            cable = cable_sections.CableSections.of(output.parameters)
            return dim * cable.rows, len(CABLE_PLANE if dim == 2 else CABLE_SPACE), None
        rows, parameters = counts(output.parameters[0], dim)
        return rows, len(RESULTANTS if dim == 3 else MEMBRANE), parameters


class OfBeam(Probe, ABC):
    """What is read at a place of a beam with torsion and shear, `functionals` (m, 6) of its section
    forces among it.
    """

    at: fields.Place
    calls = ()

    @abstractmethod
    def functionals(self, where: str, part: Body) -> np.ndarray:
        """Those that it reads, (m, 6)."""

    @abstractmethod
    def columns(self, name: str, dim: int) -> tuple[str, ...]:
        """Names of its columns in `dim` components."""

    def sense(self, name: str, draft: Draft) -> Output:
        where = f"output '{name}'"
        part = draft.layout.body(where, self.at)
        xi = np.array([beam_sections.place_of(where, part, self.at)])
        rows, parameters = beam_sections.beam_point(part, xi, self.functionals(where, part))
        warn_of_jump(where, draft, part, self.at)
        return self.output(
            draft,
            self.columns(name, part.dim),
            [draft.layout.spread(part, rows)],
            parameters=parameters,
        )

    @classmethod
    def sizes(cls, output: Output, dim: int) -> Sizes:
        return beam_sections.rows_of(output.parameters, dim), len(output.columns), None


@dataclass(frozen=True)
class SectionStrains(OfBeam):
    """Strains of the section at a place of a beam with torsion and shear, those of its section
    forces there.

    NAME_axial and the shear strains NAME_shear_y and NAME_shear_z [-] of the line, NAME_torsion,
    the angle of twist a length, and the curvatures NAME_curvature_y and NAME_curvature_z [1/m]
    about the axes y and z of the section, from the reference; the strain along the beam at a point
    of the section is

        axial + z curvature_y - y curvature_z

    {type: section_strains, at: beam.left}
    """

    at: fields.Place

    def functionals(self, where: str, part: Body) -> np.ndarray:
        assert part.profile is not None
        return np.zeros((0, part.profile.stiffness.shape[-1]))

    def columns(self, name: str, dim: int) -> tuple[str, ...]:
        words = beam_sections.STRAINS if dim == 3 else beam_sections.PLANE_STRAINS
        return tuple(f"{name}_{word}" for word in words)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        strains = beam_sections.read_places(output.parameters, sensed.values)[0][..., 0]
        return list(strains[:6] if sensed.dim == 3 else beam_sections.in_plane(strains))

    @classmethod
    def units(cls, name: str, output: Output) -> tuple[str, ...]:
        units = beam_sections.STRAINS, beam_sections.PLANE_STRAINS
        return tuple(units[len(output.columns) == len(units[1])].values())


@dataclass(frozen=True)
class StrainGauge(OfBeam):
    """Strain [-] that a gauge measures on the surface of a beam with torsion and shear, in one
    direction.

        e = sigma/E (cos^2 a - nu sin^2 a) + tau/G sin a cos a

    It is glued to the `point` of the contour, y and z in the section; its `direction` a is an angle
    to the beam, anticlockwise around it. Stresses are those of the output `stress`.

    {type: strain_gauge, at: {body: beam, s: 0.1 m}, point: [0, 5 mm], direction: 45 deg}
    """

    at: fields.Place
    point: Annotated[fields.InSection, "y and z in the section, a point of its contour"]
    direction: Annotated[float, quantity("rad"), "its angle to the beam"] = 0.0

    def functionals(self, where: str, part: Body) -> np.ndarray:
        xi = beam_sections.place_of(where, part, self.at)
        profile = beam_sections.contour(where, part)
        sigma, tau = beam_sections.contour_point(where, profile, xi, self.point).stresses
        c = np.cos(self.direction)
        s = np.sin(self.direction)
        nu = profile.poisson_ratio
        one = sigma * (c * c - nu * s * s) + 2.0 * (1.0 + nu) * tau * s * c
        return np.asarray(one[None] / profile.young_modulus)

    def columns(self, name: str, dim: int) -> tuple[str, ...]:
        return (name,)

    @staticmethod
    def evaluate(output: Output, sensed: Sensed) -> Sequence[np.ndarray]:
        return list(beam_sections.read_places(output.parameters, sensed.values)[2][..., 0])


def warn_of_jump(where: str, draft: Draft, part: Body, at: At) -> None:
    """A notice of a place inside a line on which joints or loads act: slopes are continuous there,
    and axial forces are not.
    """
    ends = line.breaks(part.space)[[0, -1]]
    here = float(locate(part, at.place))  # type: ignore[arg-type]
    near = NEAR * float(np.ptp(ends))
    if np.abs(ends - here).min() < near:
        return
    others = [(what, locate(part, end.place)) for what, end in draft.acting if end.body == at.body]
    if meeting := [what for what, there in others if abs(here - float(there)) < near]:  # type: ignore[arg-type]
        text = (
            f"{', '.join(dict.fromkeys(meeting))} act at this place, where internal forces may jump"
        )
        notify(
            f"{where}: {text}: the value shown is right on neither side; read it some cells away"
        )
