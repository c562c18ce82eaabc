"""Cams of a study over their whole profiles: a table, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.results import Table
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.cams import CamFollower
from mechdesign.motion.motion import in_study_units
from mechdesign.motion.question import PoseValues, Remark
from mechdesign.motion.rows import Poses
from mechdesign.questions.kinematics.columns import CAM
from mechdesign.questions.kinematics.moved import OUTSIDE
from mechdesign.study import Study

# Largest pressure angles of a follower that slides and of one that turns (degrees), as textbooks of cams recommend.
SLIDING, TURNING = 30.0, 45.0
# Corners of a law that a warning names.
MOST_NAMED = 8


@dataclass(frozen=True, eq=False)
class CamSide:
    """One side of a cam of several designs; arrays are of shape (designs, places), lengths and angles of the study."""

    cam: CamFollower
    side: str
    coordinates: Mapping[str, Floats]  # of the cam and of its follower, by name
    columns: Mapping[str, Floats]  # the other numbers of the table, by the name of their column
    undercut: Flags  # where the roller or the flat face cuts into the profile

    def caution(self, study: Study, design: int, kind: str, where: Flags, text: str) -> Iterator[Caution]:
        """A warning where some places of a design's profile are concerned."""
        if where.any():
            row, followed = int(where.argmax()), self.cam.followed
            value, unit = self.coordinates[followed.name][design][row], study.units.label(followed.quantity)
            first = f"{followed.name} = {value:.6g} {unit}".rstrip()
            side = f" ({self.side} side)" if len(self.cam.sides) > 1 else ""
            places = f"at {np.count_nonzero(where)} of {len(where)} places"
            message = f"cam {self.cam.coupling}{side}: {places} {text}; the first: {first}"
            yield Caution(kind, message, "cam", row, first)


def profiles(study: Study, poses: Poses) -> list[CamSide]:
    """The profiles of all cams in each design."""
    sides = []
    places = {name: values[:, None] for name, values in poses.own.places.items()}
    for cam in study.mechanism.cams:
        configuration = cam.along(cam.values, places)
        shape = poses.designs, len(cam.values)

        def whole(values: ArrayLike, shape: tuple[int, int] = shape) -> Floats:
            return np.array(np.broadcast_to(np.real(values), shape))

        coordinates = {
            c.name: whole(in_study_units(study.units, c, configuration.value(c))) for c in (cam.followed, cam.follower)
        }
        for side in cam.sides:
            touch = cam.touch(configuration, side)
            place = cam.local(configuration, touch.place)
            numbers: dict[str, ArrayLike] = {
                "x": place, "y": -1j * place, "pressure_angle": touch.pressure_angle / study.units.angle_factor,
                "curvature_radius": touch.radius, "face": touch.face,
            }  # fmt: skip
            columns = {name: whole(values) for name, values in numbers.items()}
            undercut = cam.undercuts(columns["curvature_radius"], cam.roller(configuration))
            sides.append(CamSide(cam, side, coordinates, columns, undercut))
    return sides


def outside(motion: PoseValues) -> Iterator[tuple[Remark, Flags]]:
    """Valid poses beyond the profile of a cam, and what is said of them."""
    for cam in motion.question.study.mechanism.cams:
        low, high = (float(in_study_units(motion.question.study.units, cam.followed, end)) for end in cam.given.range)
        words = (
            f"cam {cam.coupling}: {{number}} of {{count}} poses lie outside of its range, {cam.followed.name} from "
            f"{low:g} to {high:g}, where it has no profile"
        )
        yield Remark("cam", words), motion.valid & (motion.arrays[f"{OUTSIDE}{cam.coupling}"] == 1.0)


def cam_table(study: Study, sides: Sequence[CamSide]) -> Table:
    """``cam.csv``: every profile of every design; coordinates of another cam are nan."""
    coordinates = {c.name: c for side in sides for c in (side.cam.followed, side.cam.follower)}

    def column(values: Callable[[CamSide], ArrayLike]) -> NDArray[Any]:
        columns = [np.broadcast_to(values(side), side.undercut.shape) for side in sides]
        return np.concatenate(columns, axis=1).ravel()

    words = {"coupling": column(lambda side: side.cam.coupling), "side": column(lambda side: side.side)}
    numbers = {name: column(lambda side, own=name: side.columns[own]) for name in sides[0].columns}  # type: ignore[misc]
    labels, followed = study.units.labels, []
    for name, coordinate in coordinates.items():
        values = column(lambda side, own=name: side.coordinates.get(own, np.nan))  # type: ignore[misc]
        followed.append(CAM["<coordinate>"].column(values, study.units.label(coordinate.quantity), coordinate=name))
    return CAM.table([*CAM.columns(labels, **words), *followed, *CAM.columns(labels, **numbers)])


def cautions(study: Study, sides: Sequence[CamSide], design: int) -> Iterator[Caution]:
    """Warnings of the cams of a design."""
    angle, turn = study.units.label("angle"), study.units.angle_factor
    for side in sides:
        cam, pressure = side.cam, np.abs(side.columns["pressure_angle"][design])
        limit = np.radians(SLIDING if cam.follower.quantity == "length" else TURNING) / turn
        lost, steep = np.isnan(side.columns["x"][design]), pressure > limit
        yield from side.caution(study, design, "unassembled", lost, "the profile cannot be assembled")
        cure = "a larger base circle helps" if cam.flat else "a larger base circle helps, or a smaller roller"
        text = f"the profile is undercut, and the follower leaves its law; {cure}"
        yield from side.caution(study, design, "cam", side.undercut[design], text)
        if steep.any():
            text = (
                f"the pressure angle is above {limit:.3g} {angle}, at most {np.nanmax(pressure):.4g}: the follower may "
                "jam; a larger base circle or another offset helps"
            )
            yield from side.caution(study, design, "cam", steep, text)
        rows = np.rint((cam.corners - cam.values[0]) / np.diff(cam.values[:2])).astype(int)
        corner = np.isin(np.arange(cam.given.steps + 1), rows)
        values = ", ".join(f"{value:.6g}" for value in side.coordinates[cam.followed.name][design][corner][:MOST_NAMED])
        text = f"the profile is broken, as the law of the follower has a corner ({values})"
        yield from side.caution(study, design, "cam", corner, text)
        if not cam.closed and cam.followed.quantity == "angle" and np.isclose(np.ptp(cam.given.range), TURN):
            end = np.arange(cam.given.steps + 1) == cam.given.steps
            yield from side.caution(study, design, "cam", end, "the profile does not close after a turn")
