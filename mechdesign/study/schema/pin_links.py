"""Which link's point is meant where a pin has a clearance: its links have that point in places of their own.

The clearance moves the pin in one link; the point's coordinates are those of the other links. An output or a limit may
name its link, ``coupler.P.x``, and then the pin moves in another one.
"""

from __future__ import annotations

from collections.abc import Mapping

from mechdesign.mechanism.graph import Graph
from mechdesign.study.build.names import Names
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.reliability import SUFFIXES, ReliabilitySection
from mechdesign.study.text.document import Path


def split_link(names: Names, name: str) -> tuple[str, str]:
    """The link that a coordinate or point is said to be of, or nothing, and the name without it."""
    link, _, rest = name.partition(".")
    if name in names.coordinates or link not in names.section.links:
        return "", name
    for suffix in reversed(SUFFIXES):
        base = rest.removesuffix(suffix) if suffix else rest
        if base.removesuffix(".x").removesuffix(".y") in names.owners:
            return link, rest
    return "", name


def said(checker: Checker, section: ReliabilitySection) -> dict[str, str]:
    """The link that outputs and limits mean by each point, where they say; what contradicts itself is noted."""
    found: dict[str, str] = {}
    given: list[tuple[Path, str, bool]] = [
        *((("reliability", "outputs", k), name, False) for k, name in enumerate(section.outputs or ())),
        *((("reliability", "limits", name), name, True) for name in section.limits),
    ]
    for path, name, at_key in given:
        link, rest = split_link(checker.names, name)
        if not link:
            continue
        point = _point(checker.names, rest)
        links = checker.names.owners[point]
        if link not in links:
            checker.reporter.report(path, f"link {link!r} has no point {point!r}; {_those(links)}", at_key=at_key)
        elif found.setdefault(point, link) != link:
            message = f"{point!r} is that of link {found[point]!r} elsewhere; all outputs and limits mean one of them"
            checker.reporter.report(path, message, at_key=at_key)
        own = section.clearances.get(point)
        if own is not None and link in links and (own.link == link or len(links) < 2):
            message = (
                f"the clearance of {point!r} moves its pin in link {link!r}, and the coordinates of {point!r} are "
                "those of what else it joins; give reliability.clearances another 'link', or none"
            )
            checker.reporter.report(path, message, at_key=at_key)
    return found


def _point(names: Names, rest: str) -> str:
    for suffix in reversed(SUFFIXES):
        base = rest.removesuffix(suffix) if suffix else rest
        if (point := base.removesuffix(".x").removesuffix(".y")) in names.owners:
            return point
    return rest


def _those(links: list[str]) -> str:
    return f"it belongs to {' and '.join(links)}"


def carrier(links: list[str], meant: str | None) -> str:
    """The link that a pin moves in where the study does not say: the last one of those that are not meant."""
    return ([link for link in links if link != meant] or links)[-1]


def others(section: ReliabilitySection | None, graph: Graph) -> Mapping[str, tuple[str, list[str]]]:
    """Of each point with a clearance the link that its pin moves in, and those whose point its coordinates are."""
    found: dict[str, tuple[str, list[str]]] = {}
    for point, clearance in (section.clearances if section is not None else {}).items():
        links = [body.removesuffix(":rod") for body, name in graph.points if name == point]
        found[point] = clearance.link or "", [link for link in dict.fromkeys(links) if link != clearance.link]
    return found


def in_words(section: ReliabilitySection | None, graph: Graph) -> list[str]:
    """One line for each clearance."""
    return [
        f"clearance: the pin {point} moves in {link}; {point}.x and {point}.y are those of "
        f"{' and '.join(rest) or 'the joint'}"
        for point, (link, rest) in others(section, graph).items()
    ]
