"""The command `mechdesign` for many short calls: a process that has imported it is forked for each.

That saves a second a call.

`mechdesign` in the folder that `forked` gives stands for it in a shell: its arguments, settings, folder and streams go
to that process, and the exit code comes back. Of the pictures of a question only those are drawn that the setting
`PICTURES` names, but for a report.
"""

from __future__ import annotations

import gc
import os
import select
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

from mechdesign.__main__ import main
from mechdesign.commands import QUESTIONS
from mechdesign.drawing import pictures
from mechdesign.drawing.pictures import NamedPicture, View

PICTURES = "PICTURES_OF_PAGE"
_IMPORTED = (
    "mechdesign.door.cli.batch",
    "mechdesign.door.report.page.section",
    *(command.module for command in QUESTIONS.values()),
    *(command.figures for command in QUESTIONS.values()),
)
_LOOK = 1.0  # seconds between two looks for processes that have ended
# Imports little: it is started for each call.
_CALL = """#!{python} -IS
import os, socket, sys

with socket.socket(socket.AF_UNIX) as there:
    there.connect({address!r})
    socket.send_fds(there, [b"-"], [0, 1, 2])
    settings = (name + b"=" + value for name, value in os.environb.items())
    words = (os.getcwdb(), *settings, b"", *map(os.fsencode, sys.argv[1:]))
    there.sendall(b"".join(word + b"\\0" for word in words))
    there.shutdown(socket.SHUT_WR)
    sys.exit(int(there.recv(3) or 1))
"""


@contextmanager
def forked() -> Iterator[Path]:
    """A folder with `mechdesign`, which may be called until the context ends."""
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as listener:
        address = f"{folder}/calls"
        listener.bind(address)
        listener.listen()
        call = Path(folder) / "bin" / "mechdesign"
        call.parent.mkdir()
        call.write_text(_CALL.format(python=sys.executable, address=address), encoding="utf-8")
        call.chmod(0o755)
        number = listener.fileno()
        # It ends when its standard input does.
        with subprocess.Popen([sys.executable, __file__, str(number)], stdin=subprocess.PIPE, pass_fds=[number]):
            yield call.parent


def _serve(listener: socket.socket) -> None:
    """Fork a process for each call, until standard input ends."""
    for name in _IMPORTED:
        import_module(name)
    gc.freeze()
    keepers = 0
    while sys.stdin not in (ready := select.select([listener, sys.stdin], [], [], _LOOK)[0]):
        if ready:
            connection = listener.accept()[0]
            if os.fork() == 0:
                listener.close()
                return _keep(connection)
            connection.close()
            keepers += 1
        while keepers and os.waitpid(-1, os.WNOHANG)[0]:
            keepers -= 1
    return None


def _keep(connection: socket.socket) -> None:
    """Fork the process of a call, and say its exit code."""
    _, streams, _, _ = socket.recv_fds(connection, 1, 3)
    with connection.makefile("rb") as stream:
        place, *words, _ = stream.read().split(b"\0")
    end = words.index(b"")
    if child := os.fork():
        for own in streams:
            os.close(own)
        connection.sendall(b"%d" % (os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) % 256))
        return
    connection.close()
    for number, own in enumerate(streams):
        os.dup2(own, number)
        os.close(own)
    os.chdir(place)
    os.environ.clear()
    os.environb.update(setting.split(b"=", 1) for setting in words[:end])
    sys.argv = ["mechdesign", *map(os.fsdecode, words[end + 1 :])]
    if "--report" not in sys.argv:
        _draw_only(os.environ[PICTURES].split())
    main()


def _draw_only(names: Iterable[str]) -> None:
    """Leave out the pictures of questions that are not among these."""
    every, shown = pictures.pictures, set(names)

    def wanted(command: str) -> list[NamedPicture[View]]:
        return [picture for picture in every(command) if shown.intersection(picture.names)]

    pictures.pictures = wanted


if __name__ == "__main__":
    with socket.socket(fileno=int(sys.argv[1])) as listener:
        _serve(listener)
