"""The picture of what moved between two results."""

from __future__ import annotations

import numpy as np
import pytest

from mechdesign.report.comparison.differences import Difference
from mechdesign.report.comparison.picture import differences_picture
from mechdesign.report.figures import style
from mechdesign.report.figures.layout import draw
from mechdesign.results import Column


@pytest.mark.parametrize(("change", "drawn"), [(1e-3, 1), (0.5, 2)])
def test_curves_that_lie_over_each_other_are_drawn_as_their_difference(change: float, drawn: int) -> None:
    x = np.linspace(0, 360, 13)
    old, new = np.sin(np.radians(x)), np.sin(np.radians(x)) + change
    moved = Difference("kinematics", "motion", "P.x", "moved", values=(old, new), along=Column("crank", x, "deg"))
    with style.context():
        (axes,) = draw(differences_picture([moved])).axes
    curves = [line for line in axes.get_lines() if not str(line.get_label()).startswith("_")]
    assert len(curves) == drawn
    if len(curves) == 1:
        assert np.asarray(curves[0].get_ydata()) == pytest.approx(change)
        assert curves[0].get_label() == "new \N{MINUS SIGN} old"
