"""The poses of a motion that a result carries, with what pictures need of them: paths of points, travel of slides."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.analyses.shown import Shown
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Fixed
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.report.figures.framing import extent
from mechdesign.report.figures.scene import link_points, pose, travels

_TRAVEL_POSES = 100  # poses from which the travel of the slides is taken
# Two poses are one where no point is farther apart than this part of the mechanism's size.
_CLOSED = 1e-3


@dataclass(frozen=True, eq=False)
class Sweep(Shown):
    """Poses in the order of a motion."""

    @classmethod
    def of(cls, shown: Shown) -> Sweep:
        """What a result carries."""
        return cls(shown.study, shown.poses, shown.rows, shown.configuration)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism that moves."""
        return self.study.mechanism

    @cached_property
    def values(self) -> dict[str, Floats]:
        """The coordinates given, in the study's units."""
        return {name: self.poses.values[name][self.rows] for name in self.poses.groups[0].names}

    @cached_property
    def valid(self) -> Ints:
        """Indices of the valid poses."""
        return np.flatnonzero(self.configuration.valid)

    @cached_property
    def places(self) -> dict[str, Complexes]:
        """Path of every moving point, nan where a pose is not valid."""
        still = link_points(self.mechanism.description.links[GROUND])
        valid = self.configuration.valid
        return {
            point: np.where(valid, self.configuration.point(point), complex(np.nan, np.nan))
            for point in self.mechanism.points
            if point not in still
        }

    @cached_property
    def travel(self) -> dict[str, tuple[float, float]]:
        """Range of each slide."""
        some = self.valid[np.unique(np.linspace(0, len(self.valid) - 1, _TRAVEL_POSES).astype(int))]
        scenes = [pose(self.mechanism, self.configuration, int(index)) for index in some]
        return travels([scene for scene in scenes if scene is not None])

    @cached_property
    def extent(self) -> Complexes:
        """Everything the motion reaches: points, their paths and the ends of guides."""
        mechanism, configuration = self.mechanism, self.configuration
        ground = [configuration.point(point)[:1] for point in link_points(mechanism.description.links[GROUND])]
        reached = [np.empty(0, dtype=complex), *ground, *self.places.values()]
        for index in self.valid[[0, -1]] if len(self.valid) else ():
            scene = pose(mechanism, configuration, int(index))
            if scene is not None:
                reached += [np.array(guide.ends(self.travel, scene.span)) for guide in scene.guides]
        return np.concatenate(reached)

    @property
    def returns(self) -> bool:
        """Whether the first and the last pose are one."""
        if self.poses.closed:
            return True
        _, wide, tall = extent(self.extent)
        return all(abs(path[-1] - path[0]) <= _CLOSED * max(wide, tall) for path in self.places.values())

    @property
    def closed(self) -> bool:
        """Whether the motion ends where it began, every pose valid."""
        return len(self.valid) == len(self.rows) and self.returns

    def words(self, index: int) -> str:
        """``crank = 60 deg`` for one pose; a line may be broken between coordinates only."""
        parts = []
        for name, values in self.values.items():
            unit = self.study.units.label(self.mechanism.quantity(name))
            parts.append(f"{name} = {values[index] + 0.0:.4g} {unit}".rstrip().replace(" ", "\N{NO-BREAK SPACE}"))
        return ", ".join(parts)


def ranks(mechanism: Mechanism, outputs: tuple[str, ...] = ()) -> dict[str, int]:
    """How much the path of each moving point has to tell.

    2 for points that are asked for and points of one link only (a coupler point, a tool), 1 for joints between moving
    links, 0 for points that turn about a pivot of the ground or slide along a line of it.
    """
    links = mechanism.description.links
    ground = set(link_points(links[GROUND]))
    uses = Counter(point for link in links.values() for point in link_points(link))
    simple = {
        joint.point
        for joint in mechanism.description.joints.values()
        if not isinstance(joint, Fixed) and joint.line.link == GROUND
    }
    for name, link in links.items():
        points = link_points(link)
        if name != GROUND and not link.telescopic and ground & set(points):
            simple |= set(points)
    asked = {name.split(".")[0] for name in outputs}
    found = {}
    for point in mechanism.points:
        if point in ground:
            continue
        if point in asked or (uses[point] == 1 and point not in simple):
            found[point] = 2
        else:
            found[point] = 0 if point in simple else 1
    return found
