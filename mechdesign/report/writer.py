"""Write a result: tables, pictures, and last the manifest that vouches for them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from mechdesign.errors import OutputError
from mechdesign.files import replace
from mechdesign.report import manifest
from mechdesign.report.manifest import Asked
from mechdesign.report.requirements import Verdict
from mechdesign.report.tables import csv_blocks
from mechdesign.results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mechdesign.study import Study

MECHANISM = "mechanism.png"
ANIMATION = "motion.gif"


def check_writable(directory: Path) -> None:
    """Find out before a long computation that its results could not be written; creates nothing.

    Raises
    ------
    OutputError
        If the directory, or the nearest one above it that exists, does not take files.
    """
    place = directory
    while not place.exists() and place != place.parent:
        place = place.parent
    if not place.is_dir():
        raise OutputError(f"{directory}: results cannot be written there: {place} is a file; choose another --out")
    if not os.access(place, os.W_OK | os.X_OK):
        raise OutputError(
            f"{directory}: results cannot be written there: no permission for {place}; choose another --out"
        )


def write(directory: Path, study: Study, result: Result, verdicts: Sequence[Verdict], asked: Asked) -> tuple[str, ...]:
    """Write a result into a directory and return the names of the files.

    Each file appears whole or not at all; of an interrupted computation no pictures are drawn. The manifest comes
    last; files of an older result that the new one does not have are removed, so that the directory never shows two
    results at once.

    Raises
    ------
    OutputError
        If the directory or a file cannot be written.
    """
    files: dict[str, Iterable[bytes]] = {
        f"{table.name}.csv": map(str.encode, csv_blocks(table)) for table in result.tables.values()
    }
    files |= {name: (text.encode(),) for name, text in result.files.items()}
    if asked.plots and not result.interrupted:
        files |= {name: (data,) for name, data in pictures(study, result, animate=asked.animate).items()}
    stale = manifest.recorded_files(manifest.read(directory) or {}).keys() - files.keys()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        digests = {name: replace(directory / name, blocks) for name, blocks in files.items()}
        for name in stale:
            (directory / name).unlink(missing_ok=True)
        replace(directory / manifest.NAME, [manifest.compose(study, result, verdicts, digests, asked)])
    except OSError as error:
        raise OutputError(f"{directory}: results could not be written: {error.strerror or error}") from error
    return (*files, manifest.NAME)


def write_text(path: Path, text: str) -> None:
    """Write one text file whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    _write(path, text.encode())


def write_sketch(directory: Path, study: Study) -> Path:
    """Draw the sketch as it is understood into a directory, as `MECHANISM`; returns the file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    from mechdesign.report.figures import style
    from mechdesign.report.figures.mechanism import sketch_figure

    check_writable(directory)
    with style.context():
        data = style.to_png(sketch_figure(study))
    path = directory / MECHANISM
    _write(path, data)
    return path


def pictures(study: Study, result: Result, *, animate: bool = False) -> dict[str, bytes]:
    """Pictures of a result: those of its command, the mechanism, and the motion as a GIF if it is one."""
    from mechdesign.report.figures import style
    from mechdesign.report.figures.mechanism import mechanism_figure
    from mechdesign.report.figures.rendering import Drawing, render

    with style.context():
        figures: dict[str, Figure] = import_module(f"mechdesign.report.figures.{result.command}").figures(study, result)
        drawings: dict[str, Drawing] = {
            f"{name}.png": partial(style.to_png, figure) for name, figure in figures.items()
        }
        drawings[MECHANISM] = lambda: style.to_png(mechanism_figure(study))
        if animate:
            from mechdesign.report.figures.animation import animation

            drawings[ANIMATION] = lambda: animation(study)
        # What cannot be animated gives no bytes.
        return {name: data for name, data in render(drawings).items() if data}


def _write(path: Path, data: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace(path, [data])
    except OSError as error:
        raise OutputError(f"{path}: could not be written: {error.strerror or error}") from error
