"""Write a result: tables, pictures, and last the manifest that lists them with their hashes."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from mechdesign.door.report import manifest
from mechdesign.door.report.manifest import Extras
from mechdesign.door.report.names import ANIMATION, MECHANISM
from mechdesign.door.report.page import pages
from mechdesign.door.report.requirements import Verdict, judged_again
from mechdesign.door.report.tables import csv_blocks
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import OutputError, explain
from mechdesign.ground.files import Transaction, check_writable, flowing
from mechdesign.ground.long_tables import LongTable
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.records import check_replaceable, write_recorded
from mechdesign.ground.results import Result, Table
from mechdesign.ground.work import ahead
from mechdesign.study import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mechdesign.drawing.before import Before

DIMENSIONS = "dimensions"  # of `check`
_GIGABYTE = 1e9  # bytes
_UNDRAWN = Caution("undrawn", "the run ended before its pictures were written")
# Ending of the names of pictures as HTML.
INLINE = ".html"


def write(
    directory: Path,
    study: Study,
    result: Result,
    verdicts: Sequence[Verdict],
    output: Extras,
    jobs: int | None = None,
    progress: Progress = NULL,
    before: Before | None = None,
) -> tuple[Caution, ...]:
    """Write a result into a directory and return a warning for each picture that could not be drawn.

    The tables come first, all of them or none, with a manifest that vouches for them alone: whatever becomes of the
    pictures, they are there. Of an interrupted computation no pictures are drawn. Pictures show a study `before` under
    this one. Files of an older result that the new one does not have are removed, so that the directory never shows two
    results at once.

    Raises
    ------
    OutputError
        If the directory or a file cannot be written, or long tables need more room than there is.
    """
    files: dict[str, Iterable[bytes]] = {
        f"{table.name}.csv": _encoded(table, progress) for table in result.tables.values()
    }
    files |= {name: (text.encode(),) for name, text in result.files.items()}
    own, more = manifest.own(directory), (output.plots or output.report) and not result.interrupted
    pages.remove(directory / pages.REPORT)
    pages.remove(directory / pages.PRINTED)
    warnings: tuple[Caution, ...] = ()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        _check_room(directory, result)
        tables = dataclasses.replace(output, plots=False, animate=False, report=False)
        begun = dataclasses.replace(result, warnings=(*result.warnings, _UNDRAWN)) if more else result
        with Transaction(directory) as written:
            digests = {name: written.stage(name, blocks) for name, blocks in files.items()}
            written.stage(manifest.NAME, [manifest.compose(directory, study, begun, verdicts, digests, tables)])
            written.commit(own, voucher=manifest.NAME)
        drawn: dict[str, bytes] = {}
        plots = output.plots and not result.interrupted
        if plots:
            drawn, warnings = ahead.call(pictures, study, result.seen, output, jobs, before)
        if output.report:
            from mechdesign.door.report.page import section

            inline = {name: drawn.pop(f"{name}{INLINE}").decode() for name in _inline(drawn)}
            mechanism = inline.pop(MECHANISM, "")
            part, warnings = section.section(study, result, inline, mechanism, warnings, before, plots=output.plots)
            drawn[pages.SECTION] = section.encoded(part)
        if drawn or more:
            final = dataclasses.replace(result, warnings=(*result.warnings, *warnings))
            verdicts = judged_again(study, verdicts, final.warnings)
            own = {*digests, manifest.NAME}
            with Transaction(directory) as written:
                digests |= {name: written.stage(name, [data]) for name, data in drawn.items()}
                written.stage(manifest.NAME, [manifest.compose(directory, study, final, verdicts, digests, output)])
                written.commit(own, own, voucher=manifest.NAME)
    except OSError as error:
        raise OutputError(f"{directory}: results could not be written: {error.strerror or error}") from error
    return warnings


def _encoded(table: Table, progress: Progress) -> Iterator[bytes]:
    """The bytes of a table's file, block by block, with progress for a long table."""
    long = isinstance(table, LongTable)
    if long:
        progress.start(len(table), f"rows of {table.name}.csv")
    for block in csv_blocks(table):
        yield block.encode()
        progress.update(block.count("\n") if long else 0)


def _check_room(directory: Path, result: Result) -> None:
    """Check that the disk has room for long tables before they are written."""
    need = 0.0
    for table in result.tables.values():
        if isinstance(table, LongTable) and len(table.seen):
            need += sum(map(len, csv_blocks(table.seen))) / len(table.seen) * len(table)
    free = shutil.disk_usage(directory).free if need else 0
    if need > free:
        raise OutputError(
            f"{directory}: the tables need about {need / _GIGABYTE:.2g} GB, and {free / _GIGABYTE:.2g} GB are free "
            "there; choose another --out or fewer poses"
        )


def write_file(path: Path, data: bytes) -> None:
    """Write one file whole or not at all, in place of none or one of ours; a device or a pipe gets the bytes.

    Raises
    ------
    StudyError
        If another file stands there, or a link to one.
    OutputError
        If it cannot be written.
    """
    try:
        if flowing(path):
            path.write_bytes(data)
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_recorded(path, data)
    except OSError as error:
        raise OutputError(f"{path}: could not be written: {error.strerror or error}") from error


def check_sketch(directory: Path, study: Study, output: Extras) -> None:
    """Check that the drawings of a sketch replace no files in a directory but ours, and none that the study reads.

    Raises
    ------
    StudyError
        If they would.
    """
    for name, kind in product((MECHANISM, DIMENSIONS), output.formats.split(",")):
        check_replaceable(directory / f"{name}.{kind}", manifest.read_by(study))


def write_sketch(directory: Path, study: Study, output: Extras) -> str:
    """Draw the sketch as it is understood into a directory, as ``mechanism`` and ``dimensions``; says what is there.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    check_writable(directory)
    from mechdesign.drawing import style
    from mechdesign.drawing.dimensions import dimensions_picture
    from mechdesign.drawing.fonts import lost_letters
    from mechdesign.drawing.layout import draw
    from mechdesign.drawing.mechanism import sketch_picture

    kinds, messages = output.formats.split(","), []
    drawings = ((MECHANISM, "the sketch as understood is", sketch_picture),
                (DIMENSIONS, "its dimensions are", dimensions_picture))  # fmt: skip
    for name, sentence, make in drawings:
        paths = [directory / f"{name}.{kind}" for kind in kinds]
        try:
            with style.context(output.style):
                figure = draw(make(study))
                drawn = {path: style.encoded(figure, path.suffix[1:]) for path in paths}
        except Exception as error:
            messages.append(f"warning: {_undrawn(paths[0].name, explain(error)[1])}")
            continue
        for path, data in drawn.items():
            write_file(path, data)
        messages.append(f"{sentence} in {', '.join(map(str, paths))}")
    messages += [f"warning: {why}" for why in [lost_letters(str(study.resolved))] if why]
    return "; ".join(messages)


def sketch(study: Study) -> bytes:
    """The sketch as it is assembled, as a PNG."""
    from mechdesign.drawing import style
    from mechdesign.drawing.layout import draw
    from mechdesign.drawing.mechanism import sketch_picture

    with style.context():
        return style.encoded(draw(sketch_picture(study)), "png")


def pictures(
    study: Study, result: Result, output: Extras, jobs: int | None = None, before: Before | None = None
) -> tuple[dict[str, bytes], tuple[Caution, ...]]:
    """Pictures of a result by their file names (of its command, the mechanism, the motion as a GIF), and warnings.

    For a report there is of each also the HTML by which it stands in a page, under its name and `INLINE`.
    """
    from mechdesign.door.report.page import vector
    from mechdesign.drawing import style
    from mechdesign.drawing.fonts import lost_letters
    from mechdesign.drawing.layout import draw
    from mechdesign.drawing.mechanism import mechanism_picture
    from mechdesign.drawing.pictures import figures
    from mechdesign.drawing.rendering import Drawing, render

    formats = output.formats.split(",")
    result = result.seen
    with style.context(output.style):
        gallery = figures(study, result, before)

        def files(name: str, make: Callable[[], Figure]) -> dict[str, bytes]:
            figure = make()
            drawn = {f"{name}.{kind}": style.encoded(figure, kind) for kind in formats}
            if output.report:
                html = vector.picture_of(result.command, name, figure, drawn.get(f"{name}.png"))
                drawn[f"{name}{INLINE}"] = html.encode()
            return drawn

        drawings: dict[str, Drawing] = {
            f"{name}.{formats[0]}": partial(files, name, partial(gallery.__getitem__, name)) for name in gallery
        }
        whose = result.whose(study)
        if not whose.is_task:
            mechanism = partial(files, MECHANISM, lambda: draw(mechanism_picture(whose, result)))
            drawings[f"{MECHANISM}.{formats[0]}"] = mechanism
        if output.animate:
            from mechdesign.questions.kinematics.drawn import DrawnMotion
            from mechdesign.questions.kinematics.figures.animation import animation

            drawings[ANIMATION] = lambda: {ANIMATION: animation(DrawnMotion.of(result).shown)}
        drawn, failed = render(drawings, jobs)
    warnings = [_undrawn(name, why) for name, why in (gallery.failed | failed).items()]
    if drawn.get(ANIMATION) == b"":
        del drawn[ANIMATION]
        warnings.append(Caution("undrawn", "no animation: it needs a sweep of one coordinate or a path"))
    warnings += [Caution("undrawn", why) for why in [lost_letters(str(study.resolved))] if why]
    return drawn, tuple(warnings)


def _inline(drawn: Iterable[str]) -> list[str]:
    return [name.removesuffix(INLINE) for name in drawn if name.endswith(INLINE)]


def _undrawn(name: str, why: str) -> Caution:
    return Caution("undrawn", f"picture {name} could not be drawn: {why}")
