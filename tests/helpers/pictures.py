"""One picture of a result by its name: a test that looks at one does not wait for the others."""

from __future__ import annotations

from matplotlib.figure import Figure

from mechdesign.drawing.before import Before
from mechdesign.drawing.pictures import pictures
from mechdesign.drawing.rendering import Gallery
from mechdesign.ground.results import Result
from mechdesign.study import Study


def figure_of(study: Study, result: Result, name: str, before: Before | None = None) -> Figure:
    """The figure of this name among the `figures` of a result; use inside `style.context`."""
    picture = next(picture for picture in pictures(result.command) if name in picture.names)
    gallery = Gallery()
    gallery.add(name, picture, picture.view(study, result.seen, before))
    assert not gallery.failed
    return gallery[name]
