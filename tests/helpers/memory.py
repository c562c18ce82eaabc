"""Peak memory of a command, whatever the process that asks has used before.

A child begins with its parent's pages, and the system counts them as its own peak: a small process stands between.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

_BETWEEN = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(code)
"""


def peak_of(command: Sequence[str], timeout: float = 120) -> int:
    """Bytes that one process of a command used at most; it must succeed, within so many seconds."""
    done = subprocess.run(
        [sys.executable, "-S", "-c", _BETWEEN, *command], capture_output=True, text=True, check=True, timeout=timeout
    )
    return int(done.stdout) * (1 if sys.platform == "darwin" else 1024)
