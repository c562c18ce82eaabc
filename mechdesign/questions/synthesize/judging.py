"""What linkages do on their way through a task: defects, transmission angle, error, class."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.derivatives import regularity
from mechdesign.questions.synthesize.columns import DEFECTS
from mechdesign.questions.synthesize.kinds import Kind

# Poses on the way through the task; where a linkage comes nearest to a dead centre, so many more between two of them.
POSES, FINER, FEW = 181, 17, 24
# Linkages that are followed at once: their poses stay in the processor's cache.
_AT_ONCE = 100
_TURN = 2 * np.pi
# Cosine of the turn of a link between two poses, from which on it is swift.
_SLOW = 0.97
# Sines that differ by less than this part are the same.
_SAME = 1e-9
# Below this sine of the transmission angle a linkage is at a dead centre, which the finest poses miss by less.
_DEAD = 1e-5


@dataclass(frozen=True, eq=False)
class TaskMotion:
    """How linkages of a kind pass the positions of a task; each array has a first axis (count,)."""

    kind: Kind
    modes: tuple[int, ...]
    values: Floats
    angles: Floats  # drive at the positions, on its way: rising or falling
    elsewhere: Flags  # which positions need another assembly, shape (count, positions)
    circuit: Flags  # a dead centre lies between two positions
    order: Flags  # the drive cannot pass the positions in their order
    transmission: Floats  # smallest transmission angle on the way, radians
    full_turn: Flags

    def __len__(self) -> int:
        return len(self.values)

    @cached_property
    def defects(self) -> list[str]:
        """Defects in words, empty where there are none."""
        flags = np.stack([self.elsewhere.any(axis=1), self.circuit, self.order], axis=1)
        return [", ".join(name for name, flag in zip(DEFECTS, row, strict=True) if flag) for row in flags.tolist()]


def in_order(angles: Floats) -> tuple[Floats, Flags]:
    """Values of a drive that turns, unwound so that they rise or fall; and whether they do neither within a turn."""
    steps = np.diff(angles, axis=1)
    forward, back = np.mod(steps, _TURN), -np.mod(-steps, _TURN)
    up, down = forward.sum(axis=1), -back.sum(axis=1)
    nearest = np.where(np.abs(forward) <= np.abs(back), forward, back)
    limit = _TURN * (1 + 1e-9)
    chosen = np.where((up <= limit) & (up <= down), 1, np.where(down <= limit, -1, np.where(up <= limit, 1, 0)))
    steps = np.where(chosen[:, None] == 1, forward, np.where(chosen[:, None] == -1, back, nearest))
    return np.concatenate([angles[:, :1], angles[:, :1] + np.cumsum(steps, axis=1)], axis=1), chosen == 0


def sines(kind: Kind, poses: Configuration) -> Floats:
    """Sine of the smallest transmission angle in each pose; 0 where a linkage cannot be assembled."""
    least = np.broadcast_to(regularity(kind.mechanism.linearize(poses)), poses.shape)
    return np.where(poses.valid, least, 0.0)


def along(kind: Kind, modes: tuple[int, ...], values: Floats, begin: Floats, end: Floats) -> tuple[Flags, Floats]:
    """Whether a dead centre lies on the way of the drive, and the smallest transmission angle there (radians)."""
    dead, worst = np.zeros(len(values), dtype=bool), np.zeros(len(values))
    for first in range(0, len(values), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        dead[some], worst[some] = _along(kind, modes, values[some], begin[some], end[some])
    return dead, worst


def _along(kind: Kind, modes: tuple[int, ...], values: Floats, begin: Floats, end: Floats) -> tuple[Flags, Floats]:
    parts = np.linspace(0, 1, POSES)
    poses = kind.solve(values, begin[:, None] + parts * (end - begin)[:, None], modes)
    sine = sines(kind, poses)
    worst, dead = sine.min(axis=1), np.asarray(~poses.valid.all(axis=1))
    # Between poses it is lowest beside the lowest of them, or where a link turns swiftly, as beside a pivot. Where it
    # stays the same, as between two slides, there is nothing to look for.
    around = np.pad(sine, ((0, 0), (1, 1)), constant_values=np.inf)
    left, right = around[:, :-2], around[:, 2:]
    lowest = (sine <= left) & (sine <= right) & (np.maximum(left, right) > sine * (1 + _SAME))
    swift = np.zeros((len(values), POSES - 1), dtype=bool)
    for rotation in poses.rotations:
        turned = np.broadcast_to(rotation, poses.shape)
        swift |= (np.conj(turned[:, :-1]) * turned[:, 1:]).real < _SLOW
    lane, pose = np.nonzero(lowest & ~dead[:, None])
    hasty, before = np.nonzero(swift & ~dead[:, None])
    lane = np.concatenate([lane, hasty])
    low = parts[np.concatenate([np.maximum(pose - 1, 0), before])]
    high = parts[np.concatenate([np.minimum(pose + 1, POSES - 1), before + 1])]
    for _ in range(5):
        if not len(lane):
            break
        fine = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, FINER)
        own = kind.solve(values[lane], begin[lane, None] + fine * (end - begin)[lane, None], modes)
        sine = sines(kind, own)
        np.minimum.at(worst, lane, sine.min(axis=1))
        np.logical_or.at(dead, lane, ~own.valid.all(axis=1))
        at, rows = np.clip(sine.argmin(axis=1), 1, FINER - 2), np.arange(len(lane))
        low, high = fine[rows, at - 1], fine[rows, at + 1]
    dead |= worst < _DEAD
    worst = np.where(dead, 0.0, worst)
    return dead, np.arcsin(np.clip(worst, 0, 1))


def passed(
    kind: Kind, modes: tuple[int, ...], values: Floats, angles: Floats, elsewhere: Flags, *, full_turn: bool
) -> TaskMotion:
    """The way of linkages through a task in an assembly; `elsewhere` tells which positions need another one."""
    unwound, disorder = in_order(angles)
    if not kind.turns:
        steps = np.sign(np.diff(angles, axis=1))
        unwound, disorder = angles, np.abs(steps.sum(axis=1)) < steps.shape[1]
    begin, end = unwound.min(axis=1), unwound.max(axis=1)
    whole_dead, whole_worst = np.ones(len(values), dtype=bool), np.zeros(len(values))
    if kind.turns:
        # Few poses tell of most that their drives cannot turn fully.
        few = begin[:, None] + np.linspace(0, _TURN, FEW)
        turns = np.flatnonzero(kind.solve(values, few, modes).valid.all(axis=1))
        whole_dead[turns], whole_worst[turns] = along(kind, modes, values[turns], begin[turns], begin[turns] + _TURN)
    rest = np.flatnonzero(whole_dead)
    dead, worst = whole_dead.copy(), whole_worst.copy()
    if not full_turn and len(rest):
        dead[rest], worst[rest] = along(kind, modes, values[rest], begin[rest], end[rest])
    return TaskMotion(kind, modes, values, unwound, elsewhere, dead, disorder, worst, ~whole_dead)
