"""The version of mechdesign, and versions of what is installed beside it."""

from __future__ import annotations

import re
import sysconfig
from functools import cache
from pathlib import Path

VERSION = "1.0.0"  # Written here alone: the build reads it.


@cache
def _beside() -> dict[str, str]:
    """Versions of the packages of this environment, by the names of their folders."""
    folders = (path.stem.rpartition("-") for path in Path(sysconfig.get_path("purelib")).glob("*.dist-info"))
    return {re.sub(r"[-_.]+", "-", name).lower(): version for name, _, version in folders}


def installed(name: str) -> str:
    """The version of a package.

    Of those of this environment it is read from the name of a folder: `importlib.metadata` reads and parses a file of
    each, and takes as long as a motion. It is asked for packages that lie elsewhere.

    Raises
    ------
    importlib.metadata.PackageNotFoundError
        If it is not installed.
    """
    if name in _beside():
        return _beside()[name]
    from importlib.metadata import version

    return version(name)
