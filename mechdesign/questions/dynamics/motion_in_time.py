"""The motion that given efforts bring about, integrated in time.

The state holds all positions x of the mechanism and their velocities, of which a chart's are independent. The others
are solved from these in every pose, in the assembly that the state shows: so loops close to rounding, and the motion
goes on through poses at which two assemblies meet. Where a chart's coordinates come near to a dead centre, others take
over.

What acts is smooth within a step: at corners that depend on time alone steps end, and efforts and loads are kept on
their side of every other corner until one is found on the step's dense output, where the step is cut. So are limits,
events, and contacts that come to rest or begin to slide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from time import perf_counter, thread_time
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.sign_changes import Resolved
from mechdesign.ground.progress import NULL, Progress
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.charts import Sides, regularity
from mechdesign.mechanism.configuration import joined
from mechdesign.questions.dynamics.corners import Corners, Threshold
from mechdesign.questions.dynamics.equations_of_motion import MEETING, Branch, EquationsOfMotion, RatesInTime
from mechdesign.questions.dynamics.impacts import bounced, rested, turned
from mechdesign.questions.dynamics.instants import Instants
from mechdesign.questions.dynamics.reasons import cannot_go_on
from mechdesign.questions.dynamics.state_in_time import EndOfRun, EventInTime, MotionInTime
from mechdesign.questions.dynamics.watches import Watch, Watches

# Error of a step, as a part of a value and of the mechanism's size: energy keeps nine digits over hundreds of swings.
RELATIVE, ABSOLUTE = 1e-11, 1e-12
# Most steps, and most time of the processor (s); for more angles and slides than so many in proportion.
MAX_STEPS, MAX_SECONDS, MANY = 5000, 30.0, 10
MAX_BOUNCES = 1000
# Another chart takes over where its coordinates move so many times faster.
FASTER = 3.0
# A velocity below this part of the usual one is that of a contact at rest; and what it drifts by while it rests.
STILL, DRIFT = 1e-8, 1e-9
# What acts is that of its side this near to a corner, as a part of the duration.
BESIDE = 1e-13
# The first step behind a corner: as a part of the way to the next one, and of the step before.
TO_NEXT, OF_LAST = 0.5, 0.1
# How far behind a break-away contacts are told to slide, as a part of the duration.
BEGUN = 1e-9
# Most steps in a row that end where they begin, so many times as near as what acts is that of its side.
STUCK, MOVED = 20, 100.0
# How near to a pole of what acts a motion comes, as a part of the duration.
NEAR_POLE = 1e-6
# What acts, and is not linear, is looked at this often at least. A step that does not know it shall be so much shorter.
LEAST_STEPS, SHORTER = 64, 0.25
# Parts of the duration in which progress is told.
PARTS = 1000


class Stretch(NamedTuple):
    """The motion in a step up to an end, and the branch by which it is solved."""

    states: Callable[[Floats], Floats]  # at times, shape (n, times)
    end: float
    branch: Branch


class IntegratedPoses(NamedTuple):
    """The motion at some times.

    Attributes
    ----------
    work : Floats, shape (1 or 2, instants)
        Work of efforts and loads since the start, less what dampers, stops and friction have taken; that of friction.
    """

    times: Floats
    configuration: Configuration
    rates: RatesInTime
    work: Floats


class SpentError(Exception):
    """The time of the processor is used up."""


class Integration(MotionInTime):
    """One motion from its start to its end."""

    def __init__(self, equations: EquationsOfMotion) -> None:
        super().__init__(equations)
        self.corners = Corners(equations.study, equations.question.section.loads, self.section)
        self.watches = Watches(equations, self.corners, self.sliding)
        begin = self.state
        self.stretches = [self._stretch(lambda times: np.repeat(begin[:, None], len(times), axis=1), 0.0)]
        self._turning: list[Threshold] = []
        self._turned, self._pole = "", 0.0
        self.steps, self._bounces, self._stuck = 0, 0, 0
        self._deadlines = np.inf, np.inf
        # Of watches by kind and key, how large they were and, of events and corners, their signs.
        self._sizes: dict[tuple[str, Any], float] = {}
        self._sides: dict[tuple[str, Any], float] = {}
        self._begin_corners()
        self._most = self.end / LEAST_STEPS if self.corners.curved else np.inf
        self._first_step, self._longest = np.inf, self._most

    def _begin_corners(self) -> None:
        """Efforts, loads and couplings on the sides of their corners on which the motion starts."""
        start = self.instants(np.zeros(1), self.state[:, None])
        for threshold in self.corners.thresholds:
            self._sides["corner", threshold.key] = float(np.sign(np.nan_to_num(threshold.value(start, {})[0]))) or 1.0
        branch, sides = self.equations.branch, self._kept()
        chart = self.equations.atlas.chart(branch.chart.rows, sides)
        assert chart is not None
        self.equations.branch = branch._replace(sides=sides, chart=chart)

    def _function(self, at: float, state: Any) -> Any:
        """Derivative of the state: positions, velocities, work."""
        # A look at the wall's clock costs less than one at the processor's, which is never ahead.
        if perf_counter() > self._deadlines[0] and thread_time() > self._deadlines[1]:
            raise SpentError
        x, velocity, _ = self.parts_of(state[:, None])
        rates = self.equations.rates(np.array([at]), x, velocity)
        return np.concatenate([rates.velocity[:, 0], rates.acceleration[:, 0], rates.power[:, 0]])

    def run(self, progress: Progress = NULL) -> IntegratedPoses:
        """Integrate; rows are evenly spread over the duration, or what the motion has reached of it."""
        progress.start(PARTS, "parts of the motion's time")
        seconds = MAX_SECONDS * max(1.0, self.count / MANY)
        self._deadlines = perf_counter() + seconds, thread_time() + seconds
        try:
            for begin, end in pairwise([0.0, *self.corners.instants, self.end]):
                self._pass(begin, end, progress)
                if self.ending is not None:
                    break
        except SpentError:
            words = f"{seconds:g} s of the processor are not enough, the motion got to {{time}}"
            self.ending = EndOfRun("spent", words)
        count = self.section.rows
        return self.at(np.linspace(0.0, self.time, count) if self.time else np.zeros(1))

    def _pass(self, begin: float, end: float, progress: Progress) -> None:
        """Integrate from a corner in time to the next."""
        beside = BESIDE * self.end
        window = begin + beside if begin else -np.inf, end - beside if end < self.end else np.inf
        self.equations.branch = self.equations.branch._replace(window=window)
        pole = self.corners.pole(end) if end < self.end else ""
        until, solver = end - NEAR_POLE * self.end * bool(pole), None
        while self.time < until and self.ending is None:
            solver = self._solver(end) if solver is None else solver
            solver.max_step = self._longest
            begun, self.steps = self.time, self.steps + 1
            if self.steps > MAX_STEPS:
                self.ending = EndOfRun("spent", f"{MAX_STEPS} steps are not enough, the motion got to {{time}}")
                return
            if not np.isfinite(solver.f).all() or solver.step() is not None:
                self.ending = cannot_go_on(self, self.corners)
                break
            states = solver.dense_output()
            stop, self.time = self._looked(states, begun, solver.t)
            self.stretches.append(self._stretch(states, self.time))
            progress.update(int(PARTS * self.time / self.end) - int(PARTS * begun / self.end))
            self._stuck = self._stuck + 1 if self.time <= begun + MOVED * beside else 0
            if self._stuck > STUCK:
                words = "turns the motion back on both sides of a corner, as friction does, which 'friction' gives"
                why = f"{self._turned} {words}," if self._turned else "the motion cannot go on"
                self.ending = EndOfRun("no value", f"{why} from {{time}} on")
            if self.time == solver.t and stop is None:
                self.state = solver.y
                self._release()
                solver = self._switched(solver)
            else:
                self.state, solver = states(self.time), None
                if stop is not None:
                    self._stopped(stop)
        if pole and self.time >= until:
            self.ending, self._pole = EndOfRun("no value", f"{pole} is not finite at {{time}}"), end

    def _solver(self, end: float) -> DOP853:
        tolerance: Any = ABSOLUTE * self.scales  # one each, which the types of SciPy do not know
        first = min(self._first_step, end - self.time)
        steps: dict[str, Any] = {"first_step": first} if np.isfinite(self._first_step) else {}
        self._first_step = np.inf
        return DOP853(self._function, self.time, self.state, end, rtol=RELATIVE, atol=tolerance, **steps)

    def _stretch(self, states: Callable[[Floats], Floats], until: float) -> Stretch:
        return Stretch(states, until, self.equations.branch)

    def _looked(self, dense: Callable[[Floats], Floats], begin: float, end: float) -> tuple[Watch | None, float]:
        """What ends a step first, if anything, and when; crossings up to there are noted."""
        watches, self._turning = [*self.watches], []
        if not watches and not self.corners.curved:
            return None, end
        names: list[tuple[str, Any]] = [(watch.kind, watch.key) for watch in watches]
        seen: list[Instants] = []

        def look_at(times: Floats) -> Instants:
            return self.instants(times, dense(times))

        def look(times: Floats) -> Floats:
            instants = look_at(times)
            seen.append(instants)
            values = [np.broadcast_to(watch.function(instants), times.shape) for watch in watches]
            return np.array(values, dtype=float).reshape(len(watches), len(times))

        resolved = Resolved.of(look, np.array([begin, end]), np.array([self._sizes.get(name, 0.0) for name in names]))
        self._sizes |= zip(names, resolved.sizes.tolist(), strict=True)
        sides = [self._sides.get(name, 0.0 if name[0] == "event" else 1.0) for name in names]
        # What rests has the velocities of rounding.
        changes = resolved.changes(
            np.array(sides), [DRIFT * self.pace * (watch.kind == "contact") for watch in watches]
        )
        # At others than events and corners a change to the other side is none, as what they watch ends there.
        stopping = [change for change in changes if watches[change.function].kind == "corner"
                    or (watches[change.function].kind != "event" and change.sign < 0)]  # fmt: skip
        longer, until = self.watches.rows_of_tables(seen[0])
        self._longest = min((end - begin) * longer, self._most)
        if (curved := self.watches.curved(look_at, seen[0], begin, end)) is not None:
            self._first_step = (curved - begin) * SHORTER
            until = min(until, begin + self._first_step)
        until = min([end, until, resolved.reach, *(change.place for change in stopping)])
        stop = next((watches[change.function] for change in stopping if change.place <= until), None)
        if stop is not None and stop.kind == "corner":
            until = min(until + BESIDE * self.end, end)
            later = [change.place for change in changes if change.place > until]
            self._first_step = min([OF_LAST * (end - begin), *(TO_NEXT * (place - until) for place in later)])
        elif stop is not None and stop.kind == "hold":
            # A little further on it is certain which contacts begin to slide.
            until = min(until + BEGUN * self.end, end)
        turning = {names[change.function] for change in changes if change.place <= until}
        for change in changes:
            kind, name = watches[change.function].kind, names[change.function]
            if change.place <= until and kind in ("event", "corner"):
                if kind == "event" and self._sides.get(name):
                    self.events.append(EventInTime(str(name[1]), change.place, change.sign > 0))
                self._sides[name] = change.sign
        if stop is not None:
            self._turning = [threshold for threshold in self.corners.thresholds if ("corner", threshold.key) in turning]
        return stop, until

    def _stopped(self, stop: Watch) -> None:
        """Go on behind a stop, or end there."""
        equations = self.equations
        if self._turning:
            self._turned = self._turning[0].acting.words
            self.state = turned(self, self._kept(), self._turning)
        branch = equations.branch
        if stop.kind == "contact":
            assert isinstance(stop.key, int)
            self.state = rested(self, stop.key)
        elif stop.kind == "hold":
            rates = self.instants(np.array([self.time]), self.state[:, None]).rates
            begins = (branch.signs == 0) & (rates.slack[:, 0] < 0)
            # Friction is against the way that a contact begins to slide.
            ways = np.where(rates.friction == 0, self.sliding(rates.acceleration), -rates.friction)[:, 0]
            equations.branch = branch._replace(signs=np.where(begins, np.sign(ways), branch.signs))
        elif stop.kind == "limit":
            self.events.append(EventInTime(stop.name, self.time, rises=False))
            self._bounces += 1
            self.state = bounced(self, stop)
            if self._bounces > MAX_BOUNCES and self.ending is None:
                self.ending = EndOfRun("spent", f"{MAX_BOUNCES} bounces are not enough, the motion got to {{time}}")

    def _kept(self) -> Sides:
        """Sides on which efforts, loads and couplings are, by the programs of the corners' arguments."""
        return tuple((threshold.corner.argument.program, self._sides["corner", threshold.key])
                     for threshold in self.corners.thresholds if not threshold.level)  # fmt: skip

    def _release(self) -> None:
        """Let contacts that were at rest slide, once they move."""
        branch = self.equations.branch
        if branch.signs.all():
            return
        speeds = self.sliding(self.parts_of(self.state)[1])
        moves = (branch.signs == 0) & (np.abs(speeds) > STILL * self.pace)
        if moves.any():
            self.equations.branch = branch._replace(signs=np.where(moves, np.sign(speeds), branch.signs))

    def at(self, times: Floats) -> IntegratedPoses:
        """The motion at some times."""
        equations = self.equations
        numbers = np.searchsorted([stretch.end for stretch in self.stretches], times)
        parts = []
        for number in np.unique(numbers):
            states, _, equations.branch = self.stretches[number]
            inside = times[numbers == number]
            x, velocity, work = self.parts_of(states(inside))
            poses = Instants(equations, inside, x, velocity).configuration
            parts.append((x, work, equations.rates(inside, x, velocity), poses))
        x, work = (np.concatenate([part[k] for part in parts], axis=-1) for k in (0, 1))
        rates = RatesInTime(
            *(np.concatenate(values, axis=-1) for values in zip(*(part[2] for part in parts), strict=True))
        )
        vectors = self.mechanism.geometry.nominal
        whole = joined([part[3] for part in parts], times.shape, vectors, {})
        near = self.positions.near(x)
        whole = replace(whole, near=near, counted=frozenset(near))
        return IntegratedPoses(times, whole, rates, work)

    @property
    def reached(self) -> float:
        """When it ended, or would have come to what is not finite."""
        return self._pole or self.time

    def _switched(self, solver: DOP853) -> DOP853 | None:
        """The solver, or none where coordinates of another chart move much faster than those of this one."""
        equations = self.equations
        x, velocity, works = self.parts_of(solver.y)
        chart = equations.branch.chart
        linear = chart.solve(x[:, None], equations.branch.last)
        if not regularity(linear)[0] >= MEETING:
            return solver
        equations.branch = equations.branch._replace(last=linear.configuration.take(0))
        if solver.status != "running":
            return solver
        slopes = equations.slopes(linear)
        best, volume = equations.atlas.best(slopes, equations.branch.sides)
        if best is chart or volume * np.prod(self.positions.scales[chart.rows]) < FASTER:
            return solver
        exact = self.positions.of(linear.configuration)[:, 0]
        equations.branch = equations.branch._replace(chart=best)
        self.state = np.concatenate([exact, slopes @ velocity[chart.rows], works])
        return None
