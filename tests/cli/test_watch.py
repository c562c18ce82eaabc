"""`watch`: answers again when a file is saved, and only then."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import threading

import pytest

from .conftest import SLIDER

PATH = SLIDER[: SLIDER.index("kinematics:")] + "kinematics: {path: {theta: angles.csv}}\n"


@pytest.fixture
def watched(folder):
    """A function that starts a watch and gives the process and a reader of its lines of messages up to a word."""
    processes = []

    def start(*arguments):
        command = [sys.executable, "-m", "mechdesign", "watch", *arguments, "--no-plots"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        processes.append(process)
        lines = queue.Queue()
        threading.Thread(target=lambda: [lines.put(line) for line in process.stderr], daemon=True).start()

        def until(word):
            found = []
            while not found or word not in found[-1]:
                found.append(lines.get(timeout=60))
            return "".join(found)

        return process, until

    yield start
    for process in processes:
        process.kill()
        process.communicate()


def test_it_answers_again_after_a_save_and_goes_on_after_a_mistake(folder, watched):
    (folder / "path.yaml").write_text(PATH)
    process, until = watched("path.yaml", "kinematics")
    # A file that is missing is one that may be saved.
    assert "angles.csv cannot be read" in until("again when")
    (folder / "angles.csv").write_text("0\n90\n")
    assert "2 rows" in until("again when")
    # The same bytes are no change.
    (folder / "angles.csv").write_text("0\n90\n")
    os.utime(folder / "path.yaml")
    # As editors save that write beside and rename.
    (folder / "new").write_text(PATH.replace("[O, A, r]", "[O, A, q]"))
    (folder / "new").replace(folder / "path.yaml")
    told = until("again when")
    assert "path.yaml:6:19: mechanism.links.crank" in told
    assert "rows" not in told
    (folder / "path.yaml").write_text(PATH)
    assert "2 rows" in until("again when")
    (folder / "angles.csv").write_text("0\n45\n90\n")
    assert "3 rows" in until("again when")
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 0


@pytest.mark.nightly
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_termination_is_no_success(folder, watched, number):
    process, until = watched("slider.yaml", "kinematics")
    until("again when")
    process.send_signal(number)
    assert process.wait(30) == 128 + number


def test_an_input_without_an_end_is_not_read(folder, watched):
    (folder / "path.yaml").write_text(PATH)
    (folder / "angles.csv").symlink_to("/dev/zero")
    process, until = watched("path.yaml", "kinematics")
    assert "is not in the folder of the study" in until("again when")
    process.send_signal(signal.SIGINT)
    assert process.wait(30) == 0


def test_what_cannot_be_watched(folder, invoke):
    for arguments, words in {
        ("slider.yaml", "kinematic"): "did you mean 'kinematics'",
        ("-",): "no file that could be watched",
        (".",): "no file that could be watched",
        ("/dev/zero",): "no file that could be watched",
    }.items():
        done = invoke("watch", *arguments)
        assert done.exit_code == 2
        assert words in done.stderr
