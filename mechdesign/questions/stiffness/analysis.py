"""How stiff is it? Stiffness and compliance at a point, equivalent springs and deflections under loads.

The poses of several designs are one batch, and so are the numbers of the section in which the designs differ.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Drawn, Result, Table
from mechdesign.ground.statistics import Request
from mechdesign.ground.work.threads import one_thread
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.motion.along import BELOW, PlainAlong
from mechdesign.motion.answer import alone
from mechdesign.motion.finer import finer
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.question import MotionQuestion, Passage, PoseValues, unfilled
from mechdesign.motion.rows import Poses
from mechdesign.motion.solving import solve_rows
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.poses import Shown, shown_of, study_poses
from mechdesign.questions.stiffness import tables
from mechdesign.questions.stiffness.body import Body, ask, hold, pushes, under_loads
from mechdesign.questions.stiffness.compliance import Held
from mechdesign.questions.stiffness.effects import Effects, effects_of
from mechdesign.questions.stiffness.elements import Hinge, SlideElement
from mechdesign.questions.stiffness.screws import RIGID
from mechdesign.questions.stiffness.tables import Springs
from mechdesign.study import Study

# Number of poses solved together.
CHUNK = 8192
# Tables in the order in which they are shown.
ORDER = ("stiffness", "compliance", "eigen", "springs", "deflections", "forces", "displacements")
# Tables that are drawn as curves.
DRAWN = ("stiffness", "forces")
# Columns of which nothing is said between the poses: directions, which jump, and counts.
OF_POSES = ("k_angle", "free_x", "free_y", "free_phi", "rank", "valid")
# Columns that go to infinity: where the body is rigid in a direction, and of compliances where a twist is free.
POLED = frozenset(["k_x", "k_y", "k_phi", "k_min", "k_max", "k_direction", *(f"{letter}{i}{j}" for letter in "KC"
                   for i in (1, 2, 3) for j in (1, 2, 3))])  # fmt: skip
# Smallest singular value of the unit wrenches below which a pose gets a warning: its stiffness depends on rounding and
# tolerances.
NEAR_SINGULAR = 1e-4
# Largest deflection, as a part of the mechanism's size, and turn (radians), that count as small.
SMALL = 0.1
R = TypeVar("R", Held, Effects)


@one_thread()
def stiffness(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Stiffness of a body or a pin at every pose of the study [S4]; see `mechdesign.stiffness`."""
    body = ask(study)
    return alone(Stiffness(body, study.motion(study_poses(study, "stiffness"))), progress, jobs)


@dataclass(frozen=True, eq=False)
class DrawnPose:
    """One solved pose as pictures show it.

    Parameters
    ----------
    row : int
        Its number among the poses.
    springs : Springs
        Equivalent springs of the legs in it.
    twists : dict of str to ndarray, shape (3, loads)
        By vertex, its twist about the asked point under each load, in the units of the mechanism.
    pushes : dict
        By the number of each load elsewhere, its places, forces and moments; see `pushes`.
    """

    body: Body
    row: int
    configuration: Configuration
    springs: Springs
    twists: dict[str, Floats]
    pushes: dict[int, list[tuple[complex, complex, float]]]


@dataclass(frozen=True, eq=False)
class DrawnStiffness(Drawn):
    """The poses whose stiffness was asked.

    Parameters
    ----------
    shown : Shown
        The solved poses, evenly spread where they are many.
    first, loose : DrawnPose or None
        The first valid pose, and the first with a free twist; None where there is none.
    values : PoseValues
        What the question has at the poses.
    """

    shown: Shown
    first: DrawnPose | None
    loose: DrawnPose | None
    values: PoseValues

    @cached_property
    def finer(self) -> PoseValues:
        """The same with as many poses as curves need."""
        curve, shown, question = self.shown.curve, self.shown, self.values.question
        if curve is None or curve.spent.any():
            return self.values

        def columns(values: PoseValues) -> dict[str, Floats]:
            own: Stiffness = values.question
            made = own.chosen(values, DRAWN)
            drawn = {(name, c.name): c.values for name, table in made.items() for c in table.columns
                     if c.values.dtype.kind == "f" and c.name not in OF_POSES}  # fmt: skip
            if "forces" in made:
                drawn["forces", ""] = np.hypot(drawn["forces", "fx"], drawn["forces", "fy"])
            return {f"{name} {column} {k}": part for (name, column), numbers in drawn.items()
                    for k, part in enumerate(numbers.reshape(own.poses.count, -1).T)}  # fmt: skip

        at_poses = columns(self.values)
        force = max((float(np.nanmax(part, initial=0.0)) for name, part in at_poses.items() if name[:8] == "forces  "),
                    default=0.0)  # fmt: skip
        arm = shown.study.mechanism.size
        sizes = {name: force * (arm if " mz " in name else 1.0) for name in at_poses if name.startswith("forces ")}
        return finer(question, curve, shown.poses.numbers[shown.rows], self.values, columns, sizes)[1]


def _made(name: str, values: PoseValues) -> Table:
    table: Table = values.question.chosen(values, (name,))[name]
    return table


@dataclass(frozen=True, eq=False)
class Stiffness(MotionQuestion):
    """What a study asks of the stiffness of a body; only some tables."""

    body: Body
    motion: Motion
    names: Collection[str] = ORDER
    watched: Sequence[Coordinate] = ()

    command: ClassVar[str] = "stiffness"
    lead: ClassVar[str] = "stiffness"
    lazy: ClassVar[bool] = True
    a_row_a_pose: ClassVar = {name: partial(_made, name) for name in ("stiffness", "compliance")}

    @property
    def together(self) -> int:
        return CHUNK

    @classmethod
    def of(cls, study: Study, poses: Poses) -> Self:
        """Read what a study asks at some poses."""
        return cls(ask(study), study.motion(poses))

    def at(self, poses: Poses) -> Self:
        return replace(self, motion=self.motion.at(poses))

    @property
    def loaded(self) -> bool:
        """Whether loads count: deflections by loads elsewhere, and by flanks that a load presses, are effects, too."""
        effects = not {"forces", "displacements"}.isdisjoint(self.names)
        return bool(self.body.given.wrenches) and (effects or self.body.uneven)

    def unknown(self) -> Mapping[str, Any]:
        body, count = self.body, len(self.body.given.wrenches)
        effects = vars(Effects.unknown(body.network, 0, count, body.size)) if self.loaded else {}
        return {**vars(Held.unknown(0, body.size)), **effects, "springs": []}

    def values(self, part: SolvedPoses) -> Mapping[str, Any]:
        """How the body is held, its springs, and the effects of the study's loads."""
        body, configuration = self.body.at(part.poses), part.configuration
        if not self.loaded:
            held, springs = hold(body, configuration)
            return {**vars(held), "springs": list(springs)}
        under, parts = under_loads(body, configuration)
        held, springs = (under.held, ()) if body.legs is None else hold(body, configuration)
        soft = under.held.compliance
        effects = Effects.joined(
            [effects_of(body.network, part, body.given.at, configuration, applied, soft) for part, applied in parts]
        )
        return {**vars(held), "springs": list(springs), **vars(effects)}

    def along(self, requests: Collection[Request]) -> PlainAlong | None:
        curve = self.curve
        if curve is None or curve.spent.all():
            return None
        along = PlainAlong(curve, self._columns, requests, poled=POLED)
        along.of_poses = OF_POSES
        return along

    def _columns(self, there: SolvedPoses) -> dict[str, Floats]:
        """Numbers of a row a pose, at solved poses; and what is zero where they go to infinity.

        With C the compliance, a radian counted as a length, all is measured by its trace, which has the poles of C.
        """
        values = unfilled(self.at(there.poses))
        values.fill(there)
        made = values.question.chosen(values, self.a_row_a_pose).values()
        numbers = {column.name: column.values.astype(float)
                   for table in made for column in table.columns if column.numeric}  # fmt: skip
        soft = values.arrays["compliance"]
        size = np.append(np.ones(2), self.body.extent)[: soft.shape[1]]
        soft = soft * size[:, None] * size
        stiff = 1.0 / np.trace(soft, axis1=1, axis2=2)
        below = {"C": stiff, "K": np.linalg.det(np.nan_to_num(soft * stiff[:, None, None]))}
        for name in POLED.intersection(numbers):
            zero = below[name[0]] if name[0] in below else stiff / numbers[name]
            # What is rigid everywhere has no poles.
            numbers[f"{BELOW}{name}"] = zero if (np.abs(zero) > RIGID * np.abs(stiff)).any() else np.ones(len(zero))
        return numbers

    def tables(self, passage: Passage) -> dict[str, Table]:
        return self.chosen(passage.values, self.names)

    def chosen(self, values: PoseValues, names: Collection[str]) -> dict[str, Table]:
        """Tables of some names, as far as the study asks for them, with the rows of all designs."""
        motion, held, springs = self.motion, _read(Held, values), _springs(values)
        body = self.body.at(motion.poses)
        soft, section, legs = held.compliance, body.section, body.legs
        effects = _read(Effects, values) if self.loaded else None
        count, method = len(section.wrenches), "serial legs" if legs is not None else "force method"
        makers: dict[str, Callable[[], Table]] = {
            "stiffness": lambda: tables.stiffness_table(motion, held, values.valid, method, section.direction),
            "compliance": lambda: tables.compliance_table(motion, soft),
        }
        length = section.characteristic_length
        if body.size == 3 and length is not None:
            makers["eigen"] = lambda: tables.eigen_table(motion, soft, length)
        if legs is not None:
            makers["springs"] = lambda: tables.springs_table(motion, [leg.name for leg in legs], springs)
        if count:
            loads = np.broadcast_to(body.loads, (motion.poses.count, count, 3))
            moved = effects.moved if effects is not None and body.uneven else None
            makers["deflections"] = lambda: tables.deflections_table(motion, loads, soft, moved)
        if effects is not None:
            makers["forces"] = lambda: tables.forces_table(motion, body.network, effects)
            makers["displacements"] = lambda: tables.displacements_table(motion, body.network, effects)
        return {name: make() for name, make in makers.items() if name in names}

    def uneven(self, passage: Passage) -> Mapping[str, Ints]:
        designs = self.poses.designs
        return {"springs": _springs(passage.values).counts(designs, self.poses.count // designs)}

    def say(self, passage: Passage, design: int) -> tuple[list[Caution], list[str]]:
        """Under-constrained poses, links without a beam, and legs without a free joint."""
        held, count = _read(Held, passage.values), self.poses.count // self.poses.designs
        rows = slice(design * count, (design + 1) * count)
        rank, margin, stiff = held.rank[rows], held.margin[rows], held.stiffness[rows]
        finite = (rank > 0) | np.isfinite(stiff).all(axis=(1, 2))
        loose, near = finite & (rank < self.body.size), finite & (rank == self.body.size) & (margin < NEAR_SINGULAR)
        warnings = _without_beam(self.body)
        for where, words in (
            (loose, "under-constrained: a twist is free (free_x, free_y, free_phi), and the compliance is nan"),
            (near, f"nearly under-constrained (wrenches within {margin[near].min(initial=1):.1e} of dependence)"),
        ):
            if where.any():
                row = int(where.argmax())
                first = self.motion.in_words(rows.start + row)
                said = f"{np.count_nonzero(where)} of {count} poses are {words}; the first: {first}"
                warnings.append(Caution("singular", said, "stiffness", row, first))
        return [
            *warnings,
            *self._large(passage, rows),
            *_without_joint(self.body),
            *(assumed(self.body.study) if self.body.given.dynamics else ()),
        ], []

    def _large(self, passage: Passage, rows: slice) -> Iterator[Caution]:
        """A warning about the largest deflection of the asked point where it is not small."""
        if not self.body.given.wrenches:
            return
        poses, values = self.poses.take(np.arange(rows.start, rows.stop)), passage.values
        body, size = self.body.at(poses), self.motion.mechanism.sizes(poses.places)
        soft = values.arrays["compliance"][rows]
        loads = np.broadcast_to(body.loads, (len(soft), len(self.body.given.wrenches), 3))
        moved = tables.deflections(loads, soft, values.arrays["moved"][rows] if self.loaded and body.uneven else None)
        way = np.hypot(moved[..., 0], moved[..., 1]) / np.reshape(size, (-1, 1))
        share = np.nan_to_num(np.fmax(way, np.abs(moved[..., 2]) if body.size == 3 else 0.0))
        if share.max(initial=0.0) <= SMALL:
            return
        row, load = np.unravel_index(int(share.argmax()), share.shape)
        first = self.motion.in_words(rows.start + int(row))
        turns = f" and turns by {numeral(np.degrees(moved[row, load, 2]), 3)} deg" if body.size == 3 else ""
        said = (
            f"under load {load + 1} the asked point moves by {numeral(way[row, load], 3)} times the mechanism's size"
            f"{turns} at {first}: deflections are linear in the load, and good only where they are small"
        )
        yield Caution("suspect", said, "deflections", int(row) * share.shape[1] + int(load), first)

    def drawn(self, passage: Passage) -> DrawnStiffness:
        """The shown poses, the first valid one, and the first with a free twist."""
        values = passage.values
        first, loose = (
            self._drawn_pose(values, int(where.argmax())) if where.any() else None
            for where in (values.valid, np.isfinite(values.arrays["free"][:, 0]))
        )
        return DrawnStiffness(shown_of(self.body.study, passage), first, loose, values)

    def _drawn_pose(self, values: PoseValues, row: int) -> DrawnPose:
        """A pose with its springs, and with the twists that the loads make."""
        body, configuration = self.body.at(self.poses.take(np.array([row]))), solve_rows(self.motion, np.array([row]))
        parts = under_loads(body, configuration)[1] if body.given.wrenches else []
        twists = {
            vertex: np.concatenate([(part.displacements[vertex] @ applied)[0] for part, applied in parts], axis=1)
            for vertex in (body.network.paths if parts else ())
        }
        springs = _springs(values)
        return DrawnPose(
            body, row, configuration, springs.take(springs.row == row), twists, pushes(body, configuration)
        )


def _read(record: type[R], values: PoseValues) -> R:
    """Values at poses as a record of arrays."""
    return record(**{part.name: values.arrays[part.name] for part in fields(record)})


def _springs(values: PoseValues) -> Springs:
    return Springs.sorted(values.arrays["springs"])


def _without_beam(body: Body) -> list[Caution]:
    links = body.study.mechanism.description.links
    return [
        Caution(
            "ignored",
            f"link '{name}' has a single point, and so no beam: it is rigid, though 'elastic' names it; give it two "
            "ends",
        )
        for name in body.given.elastic
        if len(links[name].corners) < 2
    ]


def _without_joint(body: Body) -> list[Caution]:
    return [
        Caution(
            "incomplete",
            f"leg '{leg.name}' has no free joint: it holds three ways at once and has no equivalent springs",
            "springs",
        )
        for leg in body.legs or ()
        if not any(isinstance(element, Hinge | SlideElement) and element.drive is None for element in leg.elements)
    ]
