"""`live`: a page on this machine in which a study is changed by hand."""

from __future__ import annotations

import os
import tempfile
import webbrowser
from contextlib import suppress
from functools import partial
from html import escape
from pathlib import Path

from mechdesign.door.cli import terminal
from mechdesign.door.cli.execution import STANDARD_INPUT, load_study
from mechdesign.door.cli.options import Options
from mechdesign.door.cli.watch import await_change, contents_of, files_named
from mechdesign.door.live.server import LiveServer
from mechdesign.door.live.task import session_of
from mechdesign.ground.errors import StudyError, counted
from mechdesign.ground.work.threads import one_thread


@one_thread()
def live(options: Options) -> int:
    """Serve the page of a study until an interrupt, and read the study again whenever it is saved. Returns 0.

    Raises
    ------
    StudyError
        If the study is no file, is wrong when it begins, or the port is taken.
    """
    path = options.path
    assert path is not None
    if path == STANDARD_INPUT or (path.exists() and not path.is_file()):
        raise StudyError(f"{path}: is no file that could be saved again")
    session = session_of(load_study(path, options), partial(load_study, path, options))
    session.page()
    try:
        server = LiveServer(session, options.port or 0)
    except OSError as error:
        raise StudyError(f"--port {options.port}: {error.strerror}") from None
    server.start()
    terminal.say(f"{path}: live at {server.url} until Ctrl-C", quiet=options.quiet)
    with tempfile.TemporaryDirectory(prefix="mechdesign-") as folder, suppress(KeyboardInterrupt):
        if not options.no_browser:
            _open(server.url, Path(folder))
        contents = contents_of({path, *files_named(path, options)})
        while True:
            await_change(contents)
            session.reload()
            contents = contents_of({path, *files_named(path, options)})
    terminal.say(f"{path}: ended; {counted(server.close(), 'page')} open", quiet=options.quiet)
    if server.computing:
        # Its thread would meet an interpreter that is gone; nothing is being written.
        os._exit(0)
    return 0


def _open(url: str, folder: Path) -> None:
    """Open an address in the browser by a file that only its owner can read: others see the words of a command."""
    file = folder / "live.html"
    with open(os.open(file, os.O_CREAT | os.O_WRONLY, 0o600), "w", encoding="utf-8") as stream:
        stream.write(f'<!doctype html><meta http-equiv="refresh" content="0;url={escape(url)}">')
    with suppress(webbrowser.Error):
        webbrowser.open(file.as_uri())
