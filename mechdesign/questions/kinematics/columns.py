"""Tables of kinematics and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.results import KeyNumber, TableKind
from mechdesign.questions.columns import DRIVE, EFFICIENCY, GIVEN, TIMED, VALID

# Place in the meaning of a table of numbers of whole motions, see `mechdesign.questions.kinematics.along.over`.
OVER = "over the motion, or of the asked poses only"
MOTION = TableKind.of("motion", "positions, velocities and accelerations per pose",
    TIMED, DRIVE, GIVEN, ("<output>", "value of <output>", "as the output"),
    ("<output>_velocity", "velocity of <output>", "as the output, per time"),
    ("<output>_acceleration", "acceleration of <output>", "as the output, per time^2"),
    ("<output>_error", "<output> less its target", "as the output"),
    ("<point>_error", "distance of <point> from its target", "length", "sqrt(dx^2 + dy^2)"),
    ("det_J", "determinant of the Jacobian of <outputs> by the drives, per radian",
     "as its outputs over the drives, multiplied", "det(d outputs/d drives)"),
    ("inverse_condition", "smallest over largest singular value of the Jacobian of <outputs> by the drives", "",
     "sigma_min/sigma_max"),
    ("conditioning", "how far the drives are from a singularity: 0 at one, at most 1; the sine of the angle between "
     "two links that meet"),
    ("<drive>_effort", "static drive effort, which balances the loads without weights and inertia", "force or moment",
     "-sum over the loads of F d(place)/d(drive)"), *EFFICIENCY[1:],
    ("<output>_advantage", "force or moment of <output> over that put in at <input>, without friction",
     "as the input's length over the output's", "rate of the input/rate of the output"),
    ("<coupling>_pressure_angle", "pressure angle of cam <coupling>", "angle",
     "from the follower's velocity to the normal of the profile"),
    ("<coupling>_curvature_radius", "radius of curvature of cam <coupling>", "length",
     "negative where the cam is hollow"),
    ("<a>.<b>.clearance", "distance of the outlines of <a> and <b>, links or pins; where they overlap minus the depth",
     "length"),
    ("clearance", "smallest of all clearances between links, and between pins and links", "length"), VALID)  # fmt: skip
INSTANT_CENTRES = TableKind.of("instant_centres", "instant centres of velocity of pairs of links",
    TIMED, DRIVE, GIVEN,
    ("<a>.<b>.x, <a>.<b>.y", "place of the instant centre of <a> and <b>; inf where one translates against the other",
     "length"), ("<a>.<b>.motion", "how <a> moves against <b>: rotation, translation or rest"), VALID)  # fmt: skip
EXTREMES = TableKind.of("extremes", f"extremes of the outputs <{OVER}>",
    ("output", "output, error, effort, mechanical advantage, clearance, velocity or acceleration, in its own unit"),
    ("min", "smallest value over the motion, in `unit`"),
    ("min_at", "<swept> at the smallest value", "as what is swept"),
    ("max", "largest value over the motion, in `unit`"), ("max_at", "<swept> at the largest value", "as what is swept"),
    ("range", "max - min, in `unit`"),
    ("time_ratio", "longer over shorter time between the extremes, constant speed", "",
     "max(t, T - t)/min(t, T - t), T the time of a turn"), ("unit", "unit of min, max and range"))  # fmt: skip
JACOBIAN = TableKind.of("jacobian", "derivatives of outputs by the drives, per radian",
    TIMED, DRIVE, GIVEN,
    ("<output>_by_<drive>", "derivative of <output> by <drive>, angles in radians", "as the output, over the drive's",
     "d output/d drive"), VALID)  # fmt: skip
LIMITS = TableKind.of("limits", "limits of motion and singularities found along it",
    ("<swept>", "value at the limit of motion", "as what is swept"),
    ("row", "place along the path in rows from 0: value at the limit of motion"), GIVEN,
    ("kind", "what ends the motion, such as a dead centre, a singularity or a limit"), ("joint", "where"),
    ("<output>", "<output> at the limit", "as the output"))  # fmt: skip
LOOPS = TableKind.of("loops", f"four-bars and slider-cranks, and how well they transmit <{OVER}>",
    ("kind", "what the four bodies and their joints are"), ("<part>", "the <part> link"),
    ("joints", "joints from the frame round"), ("<part>_length", "length of the <part>", "length"),
    ("offset", "offset of the slide", "length"), ("class", "Grashof's class, or the kind of slider-crank"),
    ("excess", "p + q - s - l; rod - crank - offset; |crank - frame| - offset: a link turns fully where positive",
     "length"), ("transmission_min", "smallest angle between coupler and output, up to 90 deg", "angle"),
    ("transmission_min_at", "<swept> at the smallest value", "as what is swept"),
    ("transmission_max", "largest angle between coupler and output, up to 90 deg", "angle"),
    ("transmission_max_at", "<swept> at the largest value", "as what is swept"))  # fmt: skip
TOGGLES = TableKind.of("toggles", "links of four-bars and slider-cranks that come into line",
    ("<swept>", "value at which the links are in line", "as what is swept"),
    ("row", "place along the path in rows from 0: value at which the links are in line"), GIVEN,
    ("links", "the two links in line"), ("state", "extended, folded, or perpendicular to the slide"),
    ("joints", "joints of the two links"), ("effect", "what it does"),
    ("loop", "the four-bar or slider-crank"))  # fmt: skip
TARGETS = TableKind.of("targets", f"errors of the outputs against their targets <{OVER}>",
    ("output", "what has a target"),
    ("rms", "root of the mean square of the error (of a point: of its distance), in `unit`", "", "sqrt(mean(e^2))"),
    ("mean", "mean error, in `unit`"), ("max_abs", "largest absolute error, in `unit`"),
    ("at", "<swept> at the largest error", "as what is swept"), ("unit", "unit of its errors"))  # fmt: skip
CAM = TableKind.of("cam", "profiles of cams in their frames",
    ("coupling", "coupling of the cam"), ("side", "side of the profile: outer, or inner of a ring or a groove"),
    ("<coordinate>", "coordinate that a cam's follower follows, or that of the follower", "as the coordinate"),
    ("x, y", "place of the profile in the frame of the cam", "length"),
    ("pressure_angle", "from the follower's velocity to the normal of the profile", "angle",
     "atan((v x n)/(v . n))"),
    ("curvature_radius", "radius of curvature of the profile, negative where it is hollow", "length"),
    ("face", "place of the contact along a flat face, from its point", "length"))  # fmt: skip
MODES = TableKind.of("modes", "the motion of every assembly mode",
    ("mode", "assembly: the joints that choose it and their sides"),
    ("<column>", "<its meaning in motion.csv>", "as in motion.csv"))  # fmt: skip
KEY_NUMBERS = (
    KeyNumber(MOTION, "<a>.<b>.clearance", "least clearance, {pair}", "smallest", nearest=True),
    KeyNumber(MOTION, "<drive>_effort", "largest static effort of {name}", "size"),
    KeyNumber(MOTION, "<coupling>_pressure_angle", "largest {meaning}", "size"),
    KeyNumber(EXTREMES, "range", "range of {output}", bounds=("min", "max")),
    KeyNumber(LOOPS, "transmission_min", "smallest transmission angle, {joints}", "smallest", at="transmission_min_at"),
    KeyNumber(MOTION, "<output>_velocity", "largest {meaning}", "size"),
    KeyNumber(MOTION, "<coupling>_curvature_radius", "smallest {meaning}", "least"),
    KeyNumber(MOTION, "conditioning", "smallest {name} (0 singular, 1 best)", "smallest"),
)  # fmt: skip
