"""Many studies: `run` answers every question of each, with one summary."""

from __future__ import annotations

import glob
import io
import os
from collections.abc import Iterator, Sequence
from contextlib import nullcontext, redirect_stderr, suppress
from dataclasses import replace
from functools import partial
from importlib import import_module
from multiprocessing.connection import wait
from pathlib import Path

from mechdesign.commands import COMMANDS, MERGE, QUESTIONS, SENSITIVITIES, SWEEP
from mechdesign.door.cli import places, terminal
from mechdesign.door.cli.annotations import annotate, of_warnings
from mechdesign.door.cli.batch_record import BatchRecord, End, Said, StudyTask, failure
from mechdesign.door.cli.docs import explained
from mechdesign.door.cli.execution import (
    HERE,
    answer,
    drawing_ahead,
    load_source,
    source,
    tell,
    write_report,
)  # fmt: skip
from mechdesign.door.cli.live_table import LiveTable, Reported
from mechdesign.door.cli.options import Options
from mechdesign.door.cli.outcome import Outcome
from mechdesign.door.cli.places import claim, folder, place
from mechdesign.door.report import manifest
from mechdesign.door.report.page import pages
from mechdesign.door.report.requirements import command_of, number_of
from mechdesign.ground.cautions import Caution, fails
from mechdesign.ground.errors import Interrupted, StudyError
from mechdesign.ground.files import owned
from mechdesign.ground.work import interrupts, shards
from mechdesign.ground.work.chunks import worker_count
from mechdesign.ground.work.pool import LOOK
from mechdesign.ground.work.processes import TaskProcess, Tell, Work
from mechdesign.ground.work.start import inherit
from mechdesign.ground.work.threads import one_thread
from mechdesign.study import Study
from mechdesign.study.loaded import StudySource, folder_name

_SUFFIXES = (".yaml", ".yml")  # of study files in a folder
_NUMBERS = 4  # key numbers of a study in the index


def questions(study: Study) -> tuple[str, ...]:
    """Commands that a study asks for, by a section or a requirement; kinematics if it asks for nothing.

    Sweeps and sensitivities, which compute the whole study many times, come last.
    """
    judged = {command_of(requirement) for requirement in study.requirements}
    commands = [command for command in COMMANDS if command in study.questions or command in judged]
    cases = [case.name for case in (SWEEP, SENSITIVITIES) if getattr(study, case.section or case.name) is not None]
    return (*(commands or ["kinematics"]), *cases)


def study_files(paths: Sequence[Path] | None) -> list[Path | None]:
    """Study files without repetitions: those named, those in a folder (``*.yaml``, ``*.yml``), those of a pattern.

    A folder or pattern without study files is returned itself.
    """
    if not paths:
        return [None]
    files: dict[str, Path] = {}
    for path in paths:
        here = [path]
        if path.is_dir():
            here = sorted(file for file in path.glob("[!.]*") if file.suffix in _SUFFIXES and file.is_file())
        elif glob.has_magic(str(path)) and not path.exists():
            here = sorted(map(Path, glob.glob(str(path), recursive=True)))
        for file in here or [path]:
            files.setdefault(os.path.abspath(file), file)
    return [*files.values()]


def source_of(path: Path | None, options: Options) -> StudySource:
    """Read one of the studies that `study_files` gives; see `source`.

    Raises
    ------
    StudyError
        Also if it is a folder or pattern without studies, or no study is named and none is here.
    """
    if path is None and not HERE.exists():
        raise StudyError(f"no study is named, and there is no {HERE} here; 'mechdesign new > {HERE}' writes one")
    if path is not None and (path.is_dir() or (glob.has_magic(str(path)) and not path.exists())):
        raise StudyError(f"{path}: there are no studies, which are files *.yaml or *.yml")
    return source(path, options)


def run(options: Options) -> int:
    """Answer every question of the studies, or repeat what manifests say; returns the exit code."""
    if options.verify is None:
        return answer_all(options.paths, options)
    from mechdesign.door.cli.compare import verify

    return verify(options)


@one_thread()
def answer_all(paths: Sequence[Path] | None, options: Options, only: Sequence[str] = ()) -> int:
    """Answer every question of the studies, or only some; returns the exit code, the highest of them all.

    Every study is read before the first is computed. Several are answered side by side, by as many processes as there
    are jobs; their messages and results come in the order of the studies. One that fails does not stop the others,
    unless `options.fail_fast`. After an interrupt the summary and the JUnit file show what was finished.
    """
    files = study_files(paths)
    several, part = len(files) > 1, options.part
    if part is not None:
        # The results of a study are those of a run without shards, in the same place.
        files, options = [*part.share(files)], replace(options, shard=None)
    alone = drawing_ahead(options) if len(files) == 1 else nullcontext()
    with LiveTable(quiet=options.quiet) as live_table, alone:
        record = BatchRecord(options, files, live_table, summed=several and part is None)
        try:
            tasks = _read(files, options, record, only, several=several)
            if tasks and not record.stopped:
                _answer(tasks, options, record)
        except KeyboardInterrupt:
            record.interrupted = True
    return record.close()


def _read(
    paths: Sequence[Path | None], options: Options, record: BatchRecord, only: Sequence[str], *, several: bool
) -> list[StudyTask]:
    """Read and check the studies; only their texts are kept."""
    tasks: list[StudyTask] = []
    inputs: list[Path] = []
    owners: dict[str, Path | None] = {}
    for number, path in enumerate(paths):
        interrupts.check()
        label, study = folder_name(path), None
        try:
            origin = source_of(path, options)
            study = load_source(origin, options)
            label = study.label
            claim(owners, study)
            root = folder(study, "", options, several=several)
            own = _as_in_shards(label, root, options) if options.command == MERGE else options
            if own != options:
                study = load_source(origin, own)
            folders = _places(only or questions(study), root, own)
            inputs += manifest.read_by(study)
            tasks.append(StudyTask(number, origin, label, root, folders, own))
        except Exception as error:
            record.missing(number, failure(label, "check", Path(), error, study))
            if record.stopped:
                return tasks
    record.check(inputs)
    return [task for task in tasks if not record.stopped and _free(task, inputs, record)]


def _free(task: StudyTask, inputs: Sequence[Path], record: BatchRecord) -> bool:
    """Whether a study's results replace no files of others, and none that one of the studies reads."""
    try:
        places.check_reports(task.root, task.options, inputs)
        for command, directory in task.questions:
            places.check(command, directory, task.options, inputs)
    except Exception as error:
        record.missing(task.number, failure(task.label, "check", Path(), error))
        return False
    return True


def _as_in_shards(label: str, root: Path, options: Options) -> Options:
    """The options with the overrides and seed of a study's shards, or of the results merged from them."""
    if options.overrides or options.seed is not None:
        return options
    folders = [root, *sorted(child for child in root.glob("*") if child.is_dir())]
    parts = [path for directory in folders for path in shards.files_in(directory)]
    origins = [shards.origin_of(parts[0])] if parts else filter(None, map(manifest.read, folders))
    for origin in origins:
        changes, seed = origin.get("overrides"), origin.get("seed")
        if isinstance(changes, list) and isinstance(seed, int):
            if changes:
                terminal.say(f"{label}: as its shards, with {', '.join(map(str, changes))}", quiet=options.quiet)
            return replace(options, overrides=[*map(str, changes)], seed=seed)
    return options


def _places(commands: Sequence[str], root: Path, options: Options) -> tuple[tuple[str, Path], ...]:
    """Questions of a study with their folders; where its sweep was divided, that alone."""
    folders = tuple((command, place(root / command, options)) for command in commands)
    if options.command != MERGE:
        return folders
    if shards.files_in(root):
        return ((SWEEP.name, root),)
    if (done := manifest.read(root)) is not None and done.get("command") in QUESTIONS:
        return ((done["command"], root),)
    return tuple(question for question in folders if shards.files_in(question[1])) or folders


def _answer(tasks: Sequence[StudyTask], options: Options, record: BatchRecord) -> None:
    """Answer the questions of the studies, in parallel if there are several.

    Raises
    ------
    KeyboardInterrupt
        When the run was interrupted, after its outcomes are recorded.
    """
    jobs = worker_count(options.jobs)
    # Work for an executor is sent from this process.
    count = min(jobs, len(tasks)) if options.executor is None else 1
    if count > 1:
        tasks = [replace(task, options=replace(task.options, jobs=jobs // count)) for task in tasks]
        if inherit() and not options.resume:
            _import(tasks, options)
    record.begin(tasks)
    work = partial(_study, tasks, record.summed)
    waiting = iter(range(len(tasks)))
    if count == 1:
        for index in waiting:
            if not record.stopped:
                record.end(index, work(index, partial(record.note, index)))
            if record.interrupted:
                raise KeyboardInterrupt
        return
    processes = [TaskProcess(work)]
    try:
        # The system may not allow so many processes.
        with suppress(OSError):
            while len(processes) < count:
                processes.append(TaskProcess(work))
        _finish(work, processes, waiting, record)
    except KeyboardInterrupt:
        record.stopped = True
        _interrupt(processes)
        _finish(work, processes, waiting, record)
        raise
    finally:
        for process in processes:
            process.close()


def _finish(work: Work, processes: list[TaskProcess], waiting: Iterator[int], record: BatchRecord) -> None:
    """Give each process one study after the other until none is left or the run stops, and record their messages.

    A process that was killed is replaced.
    """
    while True:
        for process in processes:
            if process.task is None and not record.stopped and (index := next(waiting, None)) is not None:
                process.begin(index)
        busy = {process.notes: process for process in processes if process.task is not None}
        if not busy:
            return
        for notes in wait([*busy], LOOK):
            process = busy[notes]  # type: ignore[index]
            index, stopped = process.task, record.stopped
            assert index is not None
            note = process.hear()
            if process.task is not None:
                record.note(index, note)
            else:
                record.end(index, note)
            if process.lost:
                process.close()
                processes[processes.index(process)] = TaskProcess(work)
            if record.stopped and not stopped:
                # With --fail-fast the other processes are stopped at once.
                _interrupt([other for other in processes if other is not process])
        interrupts.check()
        if record.interrupted and not record.stopped:
            raise KeyboardInterrupt
        record.live_table.show()


def _interrupt(processes: Sequence[TaskProcess]) -> None:
    for process in processes:
        process.interrupt()


def _import(tasks: Sequence[StudyTask], options: Options) -> None:
    """Import the modules of the questions once, before processes are forked."""
    for command in {command for task in tasks for command, _ in task.questions}:
        import_module(QUESTIONS[command].module)
        if not options.no_plots:
            import_module(QUESTIONS[command].figures)


def _study(tasks: Sequence[StudyTask], several: bool, index: int, hear: Tell) -> End:
    """Answer the questions of a study, and write its report even if that fails or is interrupted."""
    task = tasks[index]
    options = task.options
    words = io.StringIO()
    outcomes: list[Outcome] = []
    ended = End()

    def say(outcome: Outcome | None = None) -> None:
        hear(Said(words.getvalue(), outcome))
        words.seek(0)
        words.truncate()

    with redirect_stderr(words):
        try:
            study = load_source(task.source, options)
        except Exception as error:
            say(failure(task.label, "check", Path(), error))
            return ended
        try:
            for command, directory in task.questions:
                outcome = _question(study, command, directory, options, Reported(command, hear))
                outcomes.append(outcome)
                say(outcome)
                if outcome.exit_code and options.fail_fast:
                    break
        except KeyboardInterrupt as error:
            code, said = Interrupted.exit_code, str(error) or "interrupted"
            outcomes.append(Outcome.unanswered(study.label, command, directory, code, error, said))
            ended = End(interrupted=True)
        try:
            ended = replace(ended, entry=_page(study, task, outcomes, several=several), exit_code=_stale(study, task))
        except Exception as error:
            code, message = explained(error)
            terminal.say(f"{study.label}: report: {message}")
            ended = replace(ended, exit_code=code)
        say()
    return ended


def _question(study: Study, command: str, directory: Path, options: Options, progress: Reported) -> Outcome:
    """Answer one question and report its outcome, also if it fails."""
    try:
        with owned(directory):
            outcome = answer(study, command, directory, options, progress)
        tell(outcome, study, options, listed=terminal.is_terminal() and not options.json)
    except Exception as error:
        return failure(study.label, command, directory, error, study)
    return replace(outcome, table=None)


def _stale(study: Study, task: StudyTask) -> int:
    """Tell of results of questions that the study no longer asks; the exit code, 1 where the study bars them."""
    code, asked = 0, questions(study)
    for path in sorted(task.root.glob(f"*/{manifest.NAME}")) if os.path.isdir(task.root) else ():
        if manifest.is_stale(path.parent, study, asked):
            caution = Caution("stale", f"{path.parent} answers a question that the study does not ask; remove it")
            barred = fails(caution, study.barred)
            terminal.say(f"{study.label}: warning: {caution} [{caution.kind}]", quiet=task.options.quiet and not barred)
            annotate("error" if barred else "warning", of_warnings(study, path.parent.name, [caution]))
            code = max(code, int(barred))
    return code


def _page(study: Study, task: StudyTask, outcomes: Sequence[Outcome], *, several: bool) -> pages.IndexEntry | None:
    """Write a study's report and return its line of the index; without `--report` remove an older report."""
    options = task.options
    pages.remove(task.root / pages.PRINTED)
    if not options.report:
        pages.remove(task.root / pages.REPORT)
        return None
    left = [command for command, _ in task.questions if command not in {outcome.command for outcome in outcomes}]
    numbers = write_report(task.root, study, outcomes, options, left)
    if not several:
        return None
    from mechdesign.door.report.page.page import thumbnail

    verdicts = [verdict for outcome in outcomes for verdict in outcome.verdicts]
    return pages.IndexEntry(
        study.name,
        study.label,
        [(outcome.command, outcome.word, outcome.exit_code) for outcome in outcomes],
        met=sum(verdict.met for verdict in verdicts),
        required=sum(number_of(study, command) for command, _ in task.questions),
        warnings=len({warning for outcome in outcomes for warning in outcome.warnings}),
        numbers=numbers[:_NUMBERS],
        drawing="" if options.no_plots else thumbnail(study),
        link=f"{study.label}/{pages.REPORT}",
    )
