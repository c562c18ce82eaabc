"""The studies of configs/gallery, and the geometry that they are checked with: circles, written without the package."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from mechdesign import load
from mechdesign.ground.results import Result
from mechdesign.questions.kinematics.analysis import kinematics
from mechdesign.study import Study

FOLDER = Path(__file__).parents[2] / "configs" / "gallery"


def study_named(name: str, *overrides: str) -> Study:
    """Load a study of the gallery."""
    return load(FOLDER / f"{name}.yaml", overrides)


def result_of(name: str, *overrides: str) -> Result:
    """Ask a study of the gallery what its kinematics section asks."""
    return kinematics(study_named(name, *overrides))


def point(table, name: str):
    """Path of a point as complex numbers."""
    return table[f"{name}.x"] + 1j * table[f"{name}.y"]


def unit(degrees):
    """Directions as complex numbers."""
    return np.exp(1j * np.radians(degrees))


def meet(p, r, q, s, side: int):
    """Where a circle of radius r about p meets one of radius s about q, left (side 1) or right (-1) of p to q."""
    span = q - p
    distance = np.abs(span)
    along = (distance**2 + r**2 - s**2) / (2 * distance)
    return p + span / distance * (along + 1j * side * np.sqrt(r**2 - along**2))


def rates(function: Callable, at, step: float = 2e-3):
    """First and second derivative by central differences of the fourth order."""
    far, near = function(at + 2 * step) - function(at - 2 * step), function(at + step) - function(at - step)
    wide, close = function(at + 2 * step) + function(at - 2 * step), function(at + step) + function(at - step)
    return (8 * near - far) / (12 * step), (16 * close - wide - 30 * function(at)) / (12 * step**2)


def row(table, output: str) -> dict[str, float]:
    """One output's row of the table of extremes."""
    k = list(table["output"]).index(output)
    return {column.name: column.values[k] for column in table.columns}
