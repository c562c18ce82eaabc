"""Warnings as values: a kind, a sentence, and the table, row and pose concerned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class WarningKind:
    """A kind of warning: its meaning, and the page of the documentation that explains it, without ``.md``."""

    meaning: str
    page: str


KINDS = {
    "unassembled": WarningKind(
        "poses, samples or designs that cannot be assembled, or that a limit of motion forbids", "theory/limits"
    ),
    "singular": WarningKind(
        "the mechanism is at, near or passes a singularity, dead centre or change point, where rates and forces lose "
        "digits or have no bound; nothing is wrong with a dead centre where the output shall turn back",
        "theory/kinematics",
    ),
    "jammed": WarningKind("poses that friction lets no effort of the drives move on", "howto/friction"),
    "self_locking": WarningKind(
        "poses in which friction holds what the loads would move, as it shall in a screw, a wedge or a clamp",
        "howto/friction",
    ),
    "cam": WarningKind(
        "a cam that is undercut, does not close or has a large pressure angle, or whose follower lifts off",
        "howto/gears_and_cams",
    ),
    "collision": WarningKind("plates that overlap along the motion", "howto/export"),
    "disagree": WarningKind(
        "methods of reliability that disagree; trust those that count samples (monte_carlo, auto)", "theory/reliability"
    ),
    "unconverged": WarningKind(
        "a number is known less exactly than asked, or a search or simulation ended too early; more samples, rays or "
        "evaluations help, or a wider tolerance",
        "theory/limits",
    ),
    "undefined": WarningKind("numbers that have no value where they are asked", "theory/conventions"),
    "incomplete": WarningKind("a part of what was asked is left out", "theory/limits"),
    "infeasible": WarningKind("designs or cases that do not meet what is required of them", "theory/optimize"),
    "ignored": WarningKind("the study gives what has no effect", "reference/study/index"),
    "assumed": WarningKind(
        "the study can be understood in several ways, and this one was taken", "reference/study/index"
    ),
    "suspect": WarningKind("what is asked is likely a mistake", "reference/study/index"),
    "allocated": WarningKind("what an allocation of tolerances has chosen", "theory/reliability"),
    "stale": WarningKind("results of a question that the study no longer asks stand beside the others", "howto/batch"),
    "undrawn": WarningKind("pictures that could not be drawn", "howto/report"),
}
ALL = "all"  # in place of the kinds: each of them


@dataclass(frozen=True)
class Caution:
    """A warning of a result; ``str(warning)`` is its sentence.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   links: {ground: {O: [0, 0]}, arm: [O, P, 100]}
    ...   drives: [arm]
    ...   limits: [{drive: arm, min: 0, max: 45}]
    ... kinematics: {sweep: {arm: {from: 0, to: 60, step: 30}}}
    ... ''')
    >>> [(w.row, w.pose) for w in mechdesign.kinematics(study).warnings if w.kind == "unassembled"]
    [(2, 'arm = 60 deg')]
    """

    kind: str  #: one of `KINDS`
    message: str  #: the sentence
    table: str = ""  #: name of the table concerned; empty if the warning concerns the whole result
    row: int | None = None  #: first row concerned, from 0
    pose: str = ""  #: first pose or case concerned, in words

    def __str__(self) -> str:
        return self.message

    def as_data(self) -> dict[str, str | int]:
        """Plain data for a manifest; empty fields are left out."""
        return {name: value for name, value in asdict(self).items() if value not in ("", None)}


def fails(warning: Caution, kinds: Sequence[str]) -> bool:
    """Whether a warning is of one of these kinds, as `fail_on` lists them."""
    return ALL in kinds or warning.kind in kinds
