"""The verification manual: a page for every case of tests/reference/cases, with the numbers of the run that writes it.

python docs/verification.py [NAME...]      runs these cases, or all, prints their tables; fails where one differs
"""

from __future__ import annotations

import importlib
import math
import platform
import re
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import scipy
from cases import EVIDENCE, Case, Row, cases, half_unit, setting, shown
from gallery import ROOT, picture, results
from markup import table
from steps import step

import mechdesign
from mechdesign.commands import QUESTIONS

DIGITS = 15  # of two numbers that are the same


def agreement(row: Row) -> str:
    """How far a number agrees, in digits."""
    if row.bound or row.note:
        right = f", {float(row.right):.6g} is right" if row.right else ""
        return "see the note" + right if row.note else "holds"
    printed = len(re.sub(r"[eE].*|[-.]", "", row.printed).lstrip("0")) or 1
    if row.printed and row.difference <= half_unit(row.printed):
        return f"all {printed} printed"
    digits = DIGITS if row.part < 10.0**-DIGITS else math.floor(-math.log10(row.part))
    return f"{digits} of {printed} printed" if row.printed else str(digits)


def cells(row: Row, letter: str = "") -> list[str]:
    """A number as a line of a page's table; the letter is that of its note."""
    label = row.label if row.named else f"`{row.label}`"
    label += f" ({row.unit})" if row.unit and not row.label.endswith(")") else ""
    if row.count > 1:
        label += f", all {row.count} rows" if row.bound else f", largest difference of {row.count}"
    ours = shown(row.ours) + (f"{{sup}}`{letter}`" if letter else "")
    difference = "" if row.bound else f"{row.difference:.1e}" if row.difference else "0"
    return [label, row.bound or row.printed or shown(row.expected), ours, difference, agreement(row)]


def command(case: Case) -> str:
    """What answers the question of a case in a terminal."""
    name = f"{case.name}.yaml" if case.shipped is None else case.shipped.relative_to(ROOT).as_posix()
    first = {**case.settings, **next(case.variants())}
    options = "".join(f" \\\n    --set '{name}={setting(value)}'" for name, value in first.items())
    return f"mechdesign {case.question} {name}{options}"


def formulas(case: Case) -> str:
    """The closed forms of a case, as they are evaluated."""
    lines = [f"{name} = {value}" for name, value in case.values.items()]
    forms = ((check["of"], check.get("expected")) for check in case.checks)
    lines += [f"{ours} = {form.strip()}" for ours, form in forms if isinstance(form, str)]
    return f"```text\n{chr(10).join(dict.fromkeys(lines))}\n```" if lines else ""


def helpers(case: Case) -> str:
    """Where the functions stand that a case calls besides NumPy's."""
    text, places = str([case.values, case.checks]), []
    for name in dict.fromkeys(filter(None, (case.helper, "gallery"))):
        own = vars(importlib.import_module(f"helpers.{name}")).items()
        functions = [function for function, value in own if getattr(value, "__module__", "") == f"helpers.{name}"]
        if re.search(rf"(?<![\w.])({'|'.join({*functions} - {'point'})})\(", text):
            places.append(f"`tests/helpers/{name}.py`")
    return f"Functions that are not NumPy's stand in {' and '.join(places)}." if places else ""


def page(case: Case, rows: Sequence[Row]) -> str:
    """The page of a case."""
    notes = list(dict.fromkeys(row.note for row in rows if row.note))
    letters = {note: chr(ord("a") + number) for number, note in enumerate(notes)} | {"": ""}
    head = ["quantity", "printed" if case.evidence == "printed" else "expected", "ours", "difference", "digits"]
    parts = ["---\norphan: true\n---", f"# {case.title}", case.text.strip()]
    parts += [f"Question: `{case.question}`. Compared with {EVIDENCE[case.evidence]}.", f"**Source.** {case.source}."]
    parts.append(table(head, *(cells(row, letters[row.note]) for row in rows)))
    parts += [f"{{sup}}`{letters[note]}` {note}" for note in notes]
    parts.append(formulas(case))
    parts.append(helpers(case))
    if case.shipped is None:
        listing = f"```{{code-block}} yaml\n:caption: {case.name}.yaml\n\n{case.study.strip()}\n```"
    else:
        place, folder = case.shipped.relative_to(ROOT).as_posix(), results(case.shipped)
        image = picture(folder / case.question) or picture(folder)
        parts.append(f"![{case.title}](../../{image.relative_to(ROOT).as_posix()})" if image else "")
        listing = f"`{place}`, with a [page in the gallery](../gallery/{case.shipped.stem}.md):\n\n"
        listing += f"```{{literalinclude}} ../../{place}\n:language: yaml\n```"
    parts += ["## The study", listing, f"```sh\n{command(case)}\n```"]
    parts.append(f"This table again: `python docs/verification.py {case.name}`.")
    return "\n\n".join(filter(None, parts)) + "\n"


def largest(differences: Iterable[float]) -> str:
    """The largest of some differences, in words."""
    return f"{max(differences):.0e}".replace("0e+00", "0")


def work(case: Case) -> str:
    """The book, paper or program that a case is from, without the place in it; else what it is compared with."""
    match = re.search(r"(?:^|after |; )((?:[A-Z][\w.-]*\.?[ -])+[^;*]*\*[^*]+\*|ISO \d+|The public program \S+\w)",
                      case.source)  # fmt: skip
    return match[1] if match else f"{case.evidence}, of no book"


def overview(ran: Mapping[str, Sequence[Row]]) -> str:
    """The page of all cases."""
    every = [cases()[name] for name in ran]
    counts = Counter((case.question, case.evidence) for case in every)
    lines = []
    questions = [question for question in QUESTIONS if any(case.question == question for case in every)]
    for question in questions:
        numbers = [counts[question, evidence] for evidence in EVIDENCE]
        lines.append([f"[{question}](#{question})", *map(str, numbers), str(sum(numbers))])
    totals = [sum(case.evidence == evidence for case in every) for evidence in EVIDENCE]
    lines.append(["**all**", *map(str, totals), str(len(every))])
    versions = (f"mechdesign {mechdesign.__version__}, Python {platform.python_version()}, NumPy {np.__version__}, "
                f"SciPy {scipy.__version__}")  # fmt: skip
    parts = [
        "# Verification manual",
        f"{len(every)} cases with numbers that do not come from mechdesign. Every page has its study, which can be "
        "copied and run, the numbers beside ours, and why a printed number is wrong where one is. The numbers are "
        f"those of the run that has written these pages ({versions}), of the dearest optimisations and simulations "
        "those of `results/`. A test carries out the same cases at every change, the dear ones each night, and "
        "compares `results/` too.",
        "```sh\npython docs/verification.py\n```",
        "runs them all and prints the tables of this manual; with names, the cases of these names.",
        table(["question", *EVIDENCE, "cases"], *lines),
        "[Below](#sources) they are counted by their sources.",
        "\n".join(f"- *{evidence}*: {words}" for evidence, words in EVIDENCE.items()),
        "The difference of a case is its largest, as a part of the largest number compared. Of printed numbers it is "
        "mostly that of their rounding; of a misprint it is that from what is right. Intervals of samples and limits "
        "have none. Places are complex numbers: `point('P')` is x + iy.",
    ]
    for question in questions:
        lines = []
        for case in (case for case in every if case.question == question):
            rows = ran[case.name]
            noted = sum(bool(row.note) for row in rows)
            number = f"{len(rows)}" + (f", {noted} with notes" if noted else "")
            worst = largest(row.part for row in rows)
            lines.append([f"[{case.title}]({case.name}.md)", case.source, case.evidence, number, worst])
        parts += [f"## {question}", table(["case", "source", "compared with", "numbers", "difference"], *lines)]
    works: dict[str, list[float]] = {}
    for case in every:
        works.setdefault(work(case), []).append(max(row.part for row in ran[case.name]))
    lines = [[name, str(len(differences)), largest(differences)] for name, differences in sorted(works.items())]
    parts += ["## Sources", table(["source", "cases", "largest difference"], *lines)]
    return "\n\n".join(parts) + "\n"


def wrong(case: Case, rows: Sequence[Row]) -> list[str]:
    """What does not agree in a case, in words."""
    return [f"{case.name}: {row.label}: {shown(row.ours)} for {row.bound or row.printed or shown(row.expected)}"
            for row in rows if not row.agrees]  # fmt: skip


def pages() -> dict[str, str]:
    """The texts of all pages, by their paths in the folder of the site.

    Raises
    ------
    ValueError
        If a number differs.
    """
    ran = {}
    for name, case in cases().items():
        with step(f"case {name}"):
            ran[name] = list(case.rows(recorded=True))
        if differs := wrong(case, ran[name]):
            raise ValueError("\n".join(differs))
    texts = {"verification/index.md": overview(ran)}
    return texts | {f"verification/{name}.md": page(cases()[name], rows) for name, rows in ran.items()}


def main() -> int:
    """Run the cases of these names, or all, and print their tables."""
    differs = []
    if unknown := [name for name in sys.argv[1:] if name not in cases()]:
        print(f"no case {', '.join(unknown)}; there are {', '.join(cases())}", file=sys.stderr)
        return 2
    for name in sys.argv[1:] or cases():
        rows = list(cases()[name].rows())
        print(f"{cases()[name].title} ({name})")
        for row in rows:
            label, expected, ours, difference, digits = cells(row)
            print(f"  {label:50} {expected:>24} {ours:>24} {difference:>9}  {digits if row.agrees else 'DIFFERS'}")
        differs += wrong(cases()[name], rows)
    print(*differs, sep="\n")
    return int(bool(differs))


if __name__ == "__main__":
    sys.exit(main())
