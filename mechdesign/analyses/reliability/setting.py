"""Made mechanisms at one pose: their errors, and where these break a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.kinematics.rates import DriveRates
from mechdesign.analyses.reliability.deflection import Elastic
from mechdesign.analyses.reliability.engine.problem import Problem, slopes
from mechdesign.analyses.reliability.first_order import derivatives, nominal_values
from mechdesign.analyses.reliability.question import Question
from mechdesign.analyses.reliability.sources import Made, Sources
from mechdesign.errors import MechanismError
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.plan import Plan
from mechdesign.numerics.arrays import Flags, Floats

# Step of the difference quotients of what varies, which is known to rounding, in standard deviations.
_STEP = 1e-5


@dataclass(frozen=True, eq=False)
class Setting:
    """One pose, at which made mechanisms are solved; the drives and their rates are held.

    Parameters
    ----------
    pose : int
        Row of the pose; names its streams.
    plan : Plan
        That of the drives, in the assembly of the pose.
    nominal : Configuration
        Solved pose of the nominal mechanism.
    centres : sequence of float
        Nominal values of the channels.
    elastic : Elastic or None
        Deflections at this pose.
    scale : two of (float, float) or None
        Means and standard deviations for the density of the pair; None where no density is wanted.
    followed : bool
        Whether to follow the means and the failures, and to keep the errors of the first chunks.
    """

    question: Question
    pose: int
    mechanism: Mechanism
    plan: Plan
    nominal: Configuration
    rates: DriveRates
    centres: Sequence[float]
    elastic: Elastic | None
    scale: tuple[tuple[float, float], tuple[float, float]] | None = None
    followed: bool = False

    def narrowed(self) -> Setting:
        """The same pose with the limited channels only: nothing else needs to be computed."""
        channels = self.question.limited_channels
        return replace(
            self, question=self.question.narrowed, centres=[self.centres[k] for k in channels], scale=None,
            elastic=None if self.elastic is None else self.elastic.only(channels),
        )  # fmt: skip


def forward_plan(mechanism: Mechanism, configuration: Configuration) -> Plan:
    """The drives' plan with the assembly modes of a single solved pose.

    A pose given by outputs is solved with the inverse problem's modes, and may lie in another assembly of the drives
    than the sketch. Groups are tried in order, each in both modes, since a group depends on those before it only.
    """
    forward = mechanism.forward
    drives = [configuration.value(mechanism.coordinate(name)) for name in mechanism.drives]
    modes = list(forward.modes)
    for index, group in enumerate(forward.structure.groups):
        errors = {}
        for mode in {forward.modes[index]: 0, -forward.modes[index]: 0}:
            modes[index] = mode
            found = Plan(mechanism, forward.structure, modes).solve(drives, start=configuration, limits=False)
            errors[mode] = sum(abs(found.rotations[k] - configuration.rotations[k]) for k in group.angles)
            errors[mode] += sum(abs(found.slides[k] - configuration.slides[k]) for k in group.slides)
        modes[index] = min(errors, key=lambda mode: np.nan_to_num(errors[mode], nan=np.inf))
    return forward if tuple(modes) == forward.modes else Plan(mechanism, forward.structure, modes)


def solve(setting: Setting, made: Made) -> Configuration:
    """Made mechanisms with the drives at the pose, and their errors; angles on the branch of the nominal pose."""
    mechanism, nominal = setting.mechanism, setting.nominal
    given: list[Value] = [
        nominal.value(mechanism.coordinate(name)) + made.drives.get(name, 0.0) for name in mechanism.drives
    ]
    solved = setting.plan.solve(given, made.places, start=nominal, limits=False)
    return solved.beside(nominal, [channel.coordinate for channel in setting.question.channels])


def errors_of(setting: Setting, made: Made, count: int) -> tuple[Floats, Flags]:
    """Errors (value minus nominal), shape (channels, count), and which of the made mechanisms are assembled."""
    solved = solve(setting, made)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        values = nominal_values(setting.mechanism, solved, setting.question.channels, setting.rates)
    errors = np.empty((len(values), count))
    for error, value, centre in zip(errors, values, setting.centres, strict=True):
        error[:] = value - centre
    if setting.elastic is not None:
        errors += setting.elastic.errors(made.loads, count)
    return errors, np.broadcast_to(solved.valid, (count,))


def problem_of(setting: Setting, sources: Sources) -> Problem:
    """Where the mechanism breaks a limit: margins are nan where it cannot be assembled.

    What has no closed derivative is differenced.
    """
    setting = setting.narrowed()
    question = setting.question

    def margins(u: Floats) -> Floats:
        errors, valid = errors_of(setting, sources.made(sources.at(u, directed=True)), u.shape[1])
        found = question.margins(errors)
        found[:, ~valid] = np.nan
        return found

    def gradients(u: Floats) -> tuple[Floats, Floats]:
        made = sources.made(sources.at(u, directed=True))
        errors, valid = errors_of(setting, made, u.shape[1])
        names = [name for part in made for name in part]
        by_name = derivatives(
            setting.mechanism, solve(setting, made), question.channels, names, setting.rates, setting.elastic
        )
        by_variable = np.einsum("cnp,ndp->cdp", by_name, slopes(varying, u, _STEP))
        found = question.margins(errors)
        found[:, ~valid] = np.nan
        return found, question.margin_slopes(errors, by_variable)

    def varying(u: Floats) -> Floats:
        """Places, drives and loads, shape (names, n)."""
        parts = sources.made(sources.at(u, directed=True))
        return np.array([np.broadcast_to(value, (u.shape[1],)) for part in parts for value in part.values()])

    try:
        gradients(np.zeros((len(sources.owners), 1)))
    except MechanismError:
        return Problem(len(sources.owners), margins, circles=sources.circles)
    return Problem(len(sources.owners), margins, gradients, sources.circles)
