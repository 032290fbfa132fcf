"""The keyword table: every keyword of the INP format, version 1.

Reader, writer, checks, the reference page and the tests come from this one table. To add a keyword or a
parameter, add it here; a rule that no field of the table can say goes into `rules.py`.
"""

from __future__ import annotations

from .schema import NOT_NEGATIVE, POSITIVE, Column, Interval, Keyword, Parameter, Variant

_POISSON = Interval("(-1, 0.5]")
_FRACTION = Interval("(0, 1]")

_XYZ = ("x", "y", "z")
_QUATERNION = ("qw", "qx", "qy", "qz")
_BOX = ("x0", "y0", "z0", "x1", "y1", "z1")


def _name(doc: str, *, required: bool = True) -> Parameter:
    return Parameter("NAME", "name", doc, required=required)


def _number(name: str, dimension: str | None, doc: str, range: Interval = POSITIVE, **more) -> Parameter:
    return Parameter(name, "number", doc, dimension=dimension, range=range, **more)


def _choice(name: str, choices: tuple[str, ...], doc: str, **more) -> Parameter:
    return Parameter(name, "choice", doc, choices=choices, **more)


def _reference(name: str, refers: str, doc: str, **more) -> Parameter:
    return Parameter(name, "name", doc, refers=refers, **more)


_STEP = _reference("STEP", "STEP", "the step in which it acts; without it the whole run")
_AMPLITUDE = _reference("AMPLITUDE", "AMPLITUDE", "scales it over time; without it the factor is 1")
_MATERIAL = _reference("MATERIAL", "MATERIAL", "what it is made of", required=True)
_GROUP = _reference("CONTACT GROUP", "CONTACT GROUP", "without one it touches everything")
_CLASS = Parameter(
    "CLASS", "name", "what it is in the conveyor, as IDLER or PULLEY; for reports and pictures"
)
_COLOR = Parameter("COLOR", "colour", "colour in pictures, #rrggbb")
_DIAMETER = _number("DIAMETER", "length", "outer diameter (cylinder)")
_LENGTH = _number("LENGTH", "length", "outer length (cylinder)")
_EDGE_RADIUS = _number(
    "EDGE RADIUS",
    "length",
    "rounding inside the outer size, at most half the least; of two boxes that may touch each other one needs it",
    NOT_NEGATIVE,
    default=0.0,
)
_SEED = Parameter("SEED", "whole", "seed of the random numbers", default=1, range=NOT_NEGATIVE)
_UNITS = ("M", "MM", "CM", "IN", "FT")
_UNIT = _choice("UNIT", _UNITS, "unit of the mesh file", default="M")

_ID = Column("id", ("id",), "id")

_GENERAL = (
    Keyword(
        "FORMAT",
        "Name and version of the format; the first keyword of a file that is run.",
        (
            _choice("NAME", ("BELTSIM",), "name of the format", required=True),
            Parameter("VERSION", "whole", "version of the format", required=True, range=Interval("[1, 1]")),
        ),
        key=(),
    ),
    Keyword(
        "INCLUDE",
        "Reads another file in place of this line.",
        (Parameter("INPUT", "text", "path, relative to the file of this line", required=True),),
    ),
    Keyword(
        "INFO",
        "General information, lines `key = value`; without effect on the run.",
        (Parameter("TITLE", "text", "what the lines are about", required=True),),
        layout="text",
        count=(0, None),
    ),
    Keyword(
        "MESH SOURCE",
        "What a belt was made from, so that studies can remesh it; lines `option = value` of the conversion.",
        (
            Parameter("INPUT", "text", "the mesh file", required=True),
            _UNIT,
            Parameter("SHA256", "text", "sha256 of the mesh file"),
        ),
        layout="text",
        count=(0, None),
    ),
)

_MATERIALS = (
    Keyword(
        "MATERIAL",
        "A material.",
        (
            _name("name of the material"),
            _number("DENSITY", "density", "density", required=True),
            _number("YOUNGS MODULUS", "pressure", "Young's modulus", required=True),
            _number("POISSON RATIO", None, "Poisson's ratio", _POISSON, required=True),
        ),
        key=("NAME",),
    ),
    Keyword(
        "CONTACT PROPERTY",
        "How two materials touch; symmetric in A and B, `*` matches any material, the exact pair wins.",
        (
            _reference("MATERIAL A", "MATERIAL", "first material", required=True, words=("*",)),
            _reference("MATERIAL B", "MATERIAL", "second material", required=True, words=("*",)),
            _number("FRICTION", None, "Coulomb friction coefficient", NOT_NEGATIVE, required=True),
            _number("RESTITUTION", None, "coefficient of restitution", _FRACTION, required=True),
            _number(
                "ROLLING FRICTION",
                None,
                "coefficient of the elastic-plastic spring (type C) rolling model",
                NOT_NEGATIVE,
                default=0.0,
            ),
            _number(
                "ROLLING DAMPING",
                None,
                "damping of that spring as a share of critical: stops the rocking of heaps (0.3: Ai et al. 2011)",
                Interval("[0, 1]"),
                default=0.3,
            ),
            _number(
                "NORMAL STIFFNESS",
                "stiffness",
                "normal stiffness of a point, of a whole line or of a whole face, for *CONTACT MODEL, TYPE=LINEAR",
            ),
            _number(
                "TANGENTIAL STIFFNESS", "stiffness", "tangential stiffness, for *CONTACT MODEL, TYPE=LINEAR"
            ),
        ),
        key=("MATERIAL A", "MATERIAL B"),
        symmetric=True,
        together=(("NORMAL STIFFNESS", "TANGENTIAL STIFFNESS"),),
    ),
    Keyword(
        "CONTACT MODEL",
        "The contact law of the whole case; HERTZ MINDLIN without this keyword.",
        (
            _choice(
                "TYPE",
                ("HERTZ MINDLIN", "LINEAR"),
                "LINEAR needs NORMAL STIFFNESS and TANGENTIAL STIFFNESS in each *CONTACT PROPERTY",
                required=True,
            ),
        ),
        key=(),
    ),
    Keyword(
        "CONTACT GROUP",
        "A group of particles or parts. Particles of one group, and groups of one BELT, do not touch unless a "
        "*CONTACT GROUP PAIR says YES; those of different belts touch. Bonded pairs never touch, nor do rounded boxes "
        "with up to three bonds from one to the other; once their bonds are broken they touch after they have been "
        "apart.",
        (
            _name("name of the group"),
            Parameter("BELT", "name", "the belt to which the group belongs"),
        ),
        key=("NAME",),
    ),
    Keyword(
        "CONTACT GROUP PAIR",
        "Whether two contact groups touch; A and B may be the same group.",
        (
            _reference("GROUP A", "CONTACT GROUP", "first group", required=True),
            _reference("GROUP B", "CONTACT GROUP", "second group", required=True),
            Parameter("CONTACT", "flag", "whether they touch", required=True),
        ),
        key=("GROUP A", "GROUP B"),
        symmetric=True,
    ),
)

_SIZES = ("SIZE X", "SIZE Y", "SIZE Z")

_PARTICLES = (
    Keyword(
        "PARTICLE TYPE",
        "Shape, mass and material of particles. Sizes are outer dimensions, the edge radius lies inside. Local "
        "axes of a belt particle: x = running direction, y = transverse, z = normal on the carrying side; local "
        "z of a cylinder is its axis.",
        (
            _name("name of the type"),
            _choice("SHAPE", ("ROUNDED BOX", "SPHERE", "CYLINDER"), "decides the sizes", required=True),
            _number("SIZE X", "length", "outer size along local x (box)"),
            _number("SIZE Y", "length", "outer size along local y (box)"),
            _number("SIZE Z", "length", "outer size along local z (box)"),
            _number("RADIUS", "length", "radius (sphere)"),
            _DIAMETER,
            _LENGTH,
            _EDGE_RADIUS,
            _number("MASS", "mass", "mass; without it density times the rounded volume"),
            _number(
                "INERTIA X",
                "inertia",
                "principal moment of inertia about local x; without it the sharp body's",
            ),
            _number("INERTIA Y", "inertia", "the same about local y"),
            _number("INERTIA Z", "inertia", "the same about local z"),
            _MATERIAL,
            _GROUP,
            _choice(
                "FIXED",
                ("NO", "YES", "POSITION"),
                "NO: flies freely (a CYLINDER without bonds, and kept apart from meshes by its contact group); "
                "YES: centre and orientation held; POSITION: centre and axis (local z) held, spin free or prescribed",
                default="NO",
            ),
            _CLASS,
            _COLOR,
        ),
        key=("NAME",),
        decides="SHAPE",
        variants=(
            ("ROUNDED BOX", Variant(_SIZES, ("EDGE RADIUS",))),
            ("SPHERE", Variant(("RADIUS",))),
            ("CYLINDER", Variant(("DIAMETER", "LENGTH"), ("EDGE RADIUS",))),
        ),
        together=(("INERTIA X", "INERTIA Y", "INERTIA Z"),),
    ),
    Keyword(
        "PARTICLE",
        "Particles of one type: id, centre and orientation (local frame to world).",
        (_reference("TYPE", "PARTICLE TYPE", "type of the particles", required=True),),
        (
            _ID,
            Column("position", _XYZ, unit="m"),
            Column("orientation", _QUATERNION, "quaternion"),
        ),
        count=(0, None),
    ),
    Keyword(
        "PARTICLE SIZE",
        "Outer sizes, mass and inertia of single boxes, over those of their type (graded grids, edge cells).",
        columns=(
            _ID,
            Column("size", ("size x", "size y", "size z"), unit="m", range=POSITIVE),
            Column("mass", ("mass",), unit="kg", range=POSITIVE),
            Column("inertia", ("ix", "iy", "iz"), unit="kg m2", range=POSITIVE),
        ),
        count=(0, None),
    ),
    Keyword(
        "INITIAL VELOCITY",
        "Velocities at the start, in world axes; zero for particles without a row.",
        columns=(
            _ID,
            Column("velocity", ("vx", "vy", "vz"), unit="m/s"),
            Column("angular_velocity", ("wx", "wy", "wz"), unit="rad/s"),
        ),
        count=(0, None),
    ),
)

_BONDS = (
    Keyword(
        "BOND TYPE",
        "Section and material of bonds: a rectangle (width along e2, thickness along e3) or a circle.",
        (
            _name("name of the type"),
            _number("SECTION WIDTH", "length", "width of a rectangular section"),
            _number("SECTION THICKNESS", "length", "thickness of a rectangular section"),
            _number("RADIUS", "length", "radius of a round section"),
            _number("YOUNGS MODULUS", "pressure", "Young's modulus", required=True),
            _number("POISSON RATIO", None, "Poisson's ratio", _POISSON, required=True),
            _number(
                "REDUCTION FACTOR", None, "of the out-of-plane bending stiffness", NOT_NEGATIVE, default=1.0
            ),
            _number(
                "IN PLANE REDUCTION FACTOR",
                None,
                "of the in-plane bending stiffness",
                NOT_NEGATIVE,
                default=1.0,
            ),
            _number(
                "DAMPING FACTOR",
                None,
                "share of critical damping of the bonded pair",
                NOT_NEGATIVE,
                default=0.0,
            ),
            _choice(
                "TORSION",
                ("SECTION", "GRID"),
                "SECTION: ropes and lone strips; GRID: belts, the twist is shared by both directions",
                default="SECTION",
            ),
            _choice("SHEAR", ("TIMOSHENKO", "SPRING"), "shear stiffness of the bond", default="TIMOSHENKO"),
            _number(
                "TENSILE STRENGTH", "pressure", "tensile stress at which the bond breaks; without it never"
            ),
            _number("SHEAR STRENGTH", "pressure", "shear stress at which the bond breaks; without it never"),
        ),
        key=("NAME",),
        one_of=(("SECTION WIDTH", "SECTION THICKNESS"), ("RADIUS",)),
    ),
    Keyword(
        "BOND",
        "Bonds of one type: the ids of two particles and the stress-free state of the two. Any common rigid "
        "motion of it means the same; start positions never enter the law. Section axes: e1 from particle 1 to 2; "
        "e3 = mean of both local z made normal to e1 (mean local y if that is shorter than 0.1; local z of particle 1 "
        "if that cancels too, as at the seam of a Moebius belt); e2 = e3 x e1.",
        (_reference("TYPE", "BOND TYPE", "type of the bonds", required=True),),
        (
            Column("particles", ("id1", "id2"), "id"),
            Column("position_1", ("x1", "y1", "z1"), unit="m"),
            Column("orientation_1", ("qw1", "qx1", "qy1", "qz1"), "quaternion"),
            Column("position_2", ("x2", "y2", "z2"), unit="m"),
            Column("orientation_2", ("qw2", "qx2", "qy2", "qz2"), "quaternion"),
        ),
        count=(0, None),
    ),
    Keyword(
        "BOND RULE",
        "Every bond between the two named particle types gets this bond type, over the one in its block. "
        "Symmetric; the rule with more exact names wins; two of equal rank that differ are an error.",
        (
            _reference("PARTICLE TYPE A", "PARTICLE TYPE", "name or pattern", required=True, wildcards=True),
            _reference(
                "PARTICLE TYPE B",
                "PARTICLE TYPE",
                "name or pattern; SAME or OTHER: a name equal or unequal to the first",
                required=True,
                wildcards=True,
                words=("SAME", "OTHER"),
            ),
            _reference("BOND TYPE", "BOND TYPE", "the type that the bonds get", required=True),
        ),
    ),
)

_PARTS = (
    Keyword(
        "PART",
        "A rigid body: cylinder (local z = axis), triangle mesh, or infinite plane (local z = outward normal, "
        "solid below). The row is its centre and orientation; a mesh without a row stays as it is in its file. "
        "A mesh has two sides and no thickness: it pushes to the side where a particle is.",
        (
            _name("name of the part"),
            _choice("SHAPE", ("CYLINDER", "MESH", "PLANE"), "decides the sizes", required=True),
            _DIAMETER,
            _LENGTH,
            _EDGE_RADIUS,
            Parameter("INPUT", "text", "mesh file, relative to the file of this line"),
            _UNIT,
            _MATERIAL,
            _GROUP,
            _CLASS,
            _COLOR,
        ),
        (
            Column("position", _XYZ, unit="m"),
            Column("orientation", _QUATERNION, "quaternion"),
        ),
        count=(0, 1),
        key=("NAME",),
        decides="SHAPE",
        variants=(
            ("CYLINDER", Variant(("DIAMETER", "LENGTH"), ("EDGE RADIUS",), rows=(1, 1))),
            ("MESH", Variant(("INPUT",), ("UNIT",), rows=(0, 1))),
            ("PLANE", Variant(rows=(1, 1))),
        ),
    ),
    Keyword(
        "MOTION",
        "What moves parts or particles: a prescribed motion, a drive or a support. ROTATION, FREE ROTATION and "
        "TORQUE of particles are for those with FIXED=POSITION or YES. When the step of a motion ends, parts stand "
        "and particles fly on with the velocity that they have, unless they are FIXED.",
        (
            _reference("PART", "PART", "name or pattern of parts", wildcards=True),
            _reference("PARTICLE TYPE", "PARTICLE TYPE", "name or pattern of particle types", wildcards=True),
            Parameter("PARTICLES", "ids", 'ids of particles and ranges of them, as "1-8, 12"'),
            _choice(
                "TYPE",
                (
                    "ROTATION",
                    "FREE ROTATION",
                    "TORQUE",
                    "TENSION",
                    "SUSPENSION",
                    "SURFACE VELOCITY",
                    "VELOCITY",
                ),
                "ROTATION: right-handed about local z; FREE ROTATION: turned by what touches it; TORQUE: driven; "
                "TENSION: take-up, a force along the row's direction; SUSPENSION: sprung along the row's direction; "
                "SURFACE VELOCITY: a rigid moving belt (mesh or plane); VELOCITY: the row's vx, vy, vz[, wx, wy, wz]",
                required=True,
            ),
            _number("ANGULAR VELOCITY", "angular velocity", "angular velocity", Interval("(-inf, inf)")),
            Parameter("AXIS", "vector", "axis of rotation of a mesh in world axes, through its centre"),
            _number("INERTIA", "inertia", "moment of inertia about the axis; particles have their own"),
            _number("FRICTION TORQUE", "torque", "bearing friction", NOT_NEGATIVE, default=0.0),
            _number("TORQUE", "torque", "driving torque about the axis", Interval("(-inf, inf)")),
            _number("FORCE", "force", "take-up force", NOT_NEGATIVE),
            _number("MASS", "mass", "moved mass"),
            _number("STIFFNESS", "stiffness", "stiffness of the suspension"),
            _number("DAMPING", "damping", "damping of the suspension or take-up", NOT_NEGATIVE, default=0.0),
            _AMPLITUDE,
            _STEP,
        ),
        (Column("vector", ("x", "y", "z", "wx", "wy", "wz"), unit="m/s, rad/s or direction", least=3),),
        count=(0, 1),
        key=("PART", "PARTICLE TYPE", "PARTICLES", "TYPE", "STEP"),
        decides="TYPE",
        variants=(
            ("ROTATION", Variant(("ANGULAR VELOCITY",), ("AXIS", "AMPLITUDE"), rows=(0, 0))),
            ("FREE ROTATION", Variant((), ("INERTIA", "FRICTION TORQUE", "AXIS"), rows=(0, 0))),
            (
                "TORQUE",
                Variant(("TORQUE",), ("INERTIA", "FRICTION TORQUE", "AXIS", "AMPLITUDE"), rows=(0, 0)),
            ),
            ("TENSION", Variant(("FORCE", "MASS"), ("DAMPING", "AMPLITUDE"), rows=(1, 1))),
            ("SUSPENSION", Variant(("STIFFNESS", "MASS"), ("DAMPING",), rows=(1, 1))),
            ("SURFACE VELOCITY", Variant((), ("AMPLITUDE",), rows=(1, 1))),
            ("VELOCITY", Variant((), ("AMPLITUDE",), rows=(1, 1))),
        ),
        one_of=(("PART",), ("PARTICLE TYPE",), ("PARTICLES",)),
    ),
    Keyword(
        "AMPLITUDE",
        "A factor over the total time: linear between the rows, constant outside.",
        (_name("name of the amplitude"),),
        (Column("time", ("time",), unit="s"), Column("factor", ("factor",))),
        count=(1, None),
        key=("NAME",),
    ),
    Keyword(
        "FORCE",
        "Loads on particles, in world axes; several on one particle add up.",
        (_AMPLITUDE, _STEP),
        (
            _ID,
            Column("force", ("fx", "fy", "fz"), unit="N"),
            Column("torque", ("tx", "ty", "tz"), unit="N m"),
        ),
        count=(0, None),
    ),
    Keyword(
        "DAMPING",
        "Global damping against a reference velocity (the row; zero without it); reported in the results.",
        (
            _number(
                "MASS PROPORTIONAL",
                "rate",
                "damping force per mass and velocity",
                NOT_NEGATIVE,
                required=True,
            ),
            _STEP,
        ),
        (Column("velocity", ("vx", "vy", "vz"), unit="m/s"),),
        count=(0, 1),
        key=("STEP",),
    ),
)

_CASE = (
    Keyword(
        "SOURCE",
        "A bulk inlet. Row 1: the box; row 2: the velocity of new particles; further rows: particle type and mass "
        "fraction, over PARTICLE TYPE.",
        (
            _name("name of the source"),
            _reference("PARTICLE TYPE", "PARTICLE TYPE", "the only type, if no row gives fractions"),
            _number("MASS RATE", "mass rate", "mass per time", required=True),
            _SEED,
            _number("START", "time", "total time of the first particle", NOT_NEGATIVE, default=0.0),
            _number("END", "time", "total time after which nothing comes; without it the end of the run"),
            _STEP,
        ),
        (Column("box", _BOX, unit="m"), Column("velocity", ("vx", "vy", "vz"), unit="m/s")),
        layout="source",
        count=(2, None),
        key=("NAME",),
    ),
    Keyword(
        "FILL",
        "Bulk that starts on a belt and moves with it: spheres in a dense packing on the side that carries, where "
        "the belt's normal looks up, each with the velocity of the nearest belt particle. What would touch "
        "anything else is left out.",
        (
            _reference("PARTICLE TYPE", "PARTICLE TYPE", "type of the bulk", required=True),
            Parameter("BELT", "name", "the belt, as *CONTACT GROUP names it", required=True),
            _number(
                "HEIGHT",
                "length",
                "height of the layer's level top above the lowest point of the belt's cross-section there",
                required=True,
            ),
            _SEED,
        ),
        key=("PARTICLE TYPE", "BELT"),
    ),
    Keyword(
        "DOMAIN",
        "The box of the simulation: what leaves it is removed and counted.",
        columns=(Column("box", _BOX, unit="m"),),
        count=(1, 1),
        key=(),
    ),
    Keyword(
        "GRAVITY",
        "The acceleration of gravity; zero without this keyword.",
        columns=(Column("acceleration", ("gx", "gy", "gz"), unit="m/s2"),),
        count=(1, 1),
        key=(),
    ),
    Keyword(
        "STEP",
        "A stretch of the run; steps run in file order.",
        (
            _name("name of the step", required=False),
            _number("DURATION", "time", "simulated time", required=True),
            Parameter(
                "TIME STEP", "step", "AUTO or a time step", dimension="time", default="AUTO", range=POSITIVE
            ),
            _number("SAFETY", None, "share of the stable time step that AUTO takes", _FRACTION, default=0.8),
            _choice(
                "INTEGRATOR",
                ("VERLET", "PEFRL"),
                "VERLET: velocity Verlet; PEFRL: of fourth order, for accuracy studies without damping and friction",
                default="VERLET",
            ),
        ),
        key=("NAME",),
    ),
    Keyword(
        "OUTPUT",
        "Frames of the trajectory.",
        (
            _number("INTERVAL", "time", "time between frames", required=True),
            Parameter(
                "FIELDS",
                "choices",
                "what each frame holds beside positions; ENERGY keeps the energy book, all terms under /observables",
                default=("VELOCITY", "ORIENTATION"),
                choices=(
                    "VELOCITY",
                    "ANGULAR VELOCITY",
                    "ORIENTATION",
                    "FORCE",
                    "TORQUE",
                    "BOND FORCE",
                    "BOND MOMENT",
                    "BOND STRAIN",
                    "ENERGY",
                ),
            ),
            _choice("PRECISION", ("SINGLE", "DOUBLE"), "of the numbers in the file", default="SINGLE"),
            Parameter("COMPRESS", "flag", "gzip, slower to write", default=False),
            _STEP,
        ),
        key=("STEP",),
    ),
    Keyword(
        "CHECKPOINT",
        "Saves the whole state at an interval, so that a run can be resumed.",
        (_number("INTERVAL", "time", "simulated time between checkpoints", required=True),),
        key=(),
    ),
    Keyword(
        "MEASURE",
        "A quantity recorded at every frame as /observables/NAME. Row, for all types but POWER: a point, a normal of "
        "any length, and a radius.",
        (
            _name("name of the measure"),
            _choice(
                "TYPE",
                ("MASS FLOW", "TENSION", "SAG", "POWER"),
                "MASS FLOW: mass of bulk per time through the plane along its normal, less what goes back, mean since "
                "the frame before, and as NAME_mass the mass since the start; a radius makes the plane a disc. "
                "TENSION: axial forces of all bonds that cross the plane or disc, along its normal. SAG: how far the "
                "lowest belt particle lies below the plane (centre, against the normal), a radius takes only those "
                "within it of the point. POWER: what parts give to all that touches them, mean since the frame before",
                required=True,
            ),
            _reference(
                "PARTICLE TYPE",
                "PARTICLE TYPE",
                "name or pattern of the bulk that counts; without it all that is free",
                wildcards=True,
            ),
            Parameter("BELT", "name", "the belt, as *CONTACT GROUP names it; without it all bonds"),
            _reference("PART", "PART", "name or pattern of the parts, which are summed", wildcards=True),
        ),
        (
            Column("point", ("px", "py", "pz"), unit="m"),
            Column("normal", ("nx", "ny", "nz")),
            Column("radius", ("radius",), unit="m", range=POSITIVE, least=0),
        ),
        count=(0, 1),
        key=("NAME",),
        decides="TYPE",
        variants=(
            ("MASS FLOW", Variant((), ("PARTICLE TYPE",), rows=(1, 1))),
            ("TENSION", Variant((), ("BELT",), rows=(1, 1))),
            ("SAG", Variant((), ("BELT",), rows=(1, 1))),
            ("POWER", Variant(("PART",), rows=(0, 0))),
        ),
    ),
)

KEYWORDS: dict[str, Keyword] = {
    keyword.name: keyword for keyword in (*_GENERAL, *_MATERIALS, *_PARTICLES, *_BONDS, *_PARTS, *_CASE)
}
