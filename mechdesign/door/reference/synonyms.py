"""The field's words for what the reference has under another name, and for what is beyond the tool."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from mechdesign.door.reference.entries import Entry

# A word: the word of the reference in its place, and what it means.
SYNONYMS: Mapping[str, tuple[str, str]] = {
    "torque": (
        "<drive>_effort",
        "the effort of an angle drive; kinematics.loads asks for it, extremes.csv has its peak",
    ),
    "mechanical advantage": (
        "<output>_advantage",
        "the force of an output over that of the drive, without friction: kinematics.mechanical_advantage asks for it",
    ),
    "tolerance stack": ("contributions", "the share of each tolerance in an error: contributions.csv of reliability"),
    "transmission angle": (
        "transmission_min",
        "the smallest over the motion, of every four-bar and slider-crank: loops.csv of kinematics, and the picture "
        "'transmission'",
    ),
    "interference": ("collisions", "links whose outlines meet: kinematics.collisions, with mechanism.plates"),
    "end effector": ("workspace.point", "the point, or the link, that a robot moves"),
    "TCP": ("workspace.point", "the point, or the link, that a robot moves"),
    "toggle": ("toggles", "poses at which two links are in line: toggles.csv of kinematics"),
    "baseline": ("compare", "results to compare with: mechdesign compare BASELINE RESULTS"),
    "backlash": ("clearances", "reliability.clearances, the play in pins and gears"),
    "slop": ("clearances", "reliability.clearances, the play in pins and gears"),
    "lash": ("clearances", "reliability.clearances, the play in pins and gears"),
    "play": ("clearances", "reliability.clearances, the play in pins and gears"),
    "stroke": ("range", "the range of a coordinate: kinematics.extremes.B.x.range of extremes.csv"),
    "swing": ("range", "the range of an angle: kinematics.extremes.rocker.angle.range of extremes.csv"),
}


# Words of what is beyond the tool, and why.
BEYOND: Mapping[str, str] = dict.fromkeys(
    (
        "spatial", "spatial mechanism", "3D", "three-dimensional", "ball joint", "spherical", "spherical joint",
        "universal joint", "cardan joint", "cylindrical joint", "screw joint", "Stewart platform", "delta robot",
    ),
    "planar mechanisms only: every link moves in one plane, with pins and slides. A mechanism in space is for a "
    "program of multibody dynamics, such as MuJoCo, MBDyn, Project Chrono or Simscape Multibody; what of it moves "
    "in a plane goes on from here by 'mechdesign export --to model.xml' (docs/howto/simulate_elsewhere.md). How far "
    "a question goes: docs/theory/limits.md",
)  # fmt: skip


def entries() -> Iterator[Entry]:
    """Words of the field, and what they are called here, or why there is nothing of theirs."""
    for word, (own, meaning) in SYNONYMS.items():
        yield Entry(word, "other word", f"see {own}: {meaning}")
    for word, why in BEYOND.items():
        yield Entry(word, "out of scope", why)
