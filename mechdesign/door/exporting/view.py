"""What an export is made of: a study, the pose that is shown, its motion, and its plates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pydantic_core import PydanticCustomError

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.configuration import joined
from mechdesign.mechanism.elements.plates import Plates
from mechdesign.mechanism.plates import Sizes
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.kinematics.answers import Kinematics
from mechdesign.questions.poses import pose_in_words, study_poses
from mechdesign.study import Study
from mechdesign.study.text.reading import Context, read_number

# Width of links of a study without plates, as a part of the mechanism's size.
WIDTH = 0.08
# Most parts, or meetings, that a warning names.
MOST_NAMED = 3
# Least number of poses of a motion.
LOOKS = 721


@dataclass(frozen=True, eq=False)
class Track:
    """Poses of a motion, all valid.

    Parameters
    ----------
    configuration : Configuration
        The poses, shape (n,).
    follows : bool array, shape (n - 1,)
        Whether the motion goes on from each pose to the one behind it.
    places : ndarray, shape (n,)
        Row of each among the study's poses, with a fraction between two of them.
    """

    configuration: Configuration
    follows: Flags
    places: Floats


@dataclass(frozen=True)
class LinkSlot:
    """A slot in a link, in which the pin at a point slides, between two ends in the frame of the link."""

    link: str
    point: str
    ends: tuple[complex, complex]


@dataclass(frozen=True, eq=False)
class PosedStudy:
    """A study, and the pose in which it is shown: coordinates and values as the study writes them, or None.

    `rate` is that of a controller, or a step of time, and `paper` the size of a drawing sheet; None: not said.
    """

    study: Study
    at: str | None = None
    rate: str | None = None
    paper: str | None = None

    @property
    def mechanism(self) -> Mechanism:
        """The study's mechanism; a study that has only a task is refused."""
        self.study.need_mechanism("an export")
        return self.study.mechanism

    @cached_property
    def millimetres(self) -> float:
        """Millimetres in the study's unit of length; 1 where lengths are dimensionless."""
        units = self.study.units
        return 1.0 if units.length == "dimensionless" else 1.0 / units.convert("1 mm", "length")

    @cached_property
    def plates(self) -> Plates:
        """The plates of the study, else such of a width that fits its size."""
        given = self.mechanism.description.plates
        width = float(f"{WIDTH * self.mechanism.size:.1g}")
        return given if given is not None else Plates("plates", width)

    @property
    def assumed(self) -> tuple[Caution, ...]:
        """A warning where the study gives no plates."""
        if self.mechanism.description.plates is not None:
            return ()
        width = f"{self.plates.width:g} {self.study.units.label('length')}".rstrip()
        message = f"the study has no mechanism.plates: links are taken as {width} wide; give {{width: {width}}}"
        return (Caution("assumed", message),)

    @cached_property
    def sizes(self) -> Sizes:
        """Lengths of the plates, in the study's unit."""
        return Sizes(self.mechanism, self.plates, {})

    @cached_property
    def slots(self) -> list[LinkSlot]:
        """The slots of slides and telescopic links, as long as the travel over the motion."""
        graph, slots = self.mechanism.graph, []
        # Of joints first, then of legs.
        for slide in sorted(range(len(graph.slides)), key=graph.telescopic.__contains__):
            link, point = graph.guides[slide][0].removesuffix(":rod"), graph.sliding(slide)
            travel = self.track.configuration.slides[slide]
            ends = [self.in_frame(link, point, int(index(travel))) for index in (np.argmin, np.argmax)]
            slots.append(LinkSlot(link, point, (ends[0], ends[1])))
        return slots

    def in_frame(self, link: str, point: str, row: int) -> complex:
        """Place of a point in the frame of a link, in a pose of the motion."""
        configuration = self.track.configuration
        origin, along = self.mechanism.frame(link, configuration)
        places = (configuration.point(point) - origin) * np.conj(along)
        return complex(np.broadcast_to(places, configuration.shape)[row])

    def in_world(self, link: str, places: Iterable[complex]) -> list[complex]:
        """Places of the frame of a link in the world, in the pose that is shown."""
        origin, along = self.mechanism.frame(link, self.pose)
        return [complex(origin + along * place) for place in places]

    def points(self, link: str) -> dict[str, complex]:
        """Points of a link in its frame; the tip of a telescopic one is that of its rod."""
        local, points = self.mechanism.geometry.local, self.mechanism.description.links[link].points
        return {point: complex(local(link, point, {})) for point in points}

    def outline(self, link: str) -> list[complex]:
        """Places of a link's frame that its plate goes around: its points, and the ends of its slots."""
        ends = [end for slot in self.slots if slot.link == link for end in slot.ends]
        return [*self.points(link).values(), *ends]

    @property
    def posed(self) -> str:
        """The pose that is shown, in words."""
        return "the pose of the sketch" if self.at is None else self.at

    @cached_property
    def question(self) -> Kinematics | None:
        """What the study asks of its motion; None where it gives no poses, and none can be assumed."""
        try:
            poses = study_poses(self.study, "kinematics")
        except StudyError:
            return None
        return Kinematics.of(self.study, poses)

    @property
    def unmoved(self) -> tuple[Caution, ...]:
        """A warning where the study gives no motion."""
        if self.question is not None:
            return ()
        message = "the study gives no poses of kinematics: slots and layers are those of the sketch's pose alone"
        return (Caution("incomplete", message),)

    @cached_property
    def track(self) -> Track:
        """The motion of kinematics in at least `LOOKS` poses; without a motion the pose of the sketch.

        Raises
        ------
        StudyError
            If none is valid.
        """
        if self.question is None:
            still = self.mechanism.sketch_configuration
            near = {**still.near, **self.mechanism.drawn_windings}
            still = replace(still, shape=(1,), reason=still.reason.reshape(1), near=near)
            return Track(still, np.zeros(0, dtype=bool), np.zeros(1))
        poses, curve = self.question.poses, self.question.curve
        if curve is None or curve.spent.any():
            parts = [*solve_poses(self.question.motion, self.question.watched)]
            configurations = [part.configuration for part in parts]
            whole = joined(configurations, (poses.count,), self.mechanism.geometry.nominal, {}, self.mechanism.windings)
            places, follows = np.concatenate([part.rows for part in parts]) * 1.0, np.zeros(poses.count - 1, dtype=bool)
        else:
            finer = -(-(LOOKS - 1) // max(poses.end, 1))
            places = np.linspace(0.0, poses.end, poses.end * finer + 1)
            whole = curve.solve(np.zeros(len(places), dtype=np.intp), places).configuration
            follows = np.ones(len(places) - 1, dtype=bool)
        valid = np.flatnonzero(whole.valid)
        if not len(valid):
            raise StudyError("no pose of kinematics is valid: there is no motion to export")
        steps = np.diff(valid)
        return Track(whole.take(valid), follows[valid[:-1]] & (steps == 1), places[valid])

    def words(self, row: int) -> str:
        """A pose of the motion in words."""
        if self.question is None:
            return "in the sketch"
        poses, place = self.question.poses, self.track.places[row]
        if place == round(place) < poses.count:
            return pose_in_words(self.study, poses, round(place))
        return pose_in_words(self.study, poses.along(np.zeros(1, dtype=np.intp), self.track.places[row : row + 1]), 0)

    @cached_property
    def pose(self) -> Configuration:
        """The pose that is shown: that of `at`, else the sketch's.

        Raises
        ------
        StudyError, MechanismError, AssemblyError
            If `at` gives no pose, or one that cannot be assembled.
        """
        if self.at is None:
            return self.mechanism.sketch_configuration
        return self.mechanism.solve(self._given(self.at)).configuration

    def _given(self, text: str) -> dict[str, float]:
        """Coordinates of a text such as ``theta=60 deg, phi=20`` in the study's units."""
        context, values = Context(self.study.units, self.study.parameters.nominal), dict[str, float]()
        for part in text.split(","):
            name, equals, value = (piece.strip() for piece in part.partition("="))
            if not equals:
                raise StudyError(f"--at is a pose such as {self.mechanism.drives[0]}=60, not {part.strip()!r}")
            if name in values:
                raise StudyError(f"--at gives {name} twice")
            kind = self.mechanism.quantity(name)
            try:
                values[name] = float(read_number(value, context, kind))
            except PydanticCustomError as error:
                raise StudyError(f"--at {name}: {error}") from None
        return values


def several(named: Sequence[object]) -> str:
    """The first of what a warning names, and how many more there are."""
    more = [f"and {len(named) - MOST_NAMED} more"] if len(named) > MOST_NAMED else []
    return "; ".join([*map(str, named[:MOST_NAMED]), *more])
