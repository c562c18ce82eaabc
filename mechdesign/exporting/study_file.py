"""The study as JSON, which is YAML too: with its overrides, its name, its seed and all of its units."""

from __future__ import annotations

import json
from typing import Any

from mechdesign.cautions import Caution
from mechdesign.exporting.exports import Content, export
from mechdesign.exporting.view import View


@export("study.json", "the study with its overrides, for programs; mechdesign reads it too", order=70)
def study_json(view: View) -> Content:
    """The study as plain data, and a warning that names the files it needs."""
    study = view.study
    data: dict[str, Any] = {**study.resolved}
    if study.drawn is not None and study.mechanism.sketch_configuration.valid:
        # With overrides the assembly is that of the study without them: draw it, or the sketch may show another.
        data["mechanism"] = {**data["mechanism"], "sketch": _drawn(view)}
    files = list(dict.fromkeys(str(path.relative_to(study.folder.path)) for _, path, _ in study.inputs()))
    named = f"it names files that are not in it ({', '.join(files)}): keep them beside it"
    text = json.dumps(data, indent=2, ensure_ascii=False) + "\n"
    return Content(text, (Caution("incomplete", named),) * bool(files))


def _drawn(view: View) -> dict[str, list[float]]:
    """Places of the points that the sketch has, as they are assembled."""
    drawn, sketch = view.mechanism.sketch_configuration, view.study.resolved["mechanism"].get("sketch") or {}
    places = {point: complex(drawn.point(point)) for point in sketch}
    return {point: [place.real, place.imag] for point, place in places.items()}
