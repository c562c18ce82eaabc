"""The linkages of a study's own mechanism, by ranges of its parameters: any mechanism of one drive is a family."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mechdesign.ground.errors import StudyError, suggestion
from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.synthesize.kinds import Kind
from mechdesign.questions.synthesize.schema import SynthesisSection
from mechdesign.study import Study
from mechdesign.study.loading import load_bytes
from mechdesign.study.schema.variable import plainly
from mechdesign.study.text.document import plain
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.units import Units


class OwnKind(Kind):
    """A study's mechanism in the assembly of its sketch; `values` are parameters, in the units of the study."""

    def __init__(self, study: Study, point: str, ranges: dict[str, tuple[float, float]]) -> None:
        super().__init__(study.name, study, point, tuple(ranges))
        self.low, self.high = np.array([*ranges.values()], dtype=float).T
        factor = study.units.angle_factor if self.mechanism.quantity(self.drive) == "angle" else 1.0
        run = study.motions["kinematics"].values.get(self.drive, np.zeros(1)) * factor
        begin, span = float(run.min()), float(np.ptp(run))
        # Of a motion over less than a turn no more is used.
        part = study.motions["kinematics"].followed and 0 < span < 2 * np.pi * (1 - 1e-9)
        if part or self.mechanism.quantity(self.drive) != "angle":
            self.turns, self.course = False, (begin, span)

    @property
    def pivots(self) -> tuple[tuple[int, int], ...]:
        """None whose places are values: they follow these."""
        return ()

    @property
    def kinematics(self) -> dict[str, Any]:
        """Its kinematics: the study's own where it has a motion, else a turn of its drive."""
        own: dict[str, Any] = plain(self.study.resolved.get("kinematics") or {})
        if self.study.motions["kinematics"].followed:
            return own
        turn = 2 * np.pi / self.study.units.angle_factor
        others = {key: value for key, value in own.items() if key not in KinematicsSection.sources}
        return {**others, "sweep": {self.drive: {"from": 0, "to": plainly(turn), "number": 181}}}

    @property
    def modes(self) -> list[tuple[int, ...]]:
        """The assembly of its sketch."""
        return [self.mechanism.forward.modes]

    @property
    def begun(self) -> list[tuple[int, ...]]:
        """The same."""
        return self.modes

    def scale(self, values: Floats, size: float) -> Floats:
        return np.asarray(self.high - self.low)

    def written(self, values: Floats, factor: float) -> Floats:
        return values

    def unit_of(self, place: str, units: Units) -> str:
        return self.study.unit_of(place) or ""

    def dimensions(self, values: Floats) -> dict[str, Number]:
        return self.study.parameters.places({name: values[..., k] for k, name in enumerate(self.places)})

    def by_places(self, values: Floats, linear: Linearization) -> Complexes:
        changed = {name: values[:, k : k + 1] for k, name in enumerate(self.places)}
        every, shape = self.study.parameters.values(changed), linear.configuration.shape
        slopes = [self.study.parameters.derivatives(name, every, changed) for name in self.places]
        places = [*dict.fromkeys(place for own in slopes for place in own)]
        nodes: Any = linear.sensitivity(places).nodes[self._node]
        by_place = dict(zip(places, nodes, strict=True))
        return np.stack([
            np.broadcast_to(sum(slope * by_place[place] for place, slope in own.items()), shape) for own in slopes
        ])  # fmt: skip

    def frame(self, values: Floats) -> Complexes:
        places = {**self.mechanism.nominal, **self.dimensions(values)}
        names = [name[:-2] for name in places if name.startswith("ground.") and name.endswith(".x")]
        points = [np.broadcast_to(places[f"{name}.x"] + 1j * places[f"{name}.y"], len(values)) for name in names]
        return np.stack(points, axis=1) if points else np.zeros((len(values), 0), dtype=complex)

    def links(self, values: Floats) -> dict[str, Floats]:
        places = {**self.mechanism.nominal, **self.dimensions(values)}
        return {name.removesuffix(".length"): np.broadcast_to(place, len(values)) for name, place in places.items()
                if name.endswith(".length")}  # fmt: skip

    def samples(self, random: np.random.Generator, count: int, ratio: float, *, full_turn: bool) -> Floats:
        """Random linkages, each parameter evenly in its range."""
        return random.uniform(self.low, self.high, (count, len(self.low)))


def own_kind(study: Study, section: SynthesisSection) -> OwnKind:
    """The family of the study that a section names.

    Raises
    ------
    StudyError
        Where the study makes no family: it has several drives, no such parameter, or no point is named.
    """
    assert section.of is not None
    assert section.path is not None
    folder = study.folder
    file = folder.path / section.of
    text = folder.text(section.of)
    own = load_bytes(text.encode(), file, folder=Folder(Path(file).parent, folder.anywhere))

    def wrong(message: str, *keys: str) -> StudyError:
        return StudyError([study.problem(message, "synthesis", *keys)])

    if own.units != study.units:
        raise wrong(f"its units are not those of the task: {own.units.length} and {own.units.angle}", "of")
    drives = own.mechanism.drives
    if len(drives) != 1:
        raise wrong(f"a family has one drive, and {section.of} has {len(drives)}: {', '.join(drives)}", "of")
    names = [*own.parameters.names()]
    for name in section.ranges:
        if name not in names:
            raise wrong(f"{section.of} has no parameter {name!r}{suggestion(name, names)}", "ranges", name)
        if not own.parameters.moved_places([name]):
            raise wrong(f"nothing of the mechanism of {section.of} follows {name}", "ranges", name)
    points = own.mechanism.points
    outputs = () if own.kinematics is None else own.kinematics.outputs or ()
    traced = [output for output in outputs if output in points]
    point = section.path.point or (traced[0] if len(traced) == 1 else None)
    if point is None:
        raise wrong(f"which point of {section.of} passes them? {', '.join(points)}", "path", "point")
    if point not in points:
        raise wrong(f"{section.of} has no point {point!r}{suggestion(point, points)}", "path", "point")
    kind = OwnKind(own, point, section.ranges)
    if not kind.turns and (section.needs_turn or section.path.timing is not None or not kind.course[1] > 0):
        raise wrong(
            f"{drives[0]} of {section.of} does not turn fully: it passes open paths without timing, over the range "
            "that its kinematics sweeps", "path",
        )  # fmt: skip
    return kind
