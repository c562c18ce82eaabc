"""Columns of a motion as functions along its curve, so between the poses as well."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import POSES_ONLY
from mechdesign.ground.statistics import Request
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import angles_of
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.four_bars import FourBar
from mechdesign.mechanism.margins import SINGULARITY, Cause
from mechdesign.mechanism.outputs import first
from mechdesign.motion.along import MEAN_OF, PACE, AlongMotion
from mechdesign.motion.curve import Curve
from mechdesign.motion.functions import Functions
from mechdesign.motion.motion import SolvedPoses, in_study_units
from mechdesign.motion.series import Evaluate
from mechdesign.motion.through import Through
from mechdesign.questions.friction import APART
from mechdesign.questions.kinematics import corners, targets
from mechdesign.questions.kinematics.columns import OVER
from mechdesign.questions.kinematics.moved import MovedQuestion, full
from mechdesign.questions.kinematics.rates import moving_at, unitless
from mechdesign.study.schema.loads import EFFICIENCIES

# Names of functions that no column has: products that are zero where the drives hold the mechanism no longer, and where
# they cannot move what the poses give in every direction.
FORWARD, INVERSE = "forward singularity", "inverse singularity"
# Columns that have a corner where the mechanism is singular.
_CONDITIONS = ("conditioning", "inverse_condition")


class KinematicAlong(AlongMotion):
    """Functions along the motions of a question.

    Parameters
    ----------
    names, also : collection of str
        Columns that are followed: those of the table of extremes where the first is left out, and others.
    requests : collection of Request
        Columns that are followed over the motion or parts of it, whether their means are asked, and which extremes.
    loops : sequence of FourBar
        Four-bars and slider-cranks of which sines and cosines of transmission angles are followed, and with `toggles`
        of the angles between coupler and input.
    """

    # As in the extremes, efficiencies are those of the poses.
    of_poses = EFFICIENCIES

    def __init__(
        self, question: MovedQuestion, curve: Curve, names: Collection[str] | None = None,
        loops: Sequence[FourBar] = (), *, also: Collection[str] = (), requests: Collection[Request] = (),
        toggles: bool = False, passages: bool = False,
    ) -> None:  # fmt: skip
        self.question = question
        self._loops, self._toggles = loops, toggles
        mechanism = question.study.mechanism
        # Not followed: efficiencies, which lose all digits where no power flows, and errors of targets given at poses.
        errors = {targets.error(output) for output in targets.judged(question.study)} - question.errors.keys()
        columns = {name: size for name, (size, _) in question.columns.items() if name not in (*EFFICIENCIES, *errors)}
        super().__init__(requests)
        whole = [request for request in requests if not request.part]
        shown = {*(columns if names is None else names), *also}
        judged = dict.fromkeys([*also, *(request.column for request in whole)])
        followed = dict.fromkeys([*(columns if names is None else names), *judged])
        columns |= question.parts
        self._others = [name for name in followed if name in question.orders or name not in columns]
        columns = {name: columns.get(name, 0.0) for name in followed}
        self.columns = tuple(columns)
        drives = set(mechanism.drives)
        self._groups = []
        if passages and set(question.poses.names) != drives:
            structure = mechanism.forward.structure
            self._groups = [k for k, group in enumerate(structure.groups) if group.solved]
        needed = {*columns, *(name for request in requests for name in request.columns)}
        self._errors = any(name.endswith("_error") for name in needed)
        self._poles = [name for name in question.poled if name in columns]
        self._chains: dict[str, tuple[int, ...]] = {}
        divisors = self._divisors()
        # The part of the question that the columns need.
        self._lean = question.lean(needed)
        self.curve = curve = corners.divided(self._lean, curve, errors=self._errors)
        angles = {angle.name for angle in curve.angles}
        self._turning = not angles.isdisjoint(angles_of(self._lean.evaluated))
        below = {name for name, _ in divisors.values()}
        integrals = {request.column for request in whole if request.integral}
        functions = columns | {name: 1.0 for name in (FORWARD, INVERSE, *self._chains) if name in below}
        functions |= {PACE: 0.0} if self._errors or integrals else {}
        functions |= {f"rate of {name}": 0.0 for name in self._poles}
        functions |= {f"group {k}": 1.0 for k in self._groups}
        arms = (0, 3) if toggles else (3,)
        lines = [f"{name} {k} {end}" for k in range(len(loops)) for end in arms for name in ("sine", "cosine")]
        functions |= dict.fromkeys(lines, 1.0)
        zeros = [*lines, *(f"group {k}" for k in self._groups), *(name for name in self._others if name in judged)]
        # Means are of the quotient itself where a function has poles.
        self._means = {name: f"{MEAN_OF}{name}" if name in divisors else name for name in columns if name in integrals}
        functions |= {f"{MEAN_OF}{name}": columns[name] for name in self._means if name in divisors}
        means = [*(name for name in columns if name.endswith("_error")), *self._means.values()]
        self._names = list(functions)
        magnitudes = [static.name for static in question.statics if static.magnitude]
        self._evaluate: Evaluate = self._evaluated
        if curve.plan.change_points is not None:
            smooth = [name not in _CONDITIONS for name in self._names]
            self._evaluate = Through(curve, self._evaluated, corners.determinant(question.study, curve), smooth)
        self._follow = partial(
            Functions, curve, self._names, self._evaluate, list(functions.values()), divisors,
            extremes=[*columns, *lines], means=means, zeros=zeros,
            magnitudes=[name for name in (*magnitudes, *_CONDITIONS) if name in columns],
            ends=self._ends([name for name in columns if name not in shown]),
        )  # fmt: skip

    @property
    def means_over(self) -> str:
        """What means are over, in words, where it is not what changes evenly with time though velocities are given."""
        section, poses = self.question.section, self.question.poses
        if not section.rated or section.means is not None or section.clocked(poses.swept):
            return ""
        path = poses.rule.path
        return f"the length of the path of {path}" if path is not None else poses.swept or "the poses"

    def again(self, curve: Curve, requests: Collection[Request], also: Collection[str] = ()) -> KinematicAlong:
        return KinematicAlong(self.question, curve, (), also=also, requests=requests)

    def _divisors(self) -> dict[str, tuple[str, int]]:
        """What functions with poles are divided by, and how often."""
        question = self.question
        rates = INVERSE if question.inverse else FORWARD
        divisors = dict.fromkeys((*(static.name for static in question.statics), *question.parts), (FORWARD, 1))
        divisors |= {name: (f"rate of {name}", 1) for name in self._poles}
        for name in self._others:
            output, _, order = name.rpartition("_")
            if output in question.study.mechanism.drives and not question.inverse:
                continue  # of their own rates, which have no poles
            if order in (powers := {"velocity": 1, "acceleration": 3}):
                divisors[name] = (rates if question.inverse else self._chain(output), powers[order])
        divisors |= {name: (FORWARD, 1) for name in self._others if name == "det_J" or "_by_" in name}
        return {name: divisor for name, divisor in divisors.items() if name in self.columns}

    def _chain(self, output: str) -> str:
        """The product of the conditionings of the groups that an output follows from, by name: its rates end there."""
        mechanism = self.question.study.mechanism
        structure = mechanism.forward.structure
        behind = sorted(structure.behind(mechanism.coordinate(output), mechanism.graph))
        groups = tuple(k for k in behind if structure.groups[k].solved)
        name = " ".join([FORWARD, *(str(k) for k in groups)])
        self._chains[name] = groups
        return name

    def _evaluated(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        there = self.curve.solve(line, s, judged=False, turning=self._turning)
        configuration, whole = there.configuration, self.question.poses
        own, linear = self._lean.moved(there)
        values = full(own, s.shape)
        arrays: dict[str, Value] = dict(values)
        if PACE in self._names:
            arrays[PACE] = self._pace(line, s, there, linear)
        if self._errors:
            rows = line * whole.line
            arrays |= targets.errors(self.question.study, whole, values, rows, between=True)
        signed = linear.conditionings
        forward = np.prod(np.broadcast_arrays(np.ones(len(s)), *signed.values()), axis=0)
        arrays[FORWARD] = np.abs(forward) if self._lean.passes_singularities else forward
        arrays |= {f"group {k}": signed[k] for k in self._groups}
        for chain, groups in self._chains.items():
            arrays[chain] = np.prod(np.broadcast_arrays(np.ones(len(s)), *(signed[k] for k in groups)), axis=0)
        if INVERSE in self._names:
            # Determinant of the derivatives of what the poses give by the drives.
            mechanism = self.question.study.mechanism
            outputs = [mechanism.coordinate(name) for name in whole.groups[0].names]
            matrix = unitless(mechanism, linear, outputs)[1]
            arrays[INVERSE] = np.asarray(np.linalg.det(np.nan_to_num(matrix))) * forward
        for name in self._poles:
            arrays[f"rate of {name}"] = self.question.pole(values, linear, name) * forward
        for k, loop in enumerate(self._loops):
            for end in (0, 3) if self._toggles else (3,):
                arrays[f"sine {k} {end}"], arrays[f"cosine {k} {end}"] = loop.squareness(configuration, end)
        arrays |= {name: column for name, column in there.poses.named.items() if name not in arrays}
        return self._table(arrays, len(s)), np.minimum(values["conditioning"], values.get(APART, 1.0))

    def _pace(self, line: Ints, s: Floats, there: SolvedPoses, linear: Linearization) -> Value:
        """What means are over, by row: time where the study says so, else that of `Poses.pace`."""
        question, study, whole = self.question, self.question.study, self.question.poses
        if question.section.means is None or question.section.clocked(whole.swept):
            return whole.pace(line, s)
        velocity = moving_at(question.section, there, linear).velocity
        assert velocity is not None
        if whole.rule.path is not None:
            return whole.pace(line, s) / np.abs(velocity.nodes[study.mechanism.graph.node(whole.rule.path)])
        coordinate = study.mechanism.coordinate(whole.swept or whole.moving[0])
        speed = in_study_units(study.units, coordinate, first(linear.configuration, coordinate, velocity))
        return whole.pace(line, s, coordinate.name) / np.abs(speed)

    def passages(self) -> list[tuple[int, float, Cause]]:
        """Where motions pass a forward singularity, at which the drives hold the mechanism no longer: line, place."""
        structure, graph = self.question.study.mechanism.forward.structure, self.question.study.mechanism.graph
        zeros = self.functions.zeros([f"group {k}" for k in self._groups], AT_SINGULARITY)
        passages = []
        joints = [" ".join(graph.joined(structure.groups[k].edges)) for k in self._groups]
        for number, line, place in zip(zeros.function.tolist(), zeros.line.tolist(), zeros.place.tolist(), strict=True):
            joint = joints[number]
            passages.append((line, place, Cause(SINGULARITY, joint, joint, self._groups[number], "passed")))
        return sorted(passages, key=lambda passage: passage[:2])


def along_of(
    question: MovedQuestion, names: Collection[str] | None = None, loops: Sequence[FourBar] = (), *,
    also: Collection[str] = (), requests: Collection[Request] = (), toggles: bool = False, passages: bool = False,
) -> KinematicAlong | None:  # fmt: skip
    """The motions of a question between their poses; None of listed poses and grids, and where none can be followed."""
    curve = question.curve
    if curve is None or curve.spent.all():
        return None
    return KinematicAlong(
        question, curve, names, loops, also=also, requests=requests, toggles=toggles, passages=passages
    )


def over(along: KinematicAlong | None, names: Sequence[str]) -> dict[str, str]:
    """For the meaning of a table of numbers of some functions over a motion: which of them are of the poses only."""
    if along is None or along.curve.spent.any() or along.functions.unresolved.any():
        return {OVER: POSES_ONLY}
    poses = [name for name in names if name not in along.functions.names]
    means = f", means over {along.means_over} and not time" if along.means_over else ""
    return {OVER: "over the motion" + means + (f"; of {', '.join(poses)} {POSES_ONLY}" if poses else "")}


# A group is singular where its conditioning is below this and turns back or ends.
AT_SINGULARITY = 1e-9
