"""Designs as study files: the study with other numbers, whose sketch chooses the same assembly."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import yaml

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import MechdesignError
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import GivenRows
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.optimize.judge import DesignSet
from mechdesign.questions.optimize.variables import in_words, parted
from mechdesign.questions.poses import study_poses
from mechdesign.region.curves import workspace_nodes
from mechdesign.study import Study
from mechdesign.study.designs import variant
from mechdesign.study.loading import load_bytes
from mechdesign.study.text.document import plain
from mechdesign.study.variants import changed_data, rewritten

# Poses between two listed ones at which the motion from one to the other is checked.
BETWEEN = 100


def design_files(
    study: Study, designs: DesignSet, optima: Mapping[str, tuple[int, str]]
) -> tuple[dict[str, str], list[Caution]]:
    """Texts by file name, and warnings about them.

    Parameters
    ----------
    wanted : mapping of str to (int, str)
        Designs and how their files are headed, by the name of the file without its suffix.
    """
    files: dict[str, str] = {}
    doubts = []
    for name, (k, heading) in optima.items():
        heading = f"{heading}: {in_words(designs.design(k))}"
        form, numbers = parted(study, designs.design(k))
        # Sections that make other studies, such as the matrix, stay in the file.
        data = {**plain(study.resolved), **changed_data(form, numbers)}
        try:
            best = variant(form, numbers)
            doubts += [Caution("unassembled", f"{name}.yaml: {words}") for words in _parted(best, designs)]
            judged = [goal for goal in (*designs.goals, *designs.conditions) if not goal.expression]
            commands = tuple(dict.fromkeys(goal.command for goal in judged))
            drawings, given = _drawings(best, commands), _given(best, commands)
            while not _assembles_alike(study, best.mechanism, data, given):
                pose = next(drawings, None)
                if pose is None:
                    words = f"{name}.yaml: its sketch chooses another assembly than the optimum's; mend it"
                    doubts.append(Caution("incomplete", words))
                    break
                sketch = data["mechanism"]["sketch"]
                places = [np.asarray(pose.point(point)).item() for point in sketch]
                sketch |= {point: [z.real, z.imag] for point, z in zip(sketch, places, strict=True)}
        except MechdesignError as error:
            doubts.append(Caution("incomplete", f"{name}.yaml: {str(error).splitlines()[0]}"))
        text, beside = rewritten(form, data, heading)
        files |= {f"{name}.yaml": text, **beside}
    return files, doubts


def _parted(study: Study, designs: DesignSet) -> Iterator[str]:
    """A warning of listed poses between which the single drive cannot move the mechanism."""
    if not any(goal.command == "kinematics" and not goal.expression for goal in designs.goals):
        return
    poses = study_poses(study, "kinematics")
    if not poses.listed or len(poses.groups) > 1 or len(poses.names) > 1 or poses.count < 2:
        return
    (name,), listed = poses.names, poses.named[poses.names[0]]
    values = np.linspace(listed[:-1], listed[1:], BETWEEN + 2, axis=1)[:, 1:-1].ravel()
    failed = np.zeros(len(values), dtype=bool)
    for solved in solve_poses(study.motion(Poses(GivenRows({name: values})))):
        failed[solved.rows] = ~solved.configuration.valid
    missed = np.flatnonzero(failed.reshape(-1, BETWEEN).any(axis=1)).tolist()
    unit = study.units.label(study.mechanism.quantity(name))
    if missed:
        ways = ", ".join(f"{k + 1} and {k + 2} ({listed[k]:.6g} to {listed[k + 1]:.6g} {unit})" for k in missed)
        yield (
            f"{name} cannot run from pose to pose: between poses {ways} the mechanism is stopped or comes apart; "
            "a condition keeps off such places, e.g. subject_to: [{result: kinematics.conditioning, at_least: 0.3}]"
        )


def _given(study: Study, commands: Iterable[str]) -> list[tuple[str, ...]]:
    """The coordinates that give the poses of commands, and the drives."""
    coordinates = [study.mechanism.drives]
    for command in commands:
        if command == "workspace" and study.workspace is not None:
            coordinates.append((f"{study.workspace.point}.x", f"{study.workspace.point}.y", *study.workspace.at))
        else:
            coordinates += [tuple(group.names) for group in study_poses(study, command).groups]
    return coordinates


def _drawings(study: Study, commands: Iterable[str]) -> Iterator[Configuration]:
    """Poses for the sketch of a design: its own sketch as it assembles, then a pose of each command."""
    yield study.mechanism.sketch_configuration
    for command in commands:
        poses = workspace_nodes(study) if command == "workspace" else study_poses(study, command)
        for solved in solve_poses(study.motion(poses)):
            pose = solved.configuration
            valid = np.flatnonzero(pose.valid)
            if valid.size:
                # The poses of a workspace begin at its boundary, where legs are stretched: the pose farthest from that.
                closures = [np.broadcast_to(closure, pose.shape)[valid] for closure in pose.closures]
                farthest = int(np.min(closures, axis=0).argmax()) if closures else valid.size // 2
                yield pose.take(int(valid[farthest]))
                break


def _assembles_alike(
    study: Study, mechanism: Mechanism, data: Mapping[str, Any], given: Iterable[tuple[str, ...]]
) -> bool:  # fmt: skip
    """Whether the study of this data has the assembly modes of the evaluated mechanism, from all given coordinates."""
    try:
        text = yaml.safe_dump(dict(data), sort_keys=False).encode()
        alone = load_bytes(text, study.path, folder=study.folder).mechanism
        return all(alone.plan(names).modes == mechanism.plan(names).modes for names in given)
    except MechdesignError:
        return False
