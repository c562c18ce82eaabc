"""What follows from the forces of poses: a flywheel for a cycle, and natural frequencies of small motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.columns import Column
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Table
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import angles_of
from mechdesign.mechanism.derivatives import STALLED, Linearization, regularity
from mechdesign.mechanism.forces import Moving
from mechdesign.mechanism.statics import balance
from mechdesign.motion.motion import radians
from mechdesign.motion.question import PoseValues
from mechdesign.motion.rows import Poses
from mechdesign.questions.columns import DRIVE
from mechdesign.questions.dynamics.columns import MODES
from mechdesign.questions.dynamics.flywheel import flywheel_table
from mechdesign.questions.dynamics.question import ForceQuestion
from mechdesign.questions.dynamics.tables import question_of
from mechdesign.questions.kinematics.along import KinematicAlong

# Steps of the differences that give a stiffness (radians, or sizes of the mechanism), with their weights: their error
# is about 1e-12 of the stiffness.
STEP = 1e-3
STENCIL = {-2: 1 / 12, -1: -8 / 12, 1: 8 / 12, 2: -1 / 12}
# A stiffness below this part of the moments that act, and of the largest stiffness, is rounding: ten times that of the
# differences.
ROUNDING = 1e-11
# A mass below this part of the largest is rounding: there is no inertia along some motion.
NO_INERTIA = 1e-13


def further_tables(motion: PoseValues, along: KinematicAlong | None) -> tuple[dict[str, Table], list[Caution]]:
    """Tables that the study asks for, of a single design, and warnings about them; `along` is the motion."""
    section, tables, warnings = question_of(motion).section, dict[str, Table](), list[Caution]()
    if motion.question.poses.designs > 1:
        return tables, warnings
    if section.flywheel is not None:
        tables["flywheel"], warnings = flywheel_table(motion, along, section.flywheel)
    if section.modes:
        tables["modes"] = _modes_table(motion)
    return tables, warnings


def _modes_table(motion: PoseValues) -> Table:
    """A row each pose and mode."""
    question, study = question_of(motion), motion.question.study
    drives, poses = motion.question.drives, motion.question.poses
    values = [np.asarray(radians(study.units, d, motion.arrays[d.name]), dtype=float) for d in drives]
    angles = angles_of(motion.question.watched).items()
    near = {
        name: radians(study.units, c, motion.arrays[name]) for name, c in angles if name not in study.mechanism.drives
    }
    squares, shapes = _modes(question, poses, values, near)
    count = len(drives)
    frequency = np.where(squares >= 0, np.sqrt(np.abs(squares)) / (2 * np.pi), np.nan)
    columns: list[Column] = [
        DRIVE.column(np.repeat(motion.arrays[d.name], count), study.units.label(d.quantity), drive=d.name)
        for d in drives
    ]
    columns.append(MODES["mode"].column(np.tile(np.arange(1, count + 1), len(squares))))
    columns.append(MODES["frequency"].column(frequency.ravel(), f"1/{study.units.label('time')}"))
    columns += [
        MODES["<drive>_shape"].column(shapes[:, k].ravel(), drive=d.name) for k, d in enumerate(drives)
    ]  # fmt: skip
    return MODES.table(columns)


def _modes(
    question: ForceQuestion, poses: Poses, values: list[Floats], near: Mapping[str, Value]
) -> tuple[Floats, Floats]:  # fmt: skip
    """Squares of circular frequencies, shape (poses, n), and shapes (poses, n drives, n modes).

    Small motion about a pose that constant efforts hold: M q'' + K q = 0, K the derivative of these efforts by the
    drives. Lengths count in sizes of the mechanism. With S^2 = M^-1 the squares are the eigenvalues of S K S, the
    shapes S times its vectors. They are nan at singularities, and where there is no inertia along some motion; squares
    that rounding of K makes are zero. `near` has angles in their turns.
    """
    mechanism, count = question.study.mechanism, len(values)
    sizes = np.array([mechanism.size if mechanism.quantity(name) == "length" else 1.0 for name in mechanism.drives])

    def efforts(given: list[Floats], accelerated: bool) -> tuple[Floats, Linearization]:
        """Efforts at rest, shape (n, poses), or with each unit acceleration (n, n + 1, poses)."""
        solved = mechanism.forward.solve(given, limits=False)
        linear = mechanism.linearize(replace(solved, near={**solved.near, **near}))
        still = linear.velocity([0.0] * count)
        units = [*np.eye(count + 1)[1:, :, None]] if accelerated else [0.0] * count
        moving = Moving(still, linear.acceleration(still, units))
        forces, _ = question.acting(poses, linear.configuration, moving)
        shape = (count + 1, poses.count) if accelerated else (poses.count,)
        return np.array([np.broadcast_to(effort, shape) for effort in balance(linear, forces).efforts]), linear

    table, linear = efforts(values, accelerated=True)
    mass = np.moveaxis(table[:, 1:] - table[:, :1], -1, 0) * sizes[:, None] * sizes
    stiffness = np.zeros((poses.count, count, count))
    for j in range(count):
        for place, weight in STENCIL.items():
            moved = [value + place * STEP * sizes[j] * (k == j) for k, value in enumerate(values)]
            stiffness[:, :, j] += weight / STEP * sizes * efforts(moved, accelerated=False)[0].T
    good = np.isfinite(mass).all(axis=(1, 2)) & np.isfinite(stiffness).all(axis=(1, 2))
    good &= np.asarray(regularity(linear)) >= STALLED
    inertias, axes = np.linalg.eigh(np.where(good[:, None, None], mass + np.swapaxes(mass, 1, 2), np.eye(count)) / 2)
    good &= inertias[:, 0] > NO_INERTIA * inertias[:, -1]
    squares, shapes = np.full((poses.count, count), np.nan), np.full((poses.count, count, count), np.nan)
    if good.any():
        root = axes[good] / np.sqrt(inertias[good])[:, None, :] @ np.swapaxes(axes[good], 1, 2)
        largest = question.size * mechanism.size + np.abs(table[:, 0, good] * sizes[:, None]).max(axis=0)
        rounding = ROUNDING * np.maximum(largest, np.abs(stiffness[good]).max(axis=(1, 2)))
        skew = (stiffness[good] - np.swapaxes(stiffness[good], 1, 2)) / 2
        even = stiffness[good] - np.where(np.abs(skew) <= rounding[:, None, None], skew, 0.0)
        roots, vectors = np.linalg.eig(root @ even @ root)
        order = np.argsort(roots.real, axis=-1)
        roots = np.take_along_axis(roots, order, axis=-1)
        vectors = root @ np.take_along_axis(vectors, order[:, None, :], axis=-1)
        # A mode of the mass 1 moves by its vector, and so rounding changes its square by that of K times the vector's.
        rounding = rounding[:, None] * np.sum(np.abs(vectors) ** 2, axis=1)
        roots = np.where(np.abs(roots.imag) <= rounding, roots.real, np.nan)
        squares[good] = np.where(np.abs(roots) <= rounding, 0.0, roots)
        largest = np.take_along_axis(vectors.real, np.abs(vectors.real).argmax(axis=1)[:, None, :], axis=1)
        shapes[good] = vectors.real / largest
    return squares, shapes
