"""Study files of the designs found best, which run as they are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from mechdesign.analyses.designs import in_words
from mechdesign.analyses.optimum_tables import Comparison
from mechdesign.errors import MechdesignError
from mechdesign.study import Study
from mechdesign.study.loading import load_bytes
from mechdesign.study.rewriting import rewritten


def optimum_files(study: Study, compared: Comparison, marked: Mapping[str, int]) -> tuple[dict[str, str], list[str]]:
    """Texts by file name, ``optimum.yaml`` for the first row of weights, ``optimum_2.yaml`` ..., and what is wrong.

    Parameters
    ----------
    marked : mapping of str to int
        Further designs worth a file, by its name without the suffix.
    """
    goals = [each.name for each in compared.designs.goals]
    wanted = {}
    for row, winner in enumerate(compared.winners.tolist()):
        weights = ", ".join(f"{name} {weight:g}" for name, weight in zip(goals, compared.weights[row], strict=True))
        wanted[f"optimum{f'_{row + 1}' if row else ''}"] = (
            winner,
            f"Optimum of {study.name} for the weights {weights}",
        )
    wanted |= {name: (k, f"{name.capitalize()} of the Pareto front of {study.name}") for name, k in marked.items()}
    files: dict[str, str] = {}
    doubts = []
    for name, (k, heading) in wanted.items():
        numbers = {variable: float(column[k]) for variable, column in compared.designs.variables.items()}
        found = rewritten(study, numbers, f"{heading}: {in_words(numbers)}")
        if found is None:
            doubts.append(f"no {name}.yaml: a variable has no number of its own in the study; give it one there")
            continue
        text, beside = found
        files |= {f"{name}.yaml": text, **beside}
        try:
            load_bytes(text.encode(), (study.path or Path()).parent / f"{name}.yaml")
        except MechdesignError as error:
            doubts.append(f"{name}.yaml needs a hand: {str(error).splitlines()[0]}")
    return files, doubts
