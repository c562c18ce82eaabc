"""One study on its way through the house, step by step: ``python -m pdb docs/contributing/one_study.py``."""

import math

import mechdesign
from mechdesign.ground.statistics import Request
from mechdesign.motion.answer import alone
from mechdesign.motion.question import solved
from mechdesign.questions.kinematics.answers import Kinematics
from mechdesign.questions.poses import study_poses

# Study: what a person wrote, read, checked, and with its mechanism.
study = mechdesign.load(
    text="""
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: [A, B, 90]
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {sweep: {theta: {from: 0, to: 360, step: 5}}, outputs: [rocker.angle]}
requirements: [{result: kinematics.rocker.angle, at_most: 150}]
"""
)

# Motion: the mechanism, units, and poses. It knows no study.
motion = study.motion(study_poses(study, "kinematics"))
assert motion.poses.count == 73
assert motion.in_words(6) == "theta = 30 deg"

# Question: it says once what it has at solved poses.
question = Kinematics.of(study, motion.poses)
(part,) = solved(question)
values = question.values(part)
assert values["rocker.angle"].shape == (73,)

# Between the poses the motion is a curve, and a column is a function along it.
along = question.along([Request("rocker.angle", end=1)])
(largest,), (place,) = along.worst("rocker.angle", 1)
# There the rod folds over the crank: O, B and D are a triangle.
triangle = math.acos((100**2 + 60**2 - (90 - 30) ** 2) / (2 * 100 * 60))
assert math.isclose(largest, 180 - math.degrees(triangle), rel_tol=1e-12)
assert place != round(place)

# Answer: the room of motion asks for all of that, poses and curve, and the question makes tables, warnings, pictures.
result = alone(question)
assert result.tables["extremes"]["max"][0] == largest

# Door: requirements are judged by the same functions, where they were asked.
(verdict,) = mechdesign.requirements(study, result)
assert verdict.met
assert verdict.worst == largest
