"""Where can it work? The reachable region of a point, its performance indices and its boundary."""

from __future__ import annotations

from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Result
from mechdesign.ground.work.threads import one_thread
from mechdesign.questions.workspace.boundary import poses_along
from mechdesign.questions.workspace.drawn import DrawnRegion
from mechdesign.questions.workspace.ellipses import ellipses
from mechdesign.questions.workspace.point_path import point_path
from mechdesign.questions.workspace.question import questions
from mechdesign.questions.workspace.reached import Reached, reach
from mechdesign.questions.workspace.remarks import remarks, unreachable
from mechdesign.questions.workspace.tables import tables
from mechdesign.study import Study


@one_thread()
def workspace(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Region that a point reaches, its indices, local ones on a grid, and its boundary; see `mechdesign.workspace`."""
    section = study.workspace
    if section is not None and study.mechanism.mobility == 1:
        return point_path(study)
    all_questions = questions(study)
    assert section is not None
    progress.start(len(all_questions), "regions")
    regions: list[Reached] = []
    for question in all_questions:
        regions.append(reach(question))
        progress.update(1)
    full = [region for region in regions if region.patches]
    if not full:
        raise unreachable(study, all_questions)
    warnings = [caution for row, region in enumerate(regions) for caution in remarks(study, region, row)]
    counts = {"regions": len(regions), "empty": len(regions) - len(full)}
    named = {table.name: table for table in tables(study, regions)}
    field, patches = full[0].question.field, full[0].patches
    drawn = DrawnRegion(poses_along(field, patches), ellipses(field, patches))
    return Result("workspace", named, tuple(warnings), counts, drawn=drawn)
