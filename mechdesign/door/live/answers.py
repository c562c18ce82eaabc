"""The answer to a question of the live page: what the study says with changed numbers, and how it moves with them."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from mechdesign.commands import QUESTIONS
from mechdesign.door.live.turned import dead_centres
from mechdesign.door.report.page.headlines import Headline, headlines
from mechdesign.door.report.page.linkage import Canvas
from mechdesign.door.report.page.moving import moving
from mechdesign.door.report.page.page import AnsweredQuestion, mover, pose_of, required_of, together
from mechdesign.door.report.page.template import fragment
from mechdesign.door.report.page.vector import picture_of
from mechdesign.door.report.requirements import requirements
from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.pictures import figures
from mechdesign.ground.results import Result
from mechdesign.study import Study

PACKAGE = "mechdesign.door.live"
AS_IT_WAS = "As it was"
DRAWING = threading.Lock()  # held where Matplotlib's settings, which are those of the process, are changed
# Questions whose answers move, those that show the motion itself before others along it.
_MOVE = ("kinematics", "dynamics")
_STAGED = ("motion", "paths")  # pictures in whose place the mechanism moves
_MOST_PICTURES = 2  # of a question
_MOST_CLASSES = 2  # four-bars and slider-cranks whose class is told
# Links that turn fully against the frame, by Grashof's class.
_TURNING = {"double-crank": ("input", "output"), "crank-rocker": ("input",), "double-rocker": ("coupler",),
            "rocker-crank": ("output",), "triple-rocker": (), "crank-slider": ("input",)}  # fmt: skip


@dataclass(frozen=True, eq=False)
class ChangedAnswer:
    """What a study with changed numbers answers to a question.

    `result` is None where it does not ask how it moves; `motion` is then that of `moves`, which is turned by a drive.
    """

    question: str
    study: Study
    result: Result | None
    moves: Study
    motion: Result

    @cached_property
    def numbers(self) -> list[Headline]:
        """The key numbers: those of the turn that is shown where the study does not ask how it moves."""
        return headlines(self._seen)

    @property
    def _seen(self) -> Result:
        return (self.result or self.motion).seen

    def part(self, first: Before | None, sheet: Canvas | None) -> dict[str, Any] | None:
        """The mechanism moving over its first motion, as plain data; None where nothing moves."""
        if self.question not in _MOVE:
            return None
        places = [number.place for number in self.numbers if number.place is not None]
        marked = places if self.moves is self.study else []
        part = moving(self.moves, self.motion.seen, first, marked, plain=sheet is not None, sheet=sheet, handled=True)
        if part is None:
            return None
        whole = dataclasses.asdict(part)
        return {**whole, "data": titled(whole["data"])}

    def html(self, stage: Mapping[str, Any] | None) -> str:
        """Classes, key numbers, requirements, dead centres and warnings, with links into the mechanism on the stage."""
        result, moves = self.result, {} if stage is None else {"kinematics": stage}
        section = AnsweredQuestion(self.question, "", 0, verdicts=requirements(self.study, result) if result else ())
        return fragment(
            "answer.html.j2", PACKAGE, command=self.question, question=QUESTIONS[self.question].question,
            classes=[*_classes(self._seen)], numbers=self.numbers, mover=partial(mover, moves), pose_of=pose_of,
            dead=dead_centres(self.motion),
            required=[entry for entry in required_of(self.study, [section]) if entry["verdict"] is not None],
            failed=result.failed if result else "", warnings=[*map(str, result.warnings if result else ())],
        )  # fmt: skip

    def pictures(self, look: Callable[[], None]) -> dict[str, str]:
        """HTML of its first pictures but those in whose place it moves, by names; `look` is called before each."""
        drawn = dict[str, str]()
        if self.result is not None:
            with DRAWING, style.context():
                gallery = figures(self.study, self.result)
                for name in [name for name in gallery if name not in _STAGED][:_MOST_PICTURES]:
                    look()
                    drawn[name] = picture_of(self.question, name, gallery[name])
        return drawn


def _classes(result: Result) -> Iterator[Headline]:
    """Classes of the four-bars and slider-cranks of a motion, with the links that turn fully, where there are few."""
    table = result.tables.get("loops")
    for row in table if table is not None and len(table) <= _MOST_CLASSES else ():
        turning = [str(row[role]) for role in _TURNING.get(str(row["class"]), ())]
        words = f"{' and '.join(turning)} can turn fully" if turning else "no link can turn fully"
        yield Headline(f"{row['kind']} {row['joints']}", str(row["class"]), note=words * (row["class"] in _TURNING))


def staged(parts: Mapping[str, dict[str, Any]]) -> dict[str, Any] | None:
    """The mechanism of a page, with the arrows and numbers of all questions that move along its motion."""
    ordered = {question: parts[question] for question in _MOVE if question in parts}
    return dict(together(ordered)["kinematics"]) if "kinematics" in ordered else None


def titled(data: Mapping[str, Any]) -> dict[str, Any]:
    """Tracks in which the motion before is called that of the study as it was."""
    before = {"before": data["before"] | {"title": AS_IT_WAS}} if "before" in data else {}
    return {**data, **before}
