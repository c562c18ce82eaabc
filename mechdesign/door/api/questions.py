"""The questions, as Python and notebooks ask them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

from mechdesign.commands import COMMANDS, QUESTIONS
from mechdesign.door.api.shown import Answer
from mechdesign.ground.errors import Interrupted
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.work.chunks import spread
from mechdesign.ground.work.journal import Journal
from mechdesign.study import Study


def kinematics(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL, all_modes: bool = False
) -> Answer:
    """How does it move? Positions, velocities, accelerations, the Jacobian and the limits of motion.

    Parameters
    ----------
    study : Study
        Its poses are those of the section ``kinematics``; without one, a turn of its drive.
    seed, jobs, progress : optional
        See `mechdesign`; nothing is random.
    all_modes : bool
        Whether to follow every other assembly of the same links as well.

    Returns
    -------
    Answer
        Tables ``motion`` (a row a pose) and ``extremes``; for a sweep of one coordinate ``limits``; ``loops`` and
        ``toggles`` of four-bars and slider-cranks; ``targets`` where there are some; ``jacobian`` where as many outputs
        as drives are asked; ``modes`` with `all_modes`. Lengths, angles and times are in the study's units, Jacobians
        per radian. A pose that cannot be assembled is a row of nan with ``valid`` False. Of more than 65,536
        poses the tables with a row a pose are in memory only once the values of a column are asked for; ``blocks()``
        gives their rows in parts.

    Raises
    ------
    AssemblyError
        If no pose at all can be assembled.
    MechanismError
        If a pose's coordinates do not determine the mechanism, or an output does not exist.
    StudyError
        If all modes are asked of poses that give different coordinates.

    Examples
    --------
    The crank-rocker with ground 100, crank 30, rod 90 and rocker 60 mm: its rocker swings between the angles at which
    crank and rod lie in one line, by the law of cosines.

    >>> import math, mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
    ...   drives: [crank]
    ...   sketch: {A: [0, 30], B: [75, 55]}
    ... kinematics: {outputs: [rocker.angle]}
    ... ''')
    >>> swing = mechdesign.kinematics(study).tables["extremes"]["range"]  # deg
    >>> ends = [math.acos((100**2 + 60**2 - (90 + side * 30) ** 2) / (2 * 100 * 60)) for side in (1, -1)]
    >>> print(f"{swing[0]:.6f} {math.degrees(ends[0] - ends[1]):.6f}")
    60.265244 60.265244
    """
    return ask("kinematics", study, seed, jobs=jobs, progress=progress, all_modes=all_modes)


def workspace(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    """Where can it work? The region that a point reaches, its performance indices and its boundary [S1].

    Parameters
    ----------
    study : Study
        With a section ``workspace`` that names the point.
    seed, jobs, progress : optional
        See `mechdesign`; nothing is random, and one region takes one thread.

    Returns
    -------
    Answer
        Of two degrees of freedom tables ``indices`` (a row a region: area, GII, GRI, SUI, each with an error estimate),
        ``local`` (a row a node of a grid), ``boundary`` and ``singularities`` (a row a point of a curve); of one
        degree of freedom ``indices`` of the point's path, and ``path``. Areas are in the study's unit of length
        squared, indices of the Jacobian per radian.

    Raises
    ------
    StudyError
        If the section lacks what cannot be assumed, or over a range the inverse problem has no closed form.
    AssemblyError
        If no point of the scan can be reached, or the region has no end.

    Examples
    --------
    The tip of an arm with links of 200 and 100 mm reaches the ring between 100 and 300 mm.

    >>> import math, mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   links: {ground: {O: [0, 0]}, upper: [O, E, 200], fore: [E, P, 100]}
    ...   drives: [upper, fore]
    ...   sketch: {E: [200, 0], P: [200, 100]}
    ... workspace: {point: P, scan: {about: [0, 0], rays: 12}, integrate: {rule: midpoint, nodes: 9}}
    ... ''')
    >>> area = mechdesign.workspace(study).main["area"]  # mm^2
    >>> print(f"{area[0]:.3f} {math.pi * (300**2 - 100**2):.3f}")
    251327.412 251327.412
    """
    return ask("workspace", study, seed, jobs=jobs, progress=progress)


def optimize(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL,
    journal: Journal | None = None,
) -> Answer:  # fmt: skip
    """Which dimensions are best? The optimum for each set of weights, and every design [S1, eqs. 27, 28].

    Parameters
    ----------
    study : Study
        With a section ``optimize``: variables, and what is to be largest or smallest.
    seed, jobs, progress, journal : optional
        See `mechdesign`; a search or a front is random, a grid is not.

    Returns
    -------
    Answer
        Tables ``optimum`` (a row a set of weights), ``designs`` (a row a design), ``bounds`` at which an optimum lies,
        ``best`` distinct designs and the ``sensitivity`` of the score; ``pareto`` of a front. Variables are in the
        study's units, goals in those of the columns they are. `files` has each optimum as a study.

    Raises
    ------
    StudyError
        If there is nothing to vary or to compare.
    AssemblyError
        If no design is feasible; the message says why, what most designs fail by first.
    Interrupted
        On Ctrl-C; its ``result`` has the designs that are finished.

    Examples
    --------
    A four-bar's smallest transmission angle comes where its crank lies along the ground link. By the law of cosines
    of rod, rocker and the line between the outer pins the shortest crank transmits best, with 60.61 deg.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   parameters: {a: 30}
    ...   links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rod: [A, B, 90], rocker: [D, B, 60]}
    ...   drives: [crank]
    ...   sketch: {A: [0, 30], B: [75, 55]}
    ...   measures: {mu: {angle: [rod, rocker]}}
    ... kinematics: {sweep: {crank: {from: 0, to: 360, step: 30}}, outputs: [mu]}
    ... optimize: {variables: {a: {from: 20, to: 30, step: 5}}, maximize: kinematics.mu}
    ... ''')
    >>> best = mechdesign.optimize(study).main
    >>> print(f"{best['a'][0]:g} mm, {best['kinematics.mu'][0]:.2f} deg")
    20 mm, 60.61 deg
    """
    return ask("optimize", study, seed, jobs=jobs, progress=progress, journal=journal)


def reliability(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    """How precise is it when it is made? Errors of outputs from tolerances and clearances [S2, S3].

    Parameters
    ----------
    study : Study
        With a section ``reliability``: what varies, and the limits of errors.
    seed, jobs, progress : optional
        See `mechdesign`; samples are random.

    Returns
    -------
    Answer
        Tables ``moments`` (a row a pose, method and output), ``contributions`` (a row a source), and where there are
        limits ``reliability`` and ``capability``; of methods that sample ``density`` (of two outputs), ``histogram``,
        ``convergence`` and ``estimate``; where tolerances are allocated ``allocation`` and ``confirmation``, and in
        `files` the study ``allocated.yaml``. Errors are in the study's units, as each row's ``unit`` says;
        probabilities from 0 to 1.

    Raises
    ------
    StudyError
        If nothing varies.
    AssemblyError
        If no pose at all can be assembled.
    Interrupted
        On Ctrl-C; its ``result`` has what was found so far.

    Examples
    --------
    An arm of 100 +- 0.3 mm has a tip with sigma = 0.3/3 mm along it, and keeps +- 1 sigma with 68.27 %.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... reliability:
    ...   {dimensions: {arm.length: 0.3}, poses: [{arm: 0}], outputs: [P], limits: {P.x: 0.1}, methods: [analytic]}
    ... ''')
    >>> result = mechdesign.reliability(study)
    >>> print(f"{result.tables['moments']['sigma'][0]:.4f}, {result.tables['reliability']['reliability'][0]:.4f}")
    0.1000, 0.6827
    """
    return ask("reliability", study, seed, jobs=jobs, progress=progress)


def stiffness(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    """How stiff is it? Stiffness and compliance of a body or a pin, equivalent springs and deflections [S4].

    Parameters
    ----------
    study : Study
        With a section ``stiffness``: where, and what is elastic.
    seed, jobs, progress : optional
        See `mechdesign`; nothing is random.

    Returns
    -------
    Answer
        Tables ``stiffness``, ``compliance`` and ``springs`` (a row a pose, or a spring); with loads ``deflections``,
        ``forces`` and ``displacements``; axes of the world, the study's units, angles in radians.

    Raises
    ------
    StudyError
        If the study has no such section.
    AssemblyError
        If no pose at all can be assembled.

    Examples
    --------
    A rigid arm of 100 mm on a motor of k = 1e6 N mm/rad gives k/100^2 = 100 N/mm across it.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}
    ... stiffness: {at: P, actuators: {arm: 1e6 N*mm/rad}, poses: [{arm: 0}]}
    ... ''')
    >>> print(f"{mechdesign.stiffness(study).main['k_y'][0]:.6f}")
    100.000000
    """
    return ask("stiffness", study, seed, jobs=jobs, progress=progress)


def dynamics(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    """What drives it, what does it bear? Drive efforts, joint forces, shaking forces and energies of a motion.

    Parameters
    ----------
    study : Study
        Its section ``dynamics`` has gravity, loads, and a motion unless kinematics has one; without it there are none,
        and what acts are inertia and springs.
    seed, jobs, progress : optional
        See `mechdesign`; nothing is random.

    Returns
    -------
    Answer
        Tables ``dynamics`` (a row a pose), ``joint_forces`` (a row a pose and joint) and ``extremes``; of a motion in
        time ``forward`` (a row an instant) and ``events`` before them; where they are asked ``flywheel`` and ``modes``.
        Axes of the world, the study's units.

    Raises
    ------
    StudyError
        If without such a section nothing acts on the mechanism.
    AssemblyError
        If no pose at all can be assembled, or the start of a motion in time cannot.
    MechanismError
        If a mechanism that shall move by its efforts has no inertia.

    Examples
    --------
    A level arm of 2 kg with its centre at 50 mm needs 2 kg * 9.81 m/s^2 * 50 mm = 981 N mm.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism: {links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: 100, mass: 2 kg}}, drives: [arm]}
    ... dynamics: {gravity: [0, -9.81 m/s^2], poses: [{arm: 0}]}
    ... ''')
    >>> result = mechdesign.dynamics(study)
    >>> print(f"{result.main['arm_effort'][0]:.3f}, {result.tables['joint_forces']['fy'][0]:.3f}")
    981.000, 19.620
    """
    return ask("dynamics", study, seed, jobs=jobs, progress=progress)


def synthesize(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    """Which linkages do it? From positions of a body, a function or a path to linkages, each a study.

    Parameters
    ----------
    study : Study
        With a section ``synthesis``; it needs no mechanism.
    seed, jobs, progress : optional
        See `mechdesign`; random are the samples of a path, and free choices of a body. One task takes one process.

    Returns
    -------
    Answer
        Table ``solutions``, a row a linkage, best first, with errors, defects, transmission angles, where they are
        judged yields and peak efforts, and dimensions by their names in the linkage's study, nan where it has none;
        all in the study's units. `files` has that study of each, whose path goes through the task; `notes` say which
        is best, how complete the list is, what was dropped and why, and the seed.

    Raises
    ------
    StudyError
        If there is no task, or it contradicts itself, or its ``judge`` names what a linkage does not have.
    AssemblyError
        If no linkage keeps the conditions; its ``result`` has the nearest, in the table and as ``nearest.yaml``.

    Examples
    --------
    Freudenstein's four-bar for log10 between 1 and 2, exact at three points.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... synthesis:
    ...   function: {input: [94.0192379, 120, 145.9807621], output: [35.6125801, 65.09775, 87.0511671]}
    ...   frame: 100
    ... ''')
    >>> mechdesign.synthesize(study).main["crank.length"].round(1)
    array([71.3])
    """
    return ask("synthesize", study, seed, jobs=jobs, progress=progress)


def question(command: str) -> Callable[..., Answer]:
    """The function of a question that has none of its own above."""
    return partial(ask, command, seed=None, jobs=1)


def ask(command: str, study: Study, seed: int | None, *, all_modes: bool = False, **options: Any) -> Answer:
    """A command's answer, which knows its study."""
    if command in COMMANDS and command not in study.questions:
        study.need_mechanism(command)
    answer = getattr(import_module(QUESTIONS[command].module), command)
    if all_modes:
        options["all_modes"] = True
    try:
        with spread(options["jobs"]):
            result = answer(study, seed=seed, **options)
    except Interrupted as interrupt:
        raise Interrupted(Answer.of(study, interrupt.result, seed, all_modes=all_modes)) from None
    return Answer.of(study, result, seed, all_modes=all_modes)
