"""Tables of dynamics and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.results import KeyNumber, TableKind
from mechdesign.questions.columns import DRIVE, EFFICIENCY, GIVEN, TIMED, VALID
from mechdesign.questions.kinematics.columns import OVER

DYNAMICS = TableKind.of("dynamics", "drive efforts, shaking forces and energies per pose",
    TIMED, DRIVE, GIVEN,
    ("<drive>_effort", "torque or force of the drive, positive where it drives <drive> up", "force or moment",
     "virtual work of all forces, those of inertia among them"),
    ("<drive>_power", "power that the drive puts in", "power", "effort times velocity"),
    ("shaking.x, shaking.y", "force of the mechanism on its frame, from joints, springs and drives", "force",
     "sum of weights, inertia forces and loads"),
    ("shaking_moment", "moment of the mechanism on its frame about the origin", "moment"),
    ("kinetic_energy", "energy of the motion", "moment", "sum of m v^2/2 + J omega^2/2"),
    ("potential_energy", "energy of weights, 0 at the origin, and of springs, 0 at their free lengths", "moment",
     "-sum of m g x + sum of k s^2/2 + preload s"), *EFFICIENCY, VALID)  # fmt: skip
JOINT_FORCES = TableKind.of("joint_forces", "what joints and couplings without wheels bear, a row a pose and each",
    TIMED, DRIVE, GIVEN, ("joint", "point, joint or coupling"),
    ("on", "what the force acts on: a link, or the pin of several links ('pin:')"),
    ("by", "what exerts it; of a telescopic leg its rod ('leg:rod') and the part at its first end are two bodies; of a "
     "coupling without wheels, whose moment is that of a controller or a hidden gear, the coupling itself"),
    ("fx, fy", "force on the one by the other, axes of the world; of a slide with the push of its drive", "force"),
    ("moment", "moment likewise, about the joint's point; nan where equilibrium leaves it open", "moment"),
    ("magnitude", "size of the force", "force"), ("angle", "its direction from the world's x axis", "angle"),
    ("normal", "of a slide the force across its line, to the left positive; of a cam the contact force, negative where "
     "the follower lifts off", "force"), VALID)  # fmt: skip
EXTREMES = TableKind.of("extremes", f"extremes and means of efforts, forces and energies <{OVER}>",
    ("output", "column of dynamics.csv, 'shaking' for the size of that force, or a joint's force by the joint and, "
     "where it has several, what it acts on, in its own unit"),
    ("min", "smallest value over the motion, in `unit`"),
    ("min_at", "<swept> at the smallest value", "as what is swept"),
    ("max", "largest value over the motion, in `unit`"), ("max_at", "<swept> at the largest value", "as what is swept"),
    ("peak", "largest absolute value, in `unit`"), ("peak_at", "<swept> at the peak", "as what is swept"),
    ("mean", "mean over the way of the motion, in `unit`"),
    ("rms", "root of the mean square over the way of the motion, in `unit`"),
    ("cubic_mean", "of a joint's force the constant one of the same life of a ball bearing, over the same way, in "
     "`unit`; nan of others", "", "cube root of the mean of F^3 (ISO 281)"),
    ("unit", "unit of its numbers"))  # fmt: skip
FORWARD = TableKind.of("forward", "the motion that given efforts bring about, a row an instant",
    TIMED, DRIVE, ("<drive>_velocity", "velocity of <drive>", "as the drive, per time"),
    ("<drive>_acceleration", "acceleration of <drive>", "as the drive, per time^2"),
    ("<drive>_effort", "torque or force that is given", "force or moment"),
    ("<output>", "output", "as the output"), ("kinetic_energy", "energy of the motion", "moment"),
    ("potential_energy", "energy of weights and springs", "moment"),
    ("work", "work of efforts and loads since the start, less what dampers, stops and friction took: the gain of both "
     "energies", "moment"),
    ("friction_work", "work of friction since the start, never positive", "moment"), VALID)  # fmt: skip
EVENTS = TableKind.of("events", "limits reached, values passed and standstills in time, a row each",
    ("event", "name of the crossing or limit; 'standstill' where friction holds the whole mechanism from then on"),
    ("time", "when; nan if never", "time"),
    ("direction", "up where the value rises through it, else down; at a limit and a standstill down"))  # fmt: skip
FLYWHEEL = TableKind.of("flywheel", "the flywheel that evens out the drive's speed over a cycle; nan where it is none",
    ("drive", "drive"), ("mean_speed", "mean velocity of the drive", "as the drive, per time"),
    ("mean_effort", "mean torque over the cycle: a motor of this torque drives it", "moment"),
    ("surplus", "largest energy that is taken up and given back over the cycle", "moment",
     "max - min of the integral of effort less mean effort"),
    ("inertia", "mean moment of inertia of the mechanism, seen by the drive", "moment_of_inertia",
     "2 T / omega^2"),
    ("fluctuation", "coefficient of fluctuation without a flywheel", "", "surplus / (inertia omega^2)"),
    ("added_inertia", "moment of inertia to add on the drive for the fluctuation asked", "moment_of_inertia",
     "surplus / (fluctuation omega^2) - inertia, at least 0"),
    ("speed_unit", "unit of mean_speed"), ("moment_unit", "unit of mean_effort and surplus"),
    ("inertia_unit", "unit of inertia and added_inertia"))  # fmt: skip
MODES = TableKind.of("modes", "natural frequencies of small motion about each pose, without friction", DRIVE,
    ("mode", "number of the mode, the slowest first"),
    ("frequency", "natural frequency, 0 where the motion is indifferent; nan where the pose is unstable or singular, "
     "or without inertia", "1/time", "sqrt(eigenvalue of M^-1 K) / (2 pi)"),
    ("<drive>_shape", "share of <drive> in the mode, the largest 1; lengths in sizes of the mechanism"))  # fmt: skip
KEY_NUMBERS = (
    KeyNumber(FLYWHEEL, "added_inertia", "moment of inertia that the flywheel adds on {drive}", "first"),
    KeyNumber(DYNAMICS, "<drive>_effort", "peak effort of {name} with weights and inertia", "size"),
    KeyNumber(JOINT_FORCES, "magnitude", "largest joint force, at {joint}", "largest"),
    KeyNumber(DYNAMICS, "<drive>_power", "peak power of {name}", "size"),
    KeyNumber(DYNAMICS, "efficiency", "smallest efficiency", "smallest"),
    KeyNumber(DYNAMICS, "shaking_moment", "largest shaking moment", "size"),
)  # fmt: skip
