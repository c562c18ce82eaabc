"""The page of benchmarks: its command does the same work on all sides, and its numbers are those of the stored run."""

from __future__ import annotations

import re
import statistics
from pathlib import Path

import benchmarks
import path_peers
import path_problems
import pytest
from benchmark_rows import ROWS

ROOT = Path(__file__).parents[2]
QUICK = ("positions", "turns", "robots", "precision", "arms", "forces")


@pytest.mark.parametrize("name", [
    *QUICK, *(pytest.param(name, marks=pytest.mark.nightly) for name in ROWS if name not in QUICK)
])  # fmt: skip
def test_all_sides_of_a_row_find_the_same_and_are_timed(name: str) -> None:
    """C, NumPy and pylinkage share nothing with the package; `compare` ends where they differ."""
    ratios = benchmarks.compare(ROWS[name], rounds=2, share=0.001)
    assert all(len(of_rounds) == 2 and min(of_rounds) > 0 for of_rounds in ratios.values())


def test_a_side_that_finds_something_else_ends_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("floors.five_bar_ranges", lambda *sizes: 1.1 + 0 * sizes[0])
    with pytest.raises(ValueError, match=r"NumPy is .* apart from mechdesign"):
        benchmarks.compare(ROWS["robots"], rounds=1, share=0.001)


def test_the_command_prints_a_row_and_leaves_the_stored_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = benchmarks.MEASURED.read_bytes()
    monkeypatch.setattr("sys.argv", ["benchmarks.py", "robots", "--rounds", "1"])
    benchmarks.main()
    head, _, row = capsys.readouterr().out.strip().splitlines()
    assert head == "| our time over that of | C | NumPy | pylinkage |"
    assert re.match(r"\| \*\*Designs of a five-bar\.\*\* .*\| \*\*\d+\*\* \(\d+ to \d+\) \|", row)
    assert benchmarks.MEASURED.read_bytes() == before
    monkeypatch.setattr("sys.argv", ["benchmarks.py", "no_such_row"])
    with pytest.raises(SystemExit):
        benchmarks.main()
    assert "no row no_such_row" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["benchmarks.py"])
    monkeypatch.setattr(benchmarks, "has_pylinkage", lambda: False)
    with pytest.raises(SystemExit):
        benchmarks.main()
    assert "a run that is stored has all peers" in capsys.readouterr().err
    assert benchmarks.MEASURED.read_bytes() == before


def test_the_tables_are_those_of_the_stored_run() -> None:
    data, pages = benchmarks.measured(), benchmarks.pages()
    assert list(data["rows"]) == list(ROWS)
    assert data["paths"].keys() == {problem.name for problem in path_problems.problems()}
    lines = [line for line in pages["_benchmarks_rows.md"].splitlines() if line.startswith("| **")]
    assert len(lines) == len(ROWS)
    for (name, ratios), line in zip(data["rows"].items(), lines, strict=True):
        # Every row stands beside somebody, in as many rounds as the page says; who is missing has a reason.
        assert ratios
        assert ("pylinkage" in ratios) != bool(ROWS[name].without)
        shown = re.findall(r"\*\*([\d.]+)\*\* \(([\d.]+) to ([\d.]+)\)", line)
        assert len(shown) == len(ratios)
        for numbers, of_rounds in zip(shown, ratios.values(), strict=True):
            assert len(of_rounds) == data["rounds"] >= 5
            expected = statistics.median(of_rounds), min(of_rounds), max(of_rounds)
            assert [float(number) for number in numbers] == pytest.approx(expected, rel=0.06)
    for key in ("date", "processor", "processors"):
        assert str(data["machine"][key]) in pages["_benchmarks_run.md"]
    assert {"numpy", "scipy", "pylinkage", "C compiler"} <= data["machine"]["versions"].keys()


def test_the_stored_run_of_the_grid_is_as_exact_as_the_page_says() -> None:
    errors = benchmarks.measured()["accuracy"]
    assert errors["mechdesign"] < 1e-4
    assert errors["C, 64 × 72 nodes between the poles"] < 1e-4
    assert errors["C, 300 × 200 even nodes"] > 1e-2


def test_stored_errors_of_paths_are_those_of_the_linkages() -> None:
    """Printed linkages are measured anew; differential evolution has no better linkage anywhere."""
    for problem in path_problems.problems():
        errors = benchmarks.measured()["paths"][problem.name]
        assert errors["mechdesign"] <= errors["evolution"]
        if problem.printed is not None:
            assert errors["printed"] == pytest.approx(problem.printed.error(problem.points) / problem.size, rel=0.01)


@pytest.mark.slow
def test_differential_evolution_finds_a_curve_that_it_may_draw() -> None:
    """Points of a circle: the coupler point on the crank's pin draws them."""
    problem = next(problem for problem in path_problems.problems() if problem.name == "arc")
    bar = path_peers.evolved(problem, 0.3)
    assert bar.error(problem.points) < 0.1 * problem.size


def test_the_page_shows_all_tables_and_the_command() -> None:
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\{include\} (\S+)", page)) == set(benchmarks.pages())
    assert "python docs/benchmarks.py" in page
