"""Questions about many cases or designs of a study, as Python and notebooks ask them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from mechdesign.door.api.questions import ask
from mechdesign.door.api.shown import Answer
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Table
from mechdesign.ground.work.journal import Journal
from mechdesign.study import Study


def sweep(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL,
    journal: Journal | None = None,
) -> Answer:  # fmt: skip
    """Which cases meet what is required? A row a case of the matrix, each answered as a study of its own.

    Parameters
    ----------
    study : Study
        With a section ``matrix``: which entries vary, and how.
    seed, jobs, progress, journal : optional
        See `mechdesign`; cases that are drawn are random, and so is what is random in each.

    Returns
    -------
    Answer
        Table ``sweep``: the values that vary, each requirement's value and whether it is met, the results that the
        matrix names, why a case failed, and where the matrix says what is ``best`` the rank of each case and whether it
        is on the Pareto front. A case that cannot be loaded or answered is a row of nan with its reason;
        ``failed`` counts those.

    Raises
    ------
    StudyError
        If there is no matrix, nothing is required and no result named, or a name is unknown; nothing was computed.
    Interrupted
        On Ctrl-C; its ``result`` has the cases that were finished.

    Examples
    --------
    The stroke of a slider-crank is twice its crank, whatever its rod.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   parameters: {r: 30, l: 100}
    ...   links: {ground: {O: [0, 0]}, crank: [O, A, r], rod: [A, B, l], slider: {B: [0, 0]}}
    ...   joints: {guide: {prismatic: [ground, slider], through: O}}
    ...   drives: [crank]
    ...   sketch: {A: [0, 30], B: [95, 0]}
    ... matrix: {vary: {mechanism.parameters.r: [30, 45]}, results: [kinematics.extremes.B.x.range]}
    ... ''')
    >>> mechdesign.sweep(study).main["kinematics.extremes.B.x.range"].round(6)
    array([60., 90.])
    """
    return ask("sweep", study, seed, jobs=jobs, progress=progress, journal=journal)


def sensitivities(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Answer:
    """What does each number change? Derivatives of results with respect to numbers of the study.

    Parameters
    ----------
    study : Study
        With a section ``sensitivities``: results, and the numbers that change.
    seed, jobs, progress : optional
        See `mechdesign`; what is random is the same in every case.

    Returns
    -------
    Answer
        Table ``sensitivities``: a row a result and number, with derivative, error estimate, unit and elasticity. At a
        kink the derivative is nan, and the slopes on both sides are given.

    Raises
    ------
    StudyError
        If there is no such section, a name is unknown, or what is to change is no number; nothing was computed.

    Examples
    --------
    The stroke of a slider-crank is twice its crank, whatever its rod.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   parameters: {r: 30, l: 100}
    ...   links: {ground: {O: [0, 0]}, crank: [O, A, r], rod: [A, B, l], slider: {B: [0, 0]}}
    ...   joints: {guide: {prismatic: [ground, slider], through: O}}
    ...   drives: [crank]
    ...   sketch: {A: [0, 30], B: [95, 0]}
    ... sensitivities: {results: [kinematics.extremes.B.x.range], parameters: [r, l]}
    ... ''')
    >>> mechdesign.sensitivities(study).main["derivative"].round(6) + 0.0
    array([2., 0.])
    """
    return ask("sensitivities", study, seed, jobs=jobs, progress=progress)


def evaluate(
    study: Study, values: Mapping[str, Sequence[Any] | NDArray[Any]], results: Sequence[str | Mapping[str, Any]]
) -> Table:  # fmt: skip
    """What are results of other designs? Those of many at once, for an optimiser or a fit of your own.

    What the values have in common is compiled once and kept for the next call: later calls with the same study, entries
    and results begin at once. Many designs in one call cost far less each than one in a call.

    Parameters
    ----------
    study : Study
        Whose other entries all designs share.
    values : mapping of str to array, shape (designs,)
        Values by the names of entries, as ``--set`` takes them: numbers in the study's units, quantities or words.
    results : sequence of str
        Results by their names, as requirements take them, such as ``kinematics.extremes.C.x.range`` or
        ``dynamics.crank_effort.peak``; or mappings of ``result`` and ``where`` it counts. Of several rows a statistic
        makes one number.

    Returns
    -------
    Table
        A row a design, a column a result with its unit, then ``valid`` and ``reason``. A design that cannot be built or
        assembled, or that misses a part of its motion, has ``valid`` False and its reason, and nan where it has no
        number; its other numbers are those of the part that there is.

    Raises
    ------
    StudyError
        If an entry or a result does not exist, or an array is not as long as the others; each by its name. Values that
        make no study make a design that is not valid.

    Examples
    --------
    The stroke of a slider-crank is twice its crank; a crank longer than its rod does not turn.

    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   parameters: {r: 30, l: 100}
    ...   links: {ground: {O: [0, 0]}, crank: [O, A, r], rod: [A, B, l], slider: {B: [0, 0]}}
    ...   joints: {guide: {prismatic: [ground, slider], through: O}}
    ...   drives: [crank]
    ...   sketch: {A: [0, 30], B: [95, 0]}
    ... ''')
    >>> stroke = "kinematics.extremes.B.x.range"
    >>> table = mechdesign.evaluate(study, {"mechanism.parameters.r": [30, 45, 120]}, [stroke])
    >>> table[stroke][:2].round(6), table.column(stroke).unit, table["valid"], table["reason"][2]
    (array([60., 90.]), 'mm', array([ True,  True, False]), 'a pose cannot be assembled')
    """
    from mechdesign.family.evaluate import evaluate as evaluated

    return evaluated(study, values, results)
