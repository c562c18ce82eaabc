"""A study that pages change by hand: which requests are the newest, what is computed, and what may be written."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechdesign.door.live import saving
from mechdesign.door.live.altered import altered
from mechdesign.door.live.answers import ChangedAnswer
from mechdesign.door.live.requests import changes_of, number_of
from mechdesign.ground.errors import explain
from mechdesign.ground.progress import Progress
from mechdesign.study import Study

Actions = dict[str, Callable[[Mapping[str, Any]], dict[str, Any]]]
_MOST_PAGES = 16  # whose answers are kept: those that asked last


class OvertakenError(Exception):
    """A newer change of the same page made an answer worthless."""


@dataclass(eq=False)
class OpenPage:
    """What is kept of a page: the number of its newest request, how far its computation is, and the answers to it."""

    turn: int = -1
    progress: str = ""
    answers: dict[str, ChangedAnswer] = field(default_factory=dict)
    parts: dict[str, dict[str, Any]] = field(default_factory=dict)  # mechanisms that move, by their questions


class _Watched(Progress):
    """Progress that ends a computation which was overtaken, and tells a page how far it is."""

    def __init__(self, page: OpenPage, overtaken: Callable[[], bool]) -> None:
        self._page, self._overtaken, self._stage, self._done, self._total = page, overtaken, "", 0, 0

    def start(self, total: int, stage: str) -> None:
        """Begin a stage."""
        self._stage, self._done, self._total = stage, 0, total
        self.update(0)

    def update(self, n: int) -> None:
        """Go on, unless it was overtaken."""
        self._done += n
        share = f" {100 * self._done // self._total} %" if self._total > 1 else ""
        self._page.progress = f"{self._stage}{share}"
        self.look()

    def look(self) -> None:
        """End the computation if it was overtaken."""
        if self._overtaken():
            raise OvertakenError


class ServedStudy(ABC):
    """What all pages of one study ask, of a mechanism or of a task.

    Every request says by what its page differs from the study (`changes`, by the names of parameters, dimensions and
    entries, in the study's units): the study in memory is that of the file, and of a page nothing is kept but its last
    answers.

    Attributes
    ----------
    version : int
        Counts changes of the file; a page of an older version is made anew.
    mistake : str
        What is wrong with the file since it was last right; empty where it is.
    ended : bool
        Whether computations are to end, for nobody waits for them.
    taken : bool
        Whether its study is a linkage of a task, whose page stands two folders above.
    held : dict of str to str
        Drives that stand still, by the names of the parameters that say where.
    linkages : dict of str to ServedStudy
        Linkages that pages of a task have taken over, by the names in their addresses.
    """

    study: Study

    def __init__(self, study: Study, load: Callable[[], Study] | None = None) -> None:
        self._load = load
        self.version, self.mistake, self.ended = 1, "", False
        self.changed = threading.Condition()
        self._computing, self._pages, self._noting = threading.Lock(), dict[str, OpenPage](), threading.Lock()
        self.taken, self.held, self.linkages = False, dict[str, str](), dict[str, ServedStudy]()
        self._take(study)

    @abstractmethod
    def _take(self, study: Study) -> None:
        """The study of the file from now on."""

    @property
    @abstractmethod
    def actions(self) -> Actions:
        """What a page may ask, by the words of its requests."""

    @abstractmethod
    def page(self) -> bytes:
        """The page of the study as it is in the file."""

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
            except Exception as error:
                self.mistake = explain(error)[1]
            self.version += 1
            self.changed.notify_all()

    def _own(self, changes: Mapping[str, float]) -> dict[str, float]:
        """Changes of the study itself, without the drives that stand still."""
        return {name: value for name, value in changes.items() if name not in self.held}

    def _turn(self, request: Mapping[str, Any]) -> tuple[OpenPage, _Watched]:
        """The page that asks, and what ends its computation when it has asked something newer."""
        page, turn = self._page(request)
        return page, _Watched(page, lambda: self.ended or page.turn != turn)

    @contextmanager
    def _watched(self, request: Mapping[str, Any]) -> Iterator[tuple[OpenPage, _Watched]]:
        """The same, alone among all computations but those of pictures."""
        page, progress = self._turn(request)
        with self._computing:
            try:
                progress.look()
                yield page, progress
            finally:
                page.progress = ""

    @np.errstate(all="ignore")
    def save(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Write the study with changed numbers into its file, or into another in its folder; see `saving.save`."""
        changed = altered(self.study, self._own(changes_of(request)))
        name, replacing, own = str(request.get("name") or ""), bool(request.get("replace")), self._load is not None
        answer = saving.save(self.study, changed, name, own=own, replacing=replacing)
        if own and answer.get("saved") == saving.file_names(self.study)["file"]:
            self.reload()
        return answer

    def progress(self, name: str) -> str:
        """How far the computation for a page is, in words."""
        page = self._pages.get(name)
        return page.progress if page else ""

    def _page(self, request: Mapping[str, Any]) -> tuple[OpenPage, int]:
        """The page that asks, and the number of its request; by a newer one older computations are overtaken."""
        name, turn = str(request.get("page"))[:40], int(number_of(request.get("turn")))
        with self._noting:
            page = self._pages.pop(name, None) or OpenPage()
            self._pages[name] = page
            for oldest in [*self._pages][:-_MOST_PAGES]:
                del self._pages[oldest]
            if turn > page.turn:
                page.turn, page.answers, page.parts = turn, {}, {}
        return page, turn
