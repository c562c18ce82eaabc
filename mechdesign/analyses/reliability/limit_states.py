"""The limits of a mechanism's errors at one pose, over independent normal variables and directions of contact."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.reliability.engine.problem import Problem
from mechdesign.analyses.reliability.first_order import derivatives
from mechdesign.analyses.reliability.question import Question
from mechdesign.analyses.reliability.simulation import Setting, errors_of, solve
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.errors import MechanismError
from mechdesign.numerics.arrays import Floats

# Step of the difference quotients of the made mechanisms, which are known to rounding, in standard deviations.
_STEP = 1e-5


def problem_of(setting: Setting, sources: Sources) -> Problem:
    """Where the mechanism breaks a limit: margins are nan where it cannot be assembled.

    What has no closed derivative is differenced.
    """
    setting = setting.narrowed()
    question = setting.question

    def margins(u: Floats) -> Floats:
        errors, valid = errors_of(setting, sources.made(sources.at(u, directed=True)), u.shape[1])
        found = np.stack([margin for margin, _ in _margins(question, errors)])
        found[:, ~valid] = np.nan
        return found

    def gradients(u: Floats) -> tuple[Floats, Floats]:
        made = sources.made(sources.at(u, directed=True))
        errors, valid = errors_of(setting, made, u.shape[1])
        names, slopes = _slopes(sources, u)
        by_name = derivatives(
            setting.mechanism, solve(setting, made), question.channels, names, setting.rates, setting.elastic
        )
        by_variable = np.einsum("cnp,ndp->cdp", by_name, slopes)
        found, steep = [], []
        for margin, weights in _margins(question, errors):
            found.append(margin)
            steep.append(sum((weight * by_variable[channel] for channel, weight in weights), np.zeros(u.shape)))
        values, rates = np.stack(found), np.stack(steep)
        values[:, ~valid] = np.nan
        return values, rates

    try:
        gradients(np.zeros((len(sources.owners), 1)))
    except MechanismError:
        return Problem(len(sources.owners), margins, circles=sources.circles)
    return Problem(len(sources.owners), margins, gradients, sources.circles)


def _margins(question: Question, errors: Floats) -> list[tuple[Floats, list[tuple[int, Floats | float]]]]:
    """Margin of each limit, and its derivative by the channels that it depends on."""
    found: list[tuple[Floats, list[tuple[int, Floats | float]]]] = []
    for band in question.bands:
        if np.isfinite(band.high):
            found.append((band.high - errors[band.output], [(band.output, -1.0)]))
        if np.isfinite(band.low):
            found.append((errors[band.output] - band.low, [(band.output, 1.0)]))
    for disc in question.discs:
        x, y = errors[disc.x], errors[disc.y]
        size = np.hypot(x, y)
        with np.errstate(invalid="ignore", divide="ignore"):
            found.append((disc.radius - size, [(disc.x, -x / size), (disc.y, -y / size)]))
    return found


def _slopes(sources: Sources, u: Floats) -> tuple[list[str], Floats]:
    """Places, drives and loads that vary, and their derivatives by the variables, shape (names, dimension, n)."""
    d, n = u.shape
    steps = _STEP * np.eye(d)[:, :, None]
    either = np.concatenate([(u + way * steps).swapaxes(0, 1).reshape(d, d * n) for way in (1, -1)], axis=1)
    made = sources.made(sources.at(either, directed=True))
    values = {**made.places, **made.drives, **made.loads}
    slopes = np.empty((len(values), d, n))
    for row, value in zip(slopes, values.values(), strict=True):
        ahead, back = np.broadcast_to(value, (2 * d * n,)).reshape(2, d, n)
        row[...] = (ahead - back) / (2 * _STEP)
    return list(values), slopes
