"""`load` and the questions, as Python and notebooks ask them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

from mechdesign import study as studies
from mechdesign.commands import COMMANDS
from mechdesign.door.shown import Answer, ShownStudy
from mechdesign.errors import Interrupted
from mechdesign.journal import Journal
from mechdesign.parallel import one_thread
from mechdesign.progress import NULL, Progress
from mechdesign.study import Study


def load(
    source: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    seed: int | None = None,
    *,
    text: str | bytes | None = None,
) -> ShownStudy:
    """Load a study from a file, a mapping or a text in YAML.

    Parameters
    ----------
    source : path or mapping
        The study file, or the study as plain data; NumPy's numbers and arrays are taken as numbers and lists.
    overrides : sequence of str, or mapping
        ``"a.b.c=value"``, or values by their dotted names; applied in their order, before the study is checked.
    seed : int, optional
        In place of the study's own.
    text : str or bytes
        The study in YAML, in place of `source`. Files that it names are looked for in the working directory, as are
        those of a mapping.

    Returns
    -------
    ShownStudy
        What it says, in its own units; in a notebook it shows its mechanism.

    Raises
    ------
    StudyError
        With every mistake found, each as ``file:line:column: key path: what, and what would mend it``.

    Examples
    --------
    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
    ...   drives: [crank]
    ...   sketch: {A: [0, 30], B: [75, 55]}
    ... ''')
    >>> study.mechanism.mobility
    1
    """
    return ShownStudy.of(studies.load(source, overrides, seed, text=text))


def kinematics(
    study: Study,
    *,
    seed: int | None = None,
    jobs: int | None = 1,
    progress: Progress = NULL,
    all_modes: bool = False,
) -> Answer:
    """How does it move? Positions, velocities, accelerations, the Jacobian and the limits of motion.

    Parameters
    ----------
    study : Study
        Its poses are those of the section ``kinematics``; without one, a turn of its drive.
    seed : ignored
        Nothing is random.
    jobs : int or None
        Threads that solve a long sweep; None uses every processor. The result does not depend on them.
    progress : Progress
        Is told how far the computation is.
    all_modes : bool
        Whether to follow every other assembly of the same links as well.

    Returns
    -------
    Answer
        Tables ``motion`` (a row a pose) and ``extremes``; for a sweep of one coordinate ``limits``; ``loops`` and
        ``toggles`` of four-bars and slider-cranks; ``targets`` where there are some; ``jacobian`` where as many outputs
        as drives are asked; ``modes`` with `all_modes`. Lengths, angles and times are in the study's units, Jacobians
        per radian. A pose that cannot be assembled is a row of nan with ``valid`` False.

    Raises
    ------
    AssemblyError
        If no pose at all can be assembled.
    StudyError
        If all modes are asked of poses that give different coordinates.

    Examples
    --------
    The crank-rocker with ground 100, crank 30, rod 90 and rocker 60 mm: its rocker swings between the angles at which
    crank and rod lie in one line, by the law of cosines [Norton, Design of Machinery, ch. 2].

    >>> import math, mechdesign
    >>> from mechdesign.study import template_path
    >>> swing = mechdesign.kinematics(mechdesign.load(template_path("four_bar"))).tables["extremes"]
    >>> row = swing.where(quantity="rocker.angle")
    >>> print(f"{swing['max'][row][0] - swing['min'][row][0]:.6f}")
    91.145976
    """
    return _ask("kinematics", study, seed, jobs=jobs, progress=progress, all_modes=all_modes)


def workspace(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    return _ask("workspace", study, seed, jobs=jobs, progress=progress)


def optimize(
    study: Study,
    *,
    seed: int | None = None,
    jobs: int | None = 1,
    progress: Progress = NULL,
    journal: Journal | None = None,
) -> Answer:
    return _ask("optimize", study, seed, jobs=jobs, progress=progress, journal=journal)


def reliability(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    return _ask("reliability", study, seed, jobs=jobs, progress=progress)


def stiffness(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    return _ask("stiffness", study, seed, jobs=jobs, progress=progress)


def _ask(command: str, study: Study, seed: int | None, *, all_modes: bool = False, **options: Any) -> Answer:
    """A command's answer, with the same digits whatever the threads of linear algebra; knows its study."""
    answer = getattr(import_module(COMMANDS[command].module), command)
    if all_modes:
        options["all_modes"] = True
    try:
        with one_thread():
            result = answer(study, seed=seed, **options)
    except Interrupted as interrupt:
        raise Interrupted(Answer.of(study, interrupt.result, seed, all_modes=all_modes)) from None
    return Answer.of(study, result, seed, all_modes=all_modes)
