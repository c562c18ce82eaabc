"""The study as JSON, which is YAML too: with its overrides, its name, its seed and all of its units."""

from __future__ import annotations

import json
import re
from typing import Any

from mechdesign.door.exporting.exports import Content, export
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.ground.cautions import Caution
from mechdesign.ground.files import way

_NOT_IN_YAML = re.compile(r"[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")


@export("study.json", "the study with its overrides, for programs; mechdesign reads it too", order=70)
def study_json(view: PosedStudy) -> Content:
    """The study as plain data, and a warning that names the files it needs."""
    study = view.study
    data: dict[str, Any] = {**study.resolved}
    if study.drawn is not None and study.mechanism.sketch_configuration.valid:
        # With overrides the assembly is that of the study without them: draw it, or the sketch may show another.
        sketch = data["mechanism"].get("sketch") or {}
        drawn = {point: complex(study.mechanism.sketch_configuration.point(point)) for point in sketch}
        places = {point: [place.real, place.imag] for point, place in drawn.items()}
        data["mechanism"] = {**data["mechanism"], "sketch": places}
    files = list(dict.fromkeys(way(path, study.folder.path) for _, path, _ in study.inputs()))
    named = f"it names files that are not in it ({', '.join(files)}): keep them beside it"
    # Characters that YAML has no place for, or that end its lines, are written as escapes.
    text = json.dumps(data, indent=2, ensure_ascii=False)
    text = _NOT_IN_YAML.sub(lambda found: f"\\u{ord(found[0]):04x}", text)
    return Content(text + "\n", (Caution("incomplete", named),) * bool(files))
