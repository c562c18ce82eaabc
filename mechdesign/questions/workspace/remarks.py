"""Warnings about regions: pieces and areas left out, errors, singularities; and why nothing is reached."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.numerals import numeral
from mechdesign.questions.workspace.inscribed import crossed
from mechdesign.questions.workspace.question import Question
from mechdesign.questions.workspace.reached import Reached
from mechdesign.questions.workspace.schema import WorkspaceSection
from mechdesign.study import Study

# An area is doubtful whose error is a larger part of it.
AREA_SURE = 1e-3
_SINGULARITIES = {"forward": "parallel", "inverse": "serial"}
ROOTLESS = "no pose of the mechanism reaches the held values from the sketch; redraw the sketch at those values"


def remarks(study: Study, region: Reached, row: int) -> Iterator[Caution]:
    """Warnings about one region, which is a row of the indices."""
    question, there = region.question, region.question.where
    if region.singular:
        words = f"every pose{there} is a forward singularity: indices have no value"
        yield Caution("singular", words, "indices", row)
    else:
        yield from _doubts(region)
    if len(region.areas) > 1 and question.field.same_assembly:
        yield _left_out(study, region)
    if region.beyond > max(region.areas, default=0.0):
        yield _in_other_assembly(study, region)
    if region.patches:
        yield from _crossed(region, row)


def _crossed(region: Reached, row: int) -> Iterator[Caution]:
    """A warning where singularities cross the largest shapes inside, which no motion can then use as a whole."""
    crossing: dict[str, list[str]] = {}
    for locus in region.loci:
        for name in crossed(region.shapes, locus.points):
            crossing.setdefault(name, []).append(f"{_SINGULARITIES[locus.kind]} singularity ({locus.cause})")
    if crossing:
        shapes, causes = " and ".join(crossing), ", ".join(dict.fromkeys(chain.from_iterable(crossing.values())))
        yield Caution(
            "singular",
            f"the largest {shapes} inside the region{region.question.where} "
            f"{'is' if len(crossing) == 1 else 'are'} crossed by a {causes}: only motion that passes it uses the "
            "whole; 'assembly: same' gives the largest without a parallel singularity",
            "indices", row,
        )  # fmt: skip


def unreachable(study: Study, questions: Sequence[Question]) -> AssemblyError:
    """The error where no region has a place."""
    section, question = WorkspaceSection.of(study), questions[0]
    field, about = question.field, question.about
    there = " at" * bool(question.held) + ";".join(other.where.removeprefix(" at") for other in questions)
    if field.rootless:
        return AssemblyError(f"point {section.point} reaches nothing{there}: {ROOTLESS}")
    assembly = " in the sketch's assembly" if field.same_assembly else ""
    return AssemblyError(
        f"point {section.point} reaches nothing{there} on the scan about ({about.real:g}, {about.imag:g}): "
        f"its links cannot close there{assembly}, or a limit forbids it; move scan.about, or widen the limits"
    )


def _doubts(region: Reached) -> Iterator[Caution]:
    """Warnings where a region is empty, and where its area or the means over it are not known closely."""
    question, values, errors = region.question, region.answer.values, region.answer.errors
    there = question.where
    if not region.patches:
        assembly = " in the sketch's assembly" if question.field.same_assembly else ""
        words = f"nothing is reachable{there}" + (f": {ROOTLESS}" if question.field.rootless else assembly)
        yield Caution("unassembled", words, "indices")
        return
    error = errors["area"][0]
    if error > AREA_SURE * values["area"][0]:
        yield Caution(
            "unconverged",
            f"the area{there} is only known to {error:.2g}: a limit begins and ends too often along its rays or "
            "between them, or a raster of places that are reached shows more than the integral has found; put "
            "scan.about into the region, take more rays, or state limits that oscillate less",
            "indices",
        )
    for name in ("GII", "GRI"):
        error = errors[name][0]
        if question.rule == "gauss" and not error <= 2 * question.tolerance * abs(values[name][0]):
            words = f"{name}{there} is only known to {error:.1g}, not to the tolerance asked for"
            yield Caution("unconverged", words, "indices")


def _left_out(study: Study, region: Reached) -> Caution:
    """That the indices are of one piece, and what is left out."""
    areas, pieces = region.areas, region.answer.pieces
    drawn = pieces is not None and pieces.drawn[0]
    one = "of the piece that holds the sketch" if drawn else "of the largest (the sketch lies in none)"
    many, unit = len(areas) - 1, study.units.label("area")
    left = (
        f"{'another' if many == 1 else f'{many} others, together'} of area {numeral(sum(areas[1:]), 4)} {unit}".rstrip()
    )
    return Caution(
        "incomplete",
        f"the region{region.question.where} has {len(areas)} pieces that do not hang together: indices are {one}; "
        f"{left} {'is' if many == 1 else 'are'} left out ('assembly: any' counts all)",
        "pieces",
    )


def _in_other_assembly(study: Study, region: Reached) -> Caution:
    """That more lies in other assemblies than in the piece that is reported, with both areas."""
    unit = study.units.label("area")
    inside, beyond = (f"{numeral(area, 3)} {unit}".rstrip() for area in (sum(region.areas[:1]), region.beyond))
    return Caution(
        "incomplete",
        f"more of the region{region.question.where} lies beyond a forward singularity or with other elbows, in another "
        f"assembly: about {beyond}, and {inside} here; 'assembly: any' counts all, or redraw the sketch there",
        "indices",
    )
