"""A report as a PDF, printed by a browser of this machine."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from mechdesign.ground.errors import OutputError, StudyError

# Names on the search path, and where macOS and Windows install them.
BROWSERS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge",
    "microsoft-edge-stable", "msedge", "brave-browser", "chromium-headless-shell", "chrome-headless-shell",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)  # fmt: skip
_SECONDS = 120.0  # that a browser may take
_DATE, _NODE = re.compile(rb"D:\d{14}"), re.compile(rb"node\d{8}")


def browser() -> str:
    """The first browser of this machine that prints without a window.

    Raises
    ------
    StudyError
        If there is none.
    """
    for name in BROWSERS:
        if (path := shutil.which(name)) is not None:
            return path
    raise StudyError(
        "--report pdf: no browser to print with; install Chromium, Chrome or Edge (Debian: apt install chromium), or "
        "take --report and print report.html from any browser"
    )


def pdf(page: Path) -> bytes:
    """A page as it is printed, the same at any time.

    Raises
    ------
    StudyError
        If there is no browser.
    OutputError
        If it does not print the page.
    """
    program = browser()
    # A browser refuses to run as the superuser with its sandbox.
    free = ["--no-sandbox"] if getattr(os, "geteuid", lambda: 1)() == 0 else []
    with TemporaryDirectory(prefix="mechdesign-", ignore_cleanup_errors=True) as folder:
        printed = Path(folder) / "report.pdf"
        # A page that moves is printed as it opens.
        still = ["--force-prefers-reduced-motion", "--no-pdf-header-footer"]
        options = ["--headless", "--disable-gpu", *free, f"--user-data-dir={folder}", *still]
        command = [program, *options, f"--print-to-pdf={printed}", page.resolve().as_uri()]
        try:
            done = subprocess.run(command, capture_output=True, timeout=_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise OutputError(f"{page}: {program} did not print it within {_SECONDS:g} s") from None
        except OSError as error:
            raise OutputError(f"{page}: {program} could not be run: {error.strerror or error}") from error
        if not printed.exists():
            why = done.stderr.decode(errors="replace").strip().splitlines()
            raise OutputError(f"{page}: {program} did not print it: {why[-1] if why else 'it gave no reason'}")
        data = printed.read_bytes()
    # Numbers of the page's elements differ from run to run: they are counted in the order of the file.
    nodes = {node: b"node%08d" % k for k, node in enumerate(dict.fromkeys(_NODE.findall(data)), start=1)}
    data = _NODE.sub(lambda node: nodes[node[0]], data)
    return _DATE.sub(b"D:19700101000000", data)
