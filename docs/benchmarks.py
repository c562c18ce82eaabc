"""How fast, beside the same work by hand and beside other packages: ratios of one run.

python docs/benchmarks.py [--rounds N]     measures all, writes benchmarks_measured.yaml, and prints the tables
python docs/benchmarks.py ROW...           prints these rows alone
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import subprocess
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import floors
import numpy as np
import path_peers
import path_problems
import yaml
from benchmark_rows import OURS, PEERS, ROWS, Row, accuracy, has_pylinkage
from markup import table

import mechdesign

MEASURED = Path(__file__).parent / "benchmarks_measured.yaml"
ROUNDS = 9


def compare(row: Row, rounds: int, share: float = 1) -> dict[str, list[float]]:
    """Our processor time over that of each other side, round by round; all take turns in each round.

    Raises
    ------
    ValueError
        If a side does not find our numbers.
    """
    sides = row.sides(share)
    expected = np.asarray(sides[OURS].numbers(sides[OURS].work()))
    for name, side in sides.items():
        apart = np.abs(np.asarray(side.numbers(side.work())) - expected).max() / np.abs(expected).max()
        if not apart <= side.within:
            message = f"{row.title}: {name} is {apart:.2g} apart from {OURS}"
            raise ValueError(message)
    ratios: dict[str, list[float]] = {name: [] for name in sides if name != OURS}
    for _ in range(rounds):
        seconds = {}
        for name, side in sides.items():
            begin = time.process_time()
            side.work()
            seconds[name] = (time.process_time() - begin) / side.part
        for name, of_rounds in ratios.items():
            of_rounds.append(float(f"{seconds[OURS] / seconds[name]:.3g}"))
    return ratios


def machine() -> dict[str, Any]:
    """What a run was on."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    versions = {"mechdesign": mechdesign.__version__, "Python": platform.python_version()}
    packages = {distribution.metadata["Name"].lower(): distribution.version
                for distribution in importlib.metadata.distributions()}  # fmt: skip
    versions |= {name: packages[name] for name in ("numpy", "scipy", "pylinkage", "numba") if name in packages}
    if (program := floors.compiler()) is not None:
        said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
        versions["C compiler"] = said.partition("\n")[0]
    return {
        "date": datetime.now(UTC).date().isoformat(), "processor": names[0] if names else platform.processor(),
        "processors": os.cpu_count(), "system": f"{platform.system()} {platform.machine()}", "versions": versions,
    }  # fmt: skip


def measured() -> dict[str, Any]:
    """What the stored run has measured."""
    return dict(yaml.safe_load(MEASURED.read_text(encoding="utf-8")))


def spread(ratios: list[float]) -> str:
    """The median of ratios, and between which they are."""
    shown = [
        f"{value:.2g}" if value < 100 else f"{value:.0f}" for value in (np.median(ratios), min(ratios), max(ratios))
    ]
    return "**{}** ({} to {})".format(*shown)


def rows_table(data: Mapping[str, Mapping[str, list[float]]]) -> str:
    """Our time over that of others, row by row."""
    lines = []
    for name, ratios in data.items():
        missing = {"pylinkage": ROWS[name].without}
        cells = [spread(ratios[peer]) if peer in ratios else missing.get(peer, "") for peer in PEERS]
        lines.append([f"**{ROWS[name].title}.** {ROWS[name].text}", *cells])
    return table(["our time over that of", *PEERS], *lines)


def paths_table(data: Mapping[str, Mapping[str, float | str]]) -> str:
    """Errors of linkages for the ten path problems."""

    def cell(error: float | str) -> str:
        return error if isinstance(error, str) else f"{error:.2g}" if error > path_problems.EXACT else "0"

    lines = []
    for problem in path_problems.problems():
        errors = dict(data[problem.name])
        if len(problem.points) > path_peers.PRECISE:
            errors["pylinkage"] = "three to five points only"
        cells = [cell(errors.get(name, "")) for name in (OURS, "printed", "evolution", "pylinkage")]
        lines.append([problem.title, *cells])
    return table(["error over size", OURS, "printed", "differential evolution", "pylinkage"], *lines)


def pages() -> dict[str, str]:
    """What the page of benchmarks includes, by paths in the folder of the site."""
    data = measured()
    on = data["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in on["versions"].items())
    where = f"{on['date']}, {on['processor']} with {on['processors']} processors, {on['system']}"
    errors = [[name, f"{error:.2g}"] for name, error in data["accuracy"].items()]
    return {
        "_benchmarks_run.md": f"{where}, {data['rounds']} rounds; {versions}.\n",
        "_benchmarks_rows.md": rows_table(data["rows"]) + "\n",
        "_benchmarks_accuracy.md": table(["isotropy and resistivity by", "largest relative error"], *errors) + "\n",
        "_benchmarks_paths.md": paths_table(data["paths"]) + "\n",
    }


def main() -> None:
    """Measure all, write it, and print the tables; of named rows print the ratios alone."""
    parser = argparse.ArgumentParser(description="Time of mechdesign over that of others.")
    parser.add_argument("rows", nargs="*", metavar="ROW", help=f"print these alone: {', '.join(ROWS)}")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="left out: %(default)s")
    given = parser.parse_args()
    if unknown := set(given.rows) - set(ROWS):
        parser.error(f"no row {', '.join(sorted(unknown))}")
    if not given.rows and (floors.compiler() is None or not has_pylinkage()):
        parser.error(
            "a run that is stored has all peers: a C compiler, and pip install -e '.[benchmark]', or name rows"
        )
    data = {"machine": machine(), "rounds": given.rounds}
    data["rows"] = {name: compare(ROWS[name], given.rounds) for name in given.rows or ROWS}
    print(rows_table(data["rows"]))
    if not given.rows:
        data["accuracy"] = accuracy()
        data["paths"] = {
            problem.name: path_peers.errors_of(problem, pylinkage=has_pylinkage())
            for problem in path_problems.problems()
        }
        print(paths_table(data["paths"]))
        text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=120, default_flow_style=None)
        MEASURED.write_text(f"# What `python docs/benchmarks.py` has measured in one run.\n{text}", encoding="utf-8")


if __name__ == "__main__":
    main()
