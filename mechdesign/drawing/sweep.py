"""A motion as pictures show it: its poses, the paths of points between them, and which points tell most."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.drawing.framing import extent
from mechdesign.drawing.scene import Scene, Still
from mechdesign.ground.numerics.arrays import Complexes, Ints
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.elements.joints import Sliding
from mechdesign.mechanism.graph import GROUND
from mechdesign.motion.finer import CHORD, near_chords, ways_of
from mechdesign.questions.poses import Shown, pose_in_words
from mechdesign.study import Study

# Two poses are one where no point is farther apart than this part of the mechanism's size.
_SAME_POSE = 1e-3


@dataclass(frozen=True, eq=False)
class Sweep(Shown):
    """The poses of a motion that a result carries, in their order, with paths of points and travel of slides."""

    @classmethod
    def of(cls, shown: Shown) -> Sweep:
        """What a result carries."""
        return cls(shown.study, shown.poses, shown.rows, shown.configuration, shown.curve)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism that moves."""
        return self.study.mechanism

    @cached_property
    def valid(self) -> Ints:
        """Indices of the valid poses."""
        return np.flatnonzero(self.configuration.valid)

    @cached_property
    def places(self) -> dict[str, Complexes]:
        """Path of every moving point, nan where a pose is not valid."""
        still = self.mechanism.description.links[GROUND].all_points
        valid = self.configuration.valid
        return {
            point: np.where(valid, self.configuration.point(point), complex(np.nan, np.nan))
            for point in self.mechanism.points
            if point not in still
        }

    @cached_property
    def traces(self) -> dict[str, Complexes]:
        """Path of every moving point as a curve, with more places than those of the poses."""
        curve, points = self.curve, [*self.places]
        if curve is not None and not curve.spent.any() and len(self.rows) > 1:
            _, ways = near_chords(curve, ways_of(curve, points), self.poses.numbers[self.rows])
            # Of a motion that ends where it begins, at a dead centre, there are the poses alone.
            if np.isfinite(ways).any():
                return dict(zip(points, CHORD * curve.mechanism.size * ways, strict=True))
        # A closed path is listed without its begin at its end.
        return {name: np.append(path, path[:1]) if self.poses.closed else path for name, path in self.places.items()}

    @cached_property
    def scene(self) -> Scene:
        """The mechanism in all poses."""
        return Scene(self.mechanism, self.configuration)

    def at(self, k: int) -> Still | None:
        """The mechanism in a pose."""
        return self.scene.at(k)

    @property
    def first(self) -> Still | None:
        """The mechanism in the first valid pose."""
        return self.at(int(self.valid[0]))

    @cached_property
    def extent(self) -> Complexes:
        """Everything the motion reaches: points, their paths and the ends of guides."""
        ground = self.mechanism.description.links[GROUND].all_points
        reached = [np.empty(0, dtype=complex), *(self.scene.points[point][:1] for point in ground),
                   *self.traces.values()]  # fmt: skip
        for still in self.scene.some(self.valid[[0, -1]] if len(self.valid) else ()):
            reached += [np.array(guide.ends) for guide in still.guides]
        reached += [np.ravel(outline.places[self.valid]) for outline in self.scene.outlines]
        return np.concatenate(reached)

    @cached_property
    def returns(self) -> bool:
        """Whether the first and the last pose are one."""
        if self.poses.closed:
            return True
        _, wide, tall = extent(self.extent)
        return all(abs(path[-1] - path[0]) <= _SAME_POSE * max(wide, tall) for path in self.places.values())

    @property
    def closed(self) -> bool:
        """Whether the motion ends where it began, every pose valid."""
        return len(self.valid) == len(self.rows) and self.returns

    def words(self, index: int) -> str:
        """``crank = 60 deg`` for one pose; a line may be broken between coordinates only."""
        words = pose_in_words(self.study, self.poses, int(self.rows[index]), digits=4)
        return words.replace(" ", "\N{NO-BREAK SPACE}").replace(",\N{NO-BREAK SPACE}", ", ")


def ranks(study: Study) -> dict[str, int]:
    """How boldly the path of each moving point is drawn.

    2 for points that are asked for and points of one link only (a coupler point, a tool), 1 for joints between moving
    links, 0 for points that turn about a pivot of the ground or slide along a line of it.
    """
    mechanism, section = study.mechanism, study.kinematics
    links = mechanism.description.links
    ground = set(links[GROUND].all_points)
    uses = Counter(point for link in links.values() for point in link.all_points)
    simple = {
        joint.point
        for joint in mechanism.description.joints.values()
        if isinstance(joint, Sliding) and joint.line.link == GROUND
    }
    for name, link in links.items():
        points = link.all_points
        if name != GROUND and not link.telescopic and ground & set(points):
            simple |= set(points)
    outputs = {name.split(".")[0] for name in (section and section.outputs) or ()}
    rank = {}
    for point in mechanism.points:
        if point in ground:
            continue
        if point in outputs or (uses[point] == 1 and point not in simple):
            rank[point] = 2
        else:
            rank[point] = 0 if point in simple else 1
    return rank
