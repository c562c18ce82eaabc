"""Pictures: each is a function that is declared by its name where it stands; those of a question are collected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pkgutil import iter_modules
from typing import Generic, TypeVar

from mechdesign.commands import QUESTIONS
from mechdesign.drawing.before import Before
from mechdesign.drawing.panels import Along, Plane, along, plane
from mechdesign.drawing.rendering import Gallery, Made
from mechdesign.ground.results import Result
from mechdesign.motion.rows import Poses
from mechdesign.study import Study


@dataclass(frozen=True, eq=False)
class View:
    """What a picture shows: a result of a study, and under it perhaps that of the study before a change.

    A question derives a view of its own from it, with what several of its pictures share.
    """

    study: Study
    result: Result
    before: Before | None = None


class PosesView(View):
    """A result whose tables have a row a pose, or several."""

    @property
    def poses(self) -> Poses:
        """The poses of the tables."""
        raise NotImplementedError

    @cached_property
    def swept(self) -> Along | None:
        """The coordinate along a sweep or path."""
        return along(self.study, self.poses)

    @cached_property
    def over(self) -> Plane | None:
        """The two coordinates of a grid."""
        return plane(self.study, self.poses)


V = TypeVar("V", bound=View)


@dataclass(frozen=True, eq=False)
class NamedPicture(Generic[V]):
    """A picture of a question, or several that are drawn together.

    Parameters
    ----------
    names : tuple of str
        Names of its files.
    order : int
        Its place among the pictures of the question, which begin with the most telling.
    view : type of View
        What it shows.
    draw : callable
        The function: a figure, figures by name, or None where the result has nothing to show.
    """

    names: tuple[str, ...]
    order: int
    view: type[V]
    draw: Callable[[V], Made]

    def __call__(self, view: V) -> Made:
        """Draw it."""
        return self.draw(view)


def picture(view: type[V], *names: str, order: int = 100) -> Callable[[Callable[[V], Made]], NamedPicture[V]]:
    """Declare that a function draws the picture of this name from a view; of several names, those that it returns."""
    return lambda draw: NamedPicture(names, order, view, draw)


def pictures(command: str) -> list[NamedPicture[View]]:
    """Pictures of a question, the most telling first: those that the modules of its folder of figures declare."""
    package = import_module(QUESTIONS[command].figures)
    listed = iter_modules(getattr(package, "__path__", ()))
    modules = [package, *(import_module(f"{package.__name__}.{module.name}") for module in listed)]
    declared = (value for module in modules for value in vars(module).values() if isinstance(value, NamedPicture))
    return sorted(dict.fromkeys(declared), key=lambda declared: (declared.order, declared.names))


def figures(study: Study, result: Result, before: Before | None = None, name: str | None = None) -> Gallery:
    """Figures of a result by their names, or that of one name, and why others could not be made.

    Use inside `style.context`.
    """
    gallery = Gallery()
    views: dict[type[View], View] = {}
    for picture in pictures(result.command):
        if name is not None and name not in picture.names:
            continue
        if picture.view not in views:
            views[picture.view] = picture.view(study, result.seen, before)
        gallery.add(picture.names[0], picture, views[picture.view])
    return gallery
