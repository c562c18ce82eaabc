"""Files that can be exported: functions, each declared with the name of its file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from pkgutil import iter_modules

from mechdesign.door import exporting
from mechdesign.door.exporting.drawing import Drawing
from mechdesign.door.exporting.dxf import to_dxf
from mechdesign.door.exporting.svg import to_svg
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import StudyError, suggestion


@dataclass(frozen=True)
class Content:
    """What a file holds, and the warnings that belong to it."""

    data: str | bytes
    warnings: tuple[Caution, ...] = ()


@dataclass(frozen=True, eq=False)
class Export:
    """A file that can be exported.

    Parameters
    ----------
    name : str
        Name of the file, such as ``parts.dxf``.
    meaning : str
        What it holds, in a few words.
    order : int
        Its place in the list of what can be exported.
    make : callable
        Makes the content from a study and a pose.
    options : tuple of str
        Those of `at`, `rate` and `paper` of the view that it takes.
    """

    name: str
    meaning: str
    order: int
    make: Callable[[PosedStudy], Content]
    options: tuple[str, ...] = ()

    def ignored(self, view: PosedStudy) -> tuple[Caution, ...]:
        """A warning for each option that is given and that the file does not take."""
        given = [name for name in ("at", "rate", "paper") if getattr(view, name) is not None]
        return tuple(
            Caution("ignored", f"--{name} has no effect on {self.name}") for name in given if name not in self.options
        )


def export(
    name: str, meaning: str, order: int = 100, options: tuple[str, ...] = ()
) -> Callable[[Callable[[PosedStudy], Content]], Export]:
    """Declare that a function makes the file of this name from a view; see `Export` for the arguments."""
    return lambda make: Export(name, meaning, order, make, options)


def drawings(
    name: str, meaning: str, order: int, make: Callable[[PosedStudy], Drawing],
    cautions: Callable[[PosedStudy], tuple[Caution, ...]] = lambda _: (), options: tuple[str, ...] = (),
) -> tuple[Export, Export]:  # fmt: skip
    """The exports of a drawing: as DXF, and behind it as SVG; `cautions` are warnings of its own."""

    def written(to_text: Callable[[Drawing], str], view: PosedStudy) -> Content:
        return Content(to_text(make(view)), view.assumed + view.unmoved + cautions(view))

    return (
        export(f"{name}.dxf", f"{meaning}, as DXF", order, options=options)(partial(written, to_dxf)),
        export(f"{name}.svg", f"{meaning}, as SVG", order + 1, options=options)(partial(written, to_svg)),
    )


@cache
def exports() -> dict[str, Export]:
    """Every file that can be exported, by its name: those that the modules of this folder declare."""
    modules = [import_module(f"{exporting.__name__}.{module.name}") for module in iter_modules(exporting.__path__)]
    declared = {value for module in modules for value in vars(module).values() if isinstance(value, Export)}
    return {export.name: export for export in sorted(declared, key=lambda export: (export.order, export.name))}


def export_named(name: str) -> Export:
    """The export of a name.

    Raises
    ------
    StudyError
        If there is none; the message has the most similar name, or else all of them.
    """
    listed = exports()
    if name not in listed:
        there = ", ".join(f"{other} ({export.meaning})" for other, export in listed.items())
        hint = suggestion(name, listed) or f"; what there is: {there}"
        raise StudyError(f"--to: there is no {name!r} to export{hint}")
    return listed[name]
