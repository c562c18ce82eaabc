"""Folders of results, and the check that no other files are replaced in them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from unicodedata import normalize

from mechdesign.commands import MERGE, SWEEP
from mechdesign.door.cli.options import PDF, STYLES, Options
from mechdesign.door.report import manifest
from mechdesign.door.report.manifest import Extras
from mechdesign.door.report.page import pages
from mechdesign.ground.errors import StudyError
from mechdesign.ground.records import check_replaceable
from mechdesign.ground.work import shards
from mechdesign.ground.work.journal import NAME
from mechdesign.study import Study

RESULTS = Path("results")  # default folder
# Names of files about several studies, beside their folders.
SUMMARY = "summary.csv"
_SHARED = (SUMMARY, pages.INDEX)
# Commands that can resume after an interrupt.
RESUMED = ("optimize", SWEEP.name)


def folder(study: Study, name: str, options: Options, *, several: bool = False) -> Path:
    """Folder of a command's results; with several studies each has a folder inside that of `--out`."""
    if options.out is None:
        return RESULTS / study.label / name
    return options.out / study.label if several else options.out


def place(directory: Path, options: Options) -> Path:
    """Folder that a command writes in; each shard has its own, as several are written at the same time."""
    return directory if options.part is None else directory / options.part.folder


def claim(owners: dict[str, Path | None], study: Study) -> None:
    """Reserve the folder of a study's name; `owners` maps folders to study files.

    Raises
    ------
    StudyError
        If another file of that name has it.
    """
    # Windows and macOS take names for one that differ in case, or in how an accent is written.
    name = normalize("NFC", study.label).casefold()
    if name in _SHARED:
        raise StudyError(f"{study.path}: its folder of results would have the name of a file of all; rename the study")
    owner = owners.setdefault(name, study.path)
    if owner != study.path:
        raise StudyError(f"{study.path}: its results would overwrite those of {owner}; rename one of the files")


def extras(command: str, options: Options) -> Extras:
    """Pictures and reports that the options ask of a command."""
    animate = options.animate and command == "kinematics"
    look = options.style or STYLES[0]
    return Extras(not options.no_plots, options.kinds, animate, options.all_modes, bool(options.report), look)


def check(command: str, directory: Path, options: Options, read: Sequence[Path]) -> None:
    """Check before a computation that its files replace no others, and none that is `read`.

    Raises
    ------
    StudyError
        If they would; it names the file.
    OutputError
        If the folder takes no files.
    """
    if options.part is not None:
        check_replaceable(directory / shards.FILE, read, whole=False)
        return
    manifest.check_folder(directory, command, extras(command, options), read)
    # A merge removes those that it has read.
    for part in shards.files_in(directory) if os.path.isdir(directory) and options.command != MERGE else ():
        check_replaceable(part, read, whole=False)
    if command in RESUMED:
        check_replaceable(directory / NAME, read)
    check_reports(directory, options, read)


def check_reports(directory: Path, options: Options, read: Sequence[Path]) -> None:
    """Check that the reports that are asked replace no other files, and none that is `read`.

    Raises
    ------
    StudyError
        If they would; it names the file.
    """
    for name in [pages.REPORT] * bool(options.report) + [pages.PRINTED] * (options.report == PDF):
        check_replaceable(directory / name, read)
