"""What is asked of errors at solved poses: nominal values, and to the first order errors and margins of assembly."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism import Configuration, Reason
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.margins import closures
from mechdesign.motion.motion import Motion, SolvedPoses
from mechdesign.motion.question import PoseQuestion, PoseValues, evaluate
from mechdesign.motion.rows import NOWHERE, Poses
from mechdesign.questions.kinematics.rates import DriveRates, drive_rates
from mechdesign.questions.reliability.deflection import Elastic, Elasticity, cautions, elasticity
from mechdesign.questions.reliability.first_order import FirstOrder, derivatives, nominal_values
from mechdesign.questions.reliability.forces import ForceModel, force_model, pace
from mechdesign.questions.reliability.lengths import model_of
from mechdesign.questions.reliability.limits import ErrorBound
from mechdesign.questions.reliability.question import ReliabilityQuestion, ask
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.reliability.schema.variation import LOADS
from mechdesign.questions.reliability.sources import Sources
from mechdesign.questions.reliability.study_sources import find_sources
from mechdesign.questions.reliability.task import Task
from mechdesign.study import Study


@dataclass(frozen=True, eq=False)
class Errors(PoseQuestion):
    """The errors of a mechanism made within its tolerances; `doubts` are warnings about what the study says of them."""

    study: Study
    motion: Motion
    question: ReliabilityQuestion
    sources: Sources
    elasticity: Elasticity | None
    forces: ForceModel | None
    watched: Sequence[Coordinate]
    doubts: Sequence[Caution]

    together = 2048
    curve = None  # poses alone count: solving makes the motion between them where angles have turns

    @classmethod
    def of(cls, study: Study, poses: Poses = NOWHERE) -> Self:
        """Read what a study asks at some poses of one or several designs.

        Raises
        ------
        StudyError
            If nothing varies.
        """
        sources, doubts = find_sources(study, poses)
        question = ask(study, poses.section(ReliabilitySection.of(study)), poses)
        bent, notes = elasticity(study, poses)
        if bent is not None:
            notes += cautions(study, bent, question.channels)
        forces = force_model(study, poses)
        watched = [*question.coordinates, *(forces.coordinates if forces is not None else ())]
        return cls(study, study.motion(poses), question, sources, bent, forces, watched, [*doubts, *notes])

    def at(self, poses: Poses) -> Self:
        return type(self).of(self.study, poses)

    def rates(self, part: SolvedPoses) -> DriveRates:
        """Rates of the drives, where velocities count: those of made mechanisms, too."""
        if not self.question.moving:
            return DriveRates((), ())
        return drive_rates(pace(self.study), part, self.study.mechanism.linearize(part.configuration))

    def unknown(self) -> Mapping[str, Any]:
        channels = len(self.question.whole)
        parts = {"nominal": (channels,), "components": (channels, len(self.sources.directions[1]))}
        if self.elasticity is not None:
            parts["flexibility"] = (channels, 3)
        if self.question.free is not None:
            parts["by_drive"] = (channels,)
        return {name: np.zeros((0, *shape)) for name, shape in parts.items()}

    def values(self, part: SolvedPoses) -> Mapping[str, Any]:
        nominal, linear, elastic = self.linearized(part.configuration, self.rates(part), part.rows)
        closing = self.closing(part.configuration, part.rows)
        arrays = {
            "nominal": nominal, "components": linear.components, "closing": closing.components,
            "margins": closing.offset,
        } | ({} if elastic is None else {"flexibility": elastic.flexibility})  # fmt: skip
        if self.question.free is not None:
            mechanism, whole = self.study.mechanism, self.question.whole
            by_drive = derivatives(mechanism, part.configuration, whole, mechanism.drives, self.rates(part))
            arrays["by_drive"] = by_drive[:, 0]
        return {name: np.moveaxis(values, -1, 0) for name, values in arrays.items()}

    def linearized(
        self, configuration: Configuration, rates: DriveRates, rows: Ints | None = None
    ) -> tuple[Floats, FirstOrder, Elastic | None]:
        """Values of all that is judged, shape (channels, n), the linear model of its errors, and the deflections.

        The drives are held. `rows` are those of a flat batch of configurations among the poses, where designs differ.
        """
        mechanism, channels, sources, forces = self.study.mechanism, self.question.whole, self.sources, self.forces
        if rows is not None:
            sources, forces = sources.take(rows), None if forces is None else forces.take(rows)
        elastic = None if self.elasticity is None else self.elasticity.at(configuration, channels, rows)
        names, slopes = sources.directions
        by_name = derivatives(mechanism, configuration, channels, names, rates, elastic, forces)
        offset = np.zeros(by_name[:, 0].shape) if elastic is None else elastic.offset
        nominal = nominal_values(mechanism, configuration, channels, rates, forces)
        values = np.stack(np.broadcast_arrays(*nominal, offset[0])[:-1])
        return values, FirstOrder(sources, _chained(slopes, by_name), offset), elastic

    def closing(self, configuration: Configuration, rows: Ints | None = None) -> FirstOrder:
        """Linear model of the margins of assembly; a made mechanism with a negative one cannot be assembled."""
        sources = self.sources if rows is None else self.sources.take(rows)
        names, slopes = sources.directions
        moved = [k for k, name in enumerate(names) if name not in LOADS]
        margins, by_name = closures(self.study.mechanism.linearize(configuration), [names[k] for k in moved])
        return FirstOrder(sources, _chained(slopes[:, moved], by_name), margins)


def _freed(limit: ErrorBound, components: Floats, offset: Floats, by_drive: Floats, nominal: Floats) -> None:
    """Let the drive follow the errors, so that a point comes nearest to its target: its error is across its path.

    Parameters
    ----------
    components, offset, by_drive, nominal : ndarray, shapes (channels, components, poses) and thrice (channels, poses)
        Derivatives of the channels by the sources, which change as the errors without a source do, and by the drive.
    """
    pair = [*limit.channels]
    speed = by_drive[pair]
    square = np.where(np.isfinite(limit.high) & (speed**2 > 0).any(axis=0), (speed**2).sum(axis=0), np.inf)
    away = nominal[pair] + offset[pair] - np.stack(np.broadcast_arrays(*limit.middle, offset[0])[:2])
    components -= by_drive[:, None] * (np.einsum("cp,czp->zp", speed, components[pair]) / square)
    offset -= by_drive * ((speed * away).sum(axis=0) / square)


def _chained(slopes: Floats, by_name: Floats) -> Floats:
    """Derivatives by components from those by names, (channels, names, poses), and the slopes of the sources."""
    if slopes.ndim == 2:
        return np.asarray(slopes @ by_name)
    return np.asarray(np.einsum("znp,cnp->czp", slopes, by_name))


def first_order(errors: Errors, also: Callable[[SolvedPoses], object] = lambda part: None) -> Task:
    """The nominal mechanism and its linear error model at every pose; `also` is called with the solved poses."""
    return linear_task(evaluate(errors, also=also))


def linear_task(values: PoseValues) -> Task:
    """The nominal mechanism and its linear error model at the poses of values, nan where it is not assembled.

    Poses that do not hold the study's load, or of whose forces some are asked and not finite, are `NOT_HELD`.
    """
    errors: Errors = values.question
    question, count = errors.question, errors.poses.count
    arrays = {name: np.ascontiguousarray(np.moveaxis(part, 0, -1)) for name, part in values.arrays.items()}
    nominal, components = arrays["nominal"], arrays["components"]
    offset, elastic, held = np.zeros(nominal.shape), None, np.ones(count, dtype=bool)
    if errors.elasticity is not None:
        elastic = Elastic(arrays["flexibility"], errors.elasticity.load)
        offset, held = elastic.offset, elastic.held
    channels = len(question.channels)
    held &= np.isfinite(nominal[channels - len(question.columns) : channels]).all(axis=0)
    assembled = np.isin(values.reason, (Reason.OK, Reason.LIMIT))
    reason = np.where(assembled & ~held, np.int8(Reason.NOT_HELD), values.reason)
    components[:, :, ~np.isin(reason, (Reason.OK, Reason.LIMIT))] = np.nan
    if question.free is not None:
        _freed(question.free, components, offset, arrays["by_drive"], nominal)
    model = model_of(question, FirstOrder(errors.sources, components, offset), nominal)
    closing = FirstOrder(
        errors.sources, arrays.get("closing", components[:0]), arrays.get("margins", np.zeros((0, count)))
    )
    return Task(
        errors.study, errors.poses, question, errors.sources, reason, nominal[:channels], model, closing, elastic
    )  # fmt: skip
