"""A study that is changed by hand: what its page asks of the engine, and what it may write."""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from mechdesign.commands import COMMANDS
from mechdesign.door.live.asked import AskedError, changes_of, number_of, numbers_of, sheet_of, texts_of
from mechdesign.door.live.drag import Drag, dragged, free_numbers, value_of
from mechdesign.door.live.turned import dead_centres, motion_of, turning
from mechdesign.door.report.page.dark import dark
from mechdesign.door.report.page.headlines import Headline, headlines, shown
from mechdesign.door.report.page.moving import moving, posed
from mechdesign.door.report.page.page import AnsweredQuestion, mover, pose_of, required_of
from mechdesign.door.report.page.template import fragment, rendered
from mechdesign.door.report.page.tracks import ROWS, joined, steps
from mechdesign.door.report.page.vector import described, picture
from mechdesign.door.report.requirements import Verdict, requirements
from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.pictures import figures
from mechdesign.ground.errors import MechdesignError, StudyError, explain
from mechdesign.ground.files import flowing, proper, replace
from mechdesign.ground.progress import Progress
from mechdesign.ground.results import Result
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.look import ask
from mechdesign.study import Study
from mechdesign.study.designs import variant
from mechdesign.study.loading import load_bytes
from mechdesign.study.text.document import dotted, in_yaml, leaves, plain
from mechdesign.study.variants import changed_data, edited, in_text

PACKAGE = "mechdesign.door.live"
# Questions about one design, in the order in which they are asked first; the others make designs of their own.
QUESTIONS = ("kinematics", "stiffness", "dynamics", "workspace", "reliability")
_AS_IT_WAS = "As it was"
_MOST_ROWS = 20_000  # poses that a page draws
_MOVING = ("motion", "paths")  # pictures in whose place the mechanism moves
_MOST_PICTURES = 2  # of a question
_PIXEL = 0.1  # of a drawing, by which a dragged number is rounded
_REACH = 0.6  # of a slider to both sides, as a part of the number
_WAY = 0.3  # of a slider of a number that is zero, as a part of the mechanism's size
_STEPS = 400  # of a slider


class OvertakenError(Exception):
    """A newer change of the same page made an answer worthless."""


class _Watched(Progress):
    """Progress that ends a computation which was overtaken, and tells how far it is."""

    def __init__(self, overtaken: Callable[[], bool], tell: Callable[[str], None]) -> None:
        self._overtaken, self._tell, self._stage, self._done, self._total = overtaken, tell, "", 0, 0

    def start(self, total: int, stage: str) -> None:
        """Begin a stage."""
        self._stage, self._done, self._total = stage, 0, total
        self.update(0)

    def update(self, n: int) -> None:
        """Go on, unless it was overtaken."""
        self._done += n
        self._tell(f"{self._stage} {100 * self._done // max(self._total, 1)} %")
        if self._overtaken():
            raise OvertakenError


class Session:
    """What the pages of one study ask.

    Every request says by what its page differs from the study (`changes`, by the names of parameters and dimensions, in
    the study's units): the study in memory is that of the file, and nothing of a page is kept but what a computation
    needs to be dropped.

    Attributes
    ----------
    version : int
        Counts changes of the file; a page of an older version is made anew.
    mistake : str
        What is wrong with the file since it was last right; empty where it is.
    ended : bool
        Whether computations are to end, for nobody waits for them.
    """

    def __init__(self, study: Study, load: Callable[[], Study] | None = None) -> None:
        self._load = load
        self.version, self.mistake, self.ended = 1, "", False
        self.changed = threading.Condition()
        self._computing, self._turns, self._progress = threading.Lock(), dict[str, int](), dict[str, str]()
        self._parts: dict[str, Any] = {}
        # Of the last changes, by page, number of the request and question.
        self._results: dict[tuple[Any, ...], Result] = {}
        self._take(study)

    @np.errstate(all="ignore")
    def _take(self, study: Study) -> None:
        """The study of the file from now on, and how it moves."""
        study.need_mechanism("live")
        shown, held = study, dict[str, str]()
        try:
            first = motion_of(study)
        except MechdesignError:
            first = None
        if first is None:
            shown, held = turning(study)
            first = motion_of(shown)
        if first is None:
            raise StudyError("the study has no motion that can be shown")
        self.study, self.shown, self.held, self._first = study, shown, held, first

    def reload(self) -> None:
        """Read the file again; where it has mistakes the last study without any stays."""
        assert self._load is not None
        with self.changed:
            try:
                study = self._load()
                alike = study.text == self.study.text and [*study.inputs()] == [*self.study.inputs()]
                if alike and not self.mistake:
                    return
                self._take(study)
                self.mistake = ""
            except MechdesignError as error:
                self.mistake = explain(error)[1]
            self.version += 1
            self.changed.notify_all()

    @np.errstate(all="ignore")
    def page(self) -> bytes:
        """The page of the study as it is in the file."""
        study, part = self.study, moving(self.shown, self._first, handled=True)
        assert part is not None
        questions = self._questions()
        about = {
            "version": self.version, "questions": questions, "length": study.units.label("length"),
            "file": study.path.name if study.path is not None else "", "points": self._handles(),
            "step": float(f"{study.mechanism.size / 100:.1g}"), "mistake": self.mistake,
        }  # fmt: skip
        return rendered(
            "live.html.j2", package=PACKAGE, parts=("moving", "live"), connect="'self'", drawings=[part.drawing],
            study=study, part=part, about=about, groups=self._groups(),
            questions={name: COMMANDS[name].question for name in questions}, mistake=self.mistake,
        )  # fmt: skip

    def _questions(self) -> list[str]:
        return [name for name in QUESTIONS if name == "kinematics" or name in self.study.questions]

    def _handles(self) -> list[str]:
        """Points that a number of the study may move."""
        owners = {place.path[1] for name, place in self.study.mechanism.description.places.items()
                  if place.path[:1] == ("links",)}  # fmt: skip
        graph = self.study.mechanism.graph
        return [point for point in self.study.mechanism.points if owners.intersection(graph.links_at(point))]

    def _groups(self) -> list[tuple[str, list[dict[str, Any]]]]:
        """Numbers that can be changed, by parameters and parts of the mechanism."""
        groups: dict[str, list[dict[str, Any]]] = {}
        study = self.shown
        for name in free_numbers(study):
            value, place = value_of(study, name), study.mechanism.description.places.get(name)
            owner = "parameters" if place is None else str(place.path[1] if len(place.path) > 1 else place.path[0])
            owner = "drives that stand still" if name in self.held else owner
            reach = _REACH * abs(value)
            if reach == 0.0:
                lengths = self._unit(name) != study.units.label("angle")
                reach = _WAY * study.mechanism.size if lengths else 180.0
            low = value - reach if place is None or place.least is None else max(value - reach, 0.0)
            step = 1.0 if name in study.fixed else 10.0 ** math.floor(math.log10(2 * reach / _STEPS))
            groups.setdefault(owner, []).append({
                "name": name, "label": self.held.get(name, name), "value": value,
                "unit": self._unit(name), "low": low, "high": value + reach,
                "step": step,
            })  # fmt: skip
        return sorted(groups.items(), key=lambda group: (group[0] != "parameters", group[0] != GROUND))

    @np.errstate(all="ignore")
    def move(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """Positions with changed numbers, or with those that a drag changes; with ``wrong`` where there are none."""
        study, changes, sheet = self.shown, changes_of(asked), sheet_of(asked)
        self._turn(asked)
        names: tuple[str, ...] = ()
        why = ""
        if (drag := asked.get("drag")) is not None:
            if not isinstance(drag, Mapping):
                raise AskedError
            hand = Drag(
                str(drag.get("point")), complex(*numbers_of(drag.get("to"), 2)), number_of(drag.get("row")),
                texts_of(drag.get("locked")), texts_of(drag.get("held")), _PIXEL / sheet.scale,
            )  # fmt: skip
            if hand.point not in study.mechanism.points:
                raise AskedError
            done = dragged(study, changes, hand)
            changes, names, why = dict(done.changes), done.names, done.why
        count = int(number_of(asked.get("poses")))
        if not 0 < count <= _MOST_ROWS:
            raise AskedError
        now = variant(study, changes)
        drawing, tracks = posed(now, steps(str(asked.get("rows")), count) / ROWS, sheet, study)
        if "before" in tracks:
            tracks["before"]["title"] = _AS_IT_WAS
        return {"changes": changes, "names": names, "why": why, "drawing": drawing, "data": tracks,
                "set": self.overrides(changes), "words": [self._in_words(now, name) for name in names]}  # fmt: skip

    def _in_words(self, study: Study, name: str) -> str:
        return f"{name} = {shown(value_of(study, name))} {self._unit(name)}".rstrip()

    def _unit(self, name: str) -> str:
        return self.shown.unit_of(self.held.get(name, name)) or ""

    def _own(self, changes: Mapping[str, float]) -> dict[str, float]:
        """Changes of the study itself, without the drives that stand still."""
        return {name: value for name, value in changes.items() if name not in self.held}

    @np.errstate(all="ignore")
    def answer(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a question with changed numbers.

        Raises
        ------
        OvertakenError
            If the page has asked something newer.
        """
        changes, question = changes_of(asked), asked.get("question")
        if question not in self._questions():
            raise AskedError
        page, turn = self._turn(asked)

        def overtaken() -> bool:
            return self.ended or self._turns.get(page) != turn

        with self._computing:
            if overtaken():
                raise OvertakenError
            progress = _Watched(overtaken, partial(self._progress.__setitem__, page))
            try:
                return self._answered(question, changes, asked, progress)
            finally:
                self._progress.pop(page, None)

    def _answered(
        self, question: str, changes: Mapping[str, float], asked: Mapping[str, Any], progress: Progress
    ) -> dict[str, Any]:
        study = variant(self.study, self._own(changes))
        numbers: list[Headline] = []
        verdicts: tuple[Verdict, ...] = ()
        moves, result = study, None
        if question in study.questions or self.shown is self.study:
            result = ask(study, question, progress=progress)
            kept = {key: other for key, other in self._results.items() if key[:2] == (asked["page"], asked["turn"])}
            self._results = {**kept, (asked["page"], asked["turn"], question): result}
            verdicts, numbers = requirements(study, result), [*headlines(result.seen)]
        motion = result
        if question == "kinematics" and self.shown is not self.study:
            moves = variant(self.shown, changes)
            motion = ask(moves, question, progress=progress)
            # A study that does not ask how it moves has the numbers of the turn that is shown.
            numbers = numbers if result else [*headlines(motion.seen)]
        answered: dict[str, Any] = {"set": self.overrides(changes)}
        key, part = repr((self.version, sorted(changes.items()), asked.get("sheet"))), None
        if motion is not None and question in ("kinematics", "dynamics"):
            before = None
            if question == "kinematics" and changes:
                before = Before(self.shown, self._first.seen, ("", _AS_IT_WAS))
            sheet = sheet_of(asked) if asked.get("sheet") else None
            marked = [number.place for number in numbers if number.place is not None] if moves is study else []
            part = moving(moves, motion.seen, before, marked, plain=sheet is not None, sheet=sheet, handled=True)
        if part is not None:
            whole = dataclasses.asdict(part)
            whole["data"] = dict(whole["data"])
            if "before" in whole["data"]:
                whole["data"]["before"]["title"] = _AS_IT_WAS
            if question == "kinematics":
                self._parts = {"key": key, "part": whole}
            elif self._parts.get("key") == key and whole["data"]["course"] == self._parts["part"]["data"]["course"]:
                whole = joined(self._parts["part"], whole)
            else:
                whole = {}
            if whole:
                answered |= {"data": whole["data"], "drawing": whole["drawing"], "dark": dark([whole["drawing"]])}
                answered["numbers"] = fragment("numbers.html.j2", PACKAGE, part=whole)
        section = AnsweredQuestion(question, "", 0, verdicts=verdicts)
        parts = {"kinematics": self._parts["part"]} if self._parts.get("key") == key else {}
        own = [entry for entry in required_of(study, [section]) if entry["verdict"] is not None]
        answered["html"] = fragment(
            "answer.html.j2", PACKAGE, command=question, question=COMMANDS[question].question, numbers=numbers,
            required=own, mover=partial(mover, parts), pose_of=pose_of, failed=result.failed if result else "",
            warnings=[*map(str, result.warnings if result else ())],
            dead=dead_centres(motion) if motion else (),
        )  # fmt: skip
        return answered

    @np.errstate(all="ignore")
    def pictures(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """The first pictures of the last answer to a question, as they stand in a report.

        Raises
        ------
        OvertakenError
            If the page has asked something newer.
        """
        page, turn = self._turn(asked)
        with self._computing:
            result = self._results.get((page, turn, asked.get("question")))
            if result is None or self._turns.get(page) != turn:
                raise OvertakenError
            study = variant(self.study, self._own(changes_of(asked)))
            drawn = dict[str, str]()
            with style.context():
                gallery = figures(study, result)
                for name in [name for name in gallery if name not in _MOVING][:_MOST_PICTURES]:
                    if self.ended or self._turns.get(page) != turn:
                        raise OvertakenError
                    figure = gallery[name]
                    alt = f"{name.replace('_', ' ')}: {described(figure)}"
                    drawn[name] = picture(figure, f"{result.command}-{name}", alt)
        html = fragment("pictures.html.j2", PACKAGE, pictures=drawn)
        return {"html": html, "dark": dark(drawn.values())}

    def overrides(self, changes: Mapping[str, float]) -> list[str]:
        """Changes as `--set` takes them, by the entries of the study."""
        now = dict(leaves(plain(self.study.resolved)))
        changed = leaves(changed_data(self.study, self._own(changes)))
        return [f"{dotted(keys)}={in_yaml(value)}" for keys, value in changed if keys not in now or now[keys] != value]

    @np.errstate(all="ignore")
    def save(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        """Write the study with changed numbers into its file, or into another in its folder.

        A file that is there is replaced only where the page says so; ``exists`` asks for it.
        """
        study, changes = self.study, self._own(changes_of(asked))
        if study.path is None:
            raise StudyError("the study is no file; copy the changes as --set")
        name = str(asked.get("name") or study.path.name)
        path = study.path.parent / name
        if not proper(name) or "\\" in name or name.startswith(".") or path.suffix not in (".yaml", ".yml"):
            raise StudyError(f"{name!r} is no plain name of a file that ends in .yaml")
        own = path == study.path
        if own and path.read_bytes() != study.text:
            raise StudyError(f"{name} was changed since it was read here; nothing was written")
        if flowing(path) or (path.is_symlink() and not own) or path.is_dir():
            raise StudyError(f"{name} is no file that may be replaced")
        if path.exists() and not asked.get("replace"):
            return {"exists": name}
        data = changed_data(study, changes)
        text = in_text(study, data)
        again = load_bytes(text.encode(), path, (), None, study.folder)
        if any(not math.isclose(value, again.sizes[key], rel_tol=1e-12, abs_tol=1e-300)
               for key, value in variant(study, changes).sizes.items()):  # fmt: skip
            raise StudyError("the changed study could not be written so that it reads the same; nothing was written")
        replace(path, [text.encode()])
        if own and self._load is not None:
            self.reload()
        return {"saved": name, "comments": edited(study, data) is not None}

    def progress(self, page: str) -> str:
        """How far the computation for a page is, in words."""
        return self._progress.get(page, "")

    def _turn(self, asked: Mapping[str, Any]) -> tuple[str, int]:
        """The page and the number of its request; older computations for it are overtaken."""
        page, turn = str(asked.get("page"))[:40], int(number_of(asked.get("turn")))
        if len(self._turns) > 1000:
            self._turns.clear()
        self._turns[page] = max(turn, self._turns.get(page, 0))
        return page, turn
