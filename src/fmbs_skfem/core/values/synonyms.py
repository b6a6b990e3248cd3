"""Words of other codes, and what they are called here: what a message adds where a scene holds one
of them.

{family: {remark: words of others}}        what stands in '...' in a remark is a word of the family, or of the section it names
"""

from __future__ import annotations

from collections.abc import Mapping

from ..errors import closest

#: by the name of the family; words of Adams, Exudyn, Chrono, Abaqus, MSC and of textbooks, as
#: `normal` writes them
WORDS: Mapping[str, Mapping[str, str]] = {
    "Joint": {
        "'weld' of two places, 'tie' of the faces of two solids": "bonded glue tied tie_faces",
        "'clamp' to the ground, 'weld' between bodies": "fixed fix rigid encastre fixed_joint generic rbe2 mpc coupling",
        "'pin' or 'spherical'": "ball ball_joint ball_and_socket spherical_joint point_to_point pinned link",
        "'revolute', or 'pin' for points in the plane": "hinge hinge_joint rotational rotary pivot swivel revolute_joint bearing",
        "'driven_angle'": "rotation_motor rotational_motor motor_rotation joint_motion angle_motor servo speed_motor",
        "'driven_angle', or 'motor' under loads, which is a torque": "motor",
        "'driven_slide', or 'driven_position' for a point": "linear_motor translational_motor motor_linear",
        "'driven_position'": "motion trajectory prescribed prescribed_motion displacement boundary",
        "'prismatic', or 'slider' for a point": "translational translation translator linear slider_joint prismatic_joint",
        "'slider'": "inline point_on_straight_line roller guide",
        "'sliding'": "point_on_line point_on_curve point_curve curve_point sliding_joint trolley bead slide",
        "'cylindrical'": "cylindric slide_rotate",
        "'universal'": "hooke cardan hookes u_joint universal_joint",
        "'distance'": "rod massless_rod distance_constraint rigid_link beam_link truss",
        "'gear'": "coupler gear_pair belt",
        "'rack_and_pinion'": "rack rackpinion rack_pinion",
        "'screw'": "helical lead_screw spindle thread",
        "'bushing' under loads": "bushing mount cartesian 6dof",
        "'spring_damper' under loads": "spring damper tsda spring_damper spring_damper_actuator",
        "'torsion_spring' under loads": "torsional_spring rotational_spring rsda torsion_spring",
    },
    "Load": {
        "'point_force', which keeps its direction, or 'follower'": "force single_force cload concentrated nodal_force point_load",
        "'torque', or 'moment' on a point of a beam": "single_torque couple",
        "'gravity'": "grav weight accgrav acceleration_of_gravity gravitation body_force dload",
        "'pressure', or 'edge_load' on edges": "dsload p pressure_load",
        "'surface_load', or 'pressure'": "traction surface_traction",
        "'line_load'": "distributed distributed_load q uniform_load udl line_force",
        "'spring_damper'": "spring damper tsda spring_damper_actuator linear_spring dashpot translational_spring",
        "'torsion_spring'": "torsional_spring rotational_spring rsda rotational_spring_damper",
        "'bushing'": "field beam_element vforce gforce mount",
        "'actuator'": "cylinder hydraulic linear_actuator",
        "'motor', or 'driven_angle' under joints": "electric_motor drive servo",
        "'contact_plane', 'contact_sphere', 'contact_box', 'contact_beam'": "contact collision impact general_contact",
        "'stop'": "bump_stop bistop limit end_stop",
        "'rope'": "pulley cable belt tendon string",
        "'follower'": "follower_force follower_load tangential_force",
    },
    "SceneBody": {
        "'beam' with torsion and shear, 'cable' without": "rod shaft bar frame blade timoshenko b31 b32 b33 ancf ancf_beam"
        " geometrically_exact cosserat flexible flex fe_part wire rope string ancf_cable ancf_cable_2d cable_2d ancfcable2d truss",
        "'shell' or 'plate'": "membrane sheet s4 s4r s3 s8r ancf_shell reissner kirchhoff",
        "'rigid'": "rigid_body body cylinder box sphere link part_rigid lump",
        "'point_mass'": "mass particle point mass_point masspoint mass_point_2d lumped_mass",
        "'part', a body that was reduced alone": "superelement substructure ffrf ffrf_reduced_order cms craig_bampton modal mnf"
        " floating_frame reduced",
    },
    "Probe": {
        "'position', or 'displacement' from the reference": "coordinate u point location",
        "'reaction'": "joint_force reaction_force force rf constraint_force",
        "'section_forces'": "sf section_force internal_force beam_force moment bending_moment axial_force",
        "'section_strains'": "curvature se section_strain torsion",
        "'angular_velocity', or 'angle' with 'to', whose rate is there as well": "rate omega angular_speed wz spin",
        "'angle'": "azimuth ur euler_angle",
        "'strain_gauge' or 'strain_tensor'": "strain e le gauge",
        "'stress' or 'stress_tensor'": "von_mises mises s",
        "'load'": "spring_force spring load_force actuator_force",
        "'utilisation'": "utilization safety safety_factor yield unity_check strength",
        "'slide'": "displacement_along sliding joint_coordinate",
        "'velocity'": "speed v",
    },
    "Analysis": {
        "'dynamic'": "transient time_integration implicit implicit_dynamic solve_dynamic simulation kinematic explicit dynamics",
        "'static'": "equilibrium statics solve_static riks quasi_static nonlinear_static",
        "'modes'": "frequency modal eigen eigenvalues eigenmodes vibration complex_frequency natural_frequencies",
        "'buckling'": "buckle stability linear_buckling eigenbuckling",
        "'linearise'": "linear linearize linearization state_space linearized",
    },
    "Section": {
        "'circular'": "circle circ round",
        "'tube'": "pipe ring annulus hollow_circular",
        "'box', or 'hollow' with radii": "rectangular_hollow hollow_rectangular box_girder square_tube",
        "'hollow', or 'rolled' by its name": "rhs shs rectangular_tube",
        "'t_section'": "t tee",
        "'z_section'": "z zed",
        "'rectangular'": "rect rectangle box_solid square",
        "'i_section', or 'rolled' by its name": "i h ipe hea heb i_beam h_section",
        "'c_section', or 'rolled' by its name": "c u channel u_section upn",
        "'l_section', or 'rolled' by its name": "l angle l_profile",
        "'given' for cables, 'matrices' for beams": "general generalized stiffness beam_general_section meshed",
        "'polygon'": "arbitrary points profile outline",
    },
}

#: units that are not taken: what to write, in '...' one that is, and those of others
UNITS: Mapping[str, str] = {
    "'in'": "inch inches zoll",
    "'ft'": "foot feet",
    "'lbf' for forces, 'lbm' for masses": "lb lbs pound pounds",
    "'lbf s^2/ft'": "slug slugs",
    "'lbf s^2/in'": "snail blob slinch",
    "'1000 lbf'": "kip kips",
    "'s'": "sec secs second seconds",
    "'min'": "minute minutes",
    "'h'": "hour hours hr",
    "'deg'": "degree degrees grad °",
    "'rad'": "radian radians",
    "'rev'": "turn turns revolution revolutions umdrehung umdrehungen rot",
    "'rpm'": "upm rpms",
    "'rev/s'": "rps",
    "'Hz'": "cps cycles",
    "'N m'": "newtonmeter",
    "'kg'": "kgs kilogram kilograms kilo",
    "'t'": "ton tonne tonnes tons",
    "'m'": "meter meters metre metres",
    "'mm'": "millimeter millimetre millimeters millimetres",
    "'0.9144 m'": "yd yard yards",
    "'1e-3 in'": "mil mils thou",
    "'1609.344 m'": "mi mile miles",
    "'1609.344 m/h'": "mph",
    "'km/h'": "kmh kph",
    "'1852 m/h'": "kn knot knots kt",
    "'1e-5 N'": "dyn dyne",
    "'735.49875 W'": "ps",
    "'745.69987158227022 W'": "hp",
    "'101325 Pa'": "atm",
    "'100 Pa'": "mbar hpa",
    "'lbf/ft^2'": "psf",
    "'28.349523125 g'": "oz",
    "'1e-10 m'": "angstrom",
}


def normal(word: str) -> str:
    """A word in small letters, with _ for what stands between its parts."""
    return "_".join(word.lower().replace("-", " ").replace("_", " ").split())


def remark(word: str, table: Mapping[str, str]) -> str:
    """`; did you mean 'clamp' ...?` for a word of others in a table of remarks, or nothing."""
    wanted = normal(word)
    return next(
        (
            f"; did you mean {text}?"
            for text, words in table.items()
            if wanted and wanted in words.split()
        ),
        "",
    )


def meant(word: str, table: Mapping[str, str], known: Mapping[str, object]) -> str:
    """`; did you mean ...?` for a word that is not known: that of others, or the closest one that
    is known; or nothing.
    """
    return remark(word, table) or closest(word, known)
