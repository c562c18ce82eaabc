"""Elastic links as the stiffness takes them: the lines of their beams, and rigid brackets to what sits beside them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes

from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.model import Fixed
from mechdesign.report.figures import style
from mechdesign.study import Study

# Of the mechanism's size: nearer to a beam than this, a bracket is too short to be seen.
SHORTEST = 0.005
# Above links and slots, below pins and names.
ORDER = 3.3


def draw_beams(axes: Axes, study: Study, configuration: Configuration, index: int = 0) -> None:
    """Draw the beams of the study's elastic links in one pose of a batch, where they are not plainly the link itself.

    Those are links with brackets, and links of more than two points without ends.
    """
    if study.stiffness is None:
        return
    looks = {"elastic beam": (1.3, (0, (6, 2))), "rigid bracket": (2.2, "-")}
    told = set()
    for name in study.stiffness.elastic:
        lines = list(_lines(study, name, configuration, index))
        if len(lines) == 1 and len(lines[0][1]) < 3:
            continue
        for kind, ends in lines:
            width, dashes = looks[kind]
            axes.plot(ends.real, ends.imag, color=style.INK, linewidth=width, linestyle=dashes, zorder=ORDER,
                      label=kind if kind not in told else None)  # fmt: skip
            told.add(kind)
    if told:
        axes.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def _lines(study: Study, name: str, configuration: Configuration, index: int) -> Iterator[tuple[str, np.ndarray]]:
    """The beams of a link, all in one line, and its brackets."""
    from mechdesign.analyses.stiffness.beams import beams_of, course_of

    mechanism = study.mechanism
    link = mechanism.description.links[name]
    beams = beams_of(link)
    yield "elastic beam", np.array([np.ravel(configuration.point(corner))[index] for corner in beams.corners])
    if link.telescopic or len(beams.corners) < 2:
        return
    course = course_of(beams, configuration)
    riding = [joint.point for joint in mechanism.description.joints.values()
              if not isinstance(joint, Fixed) and joint.line.link == name]  # fmt: skip
    for point in (*link.points, *riding):
        place = configuration.point(point)
        ends = np.array([np.ravel(end)[index] for end in (course.place(course.foot(point, place)), place)])
        if abs(ends[1] - ends[0]) > SHORTEST * mechanism.size:
            yield "rigid bracket", ends
