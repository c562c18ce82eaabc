"""What a study asks of every pose of a motion: outputs, Jacobian, rates, efforts, targets."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

from mechdesign.ground.errors import counted
from mechdesign.mechanism.cams import CamFollower
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.jacobians import mixes
from mechdesign.mechanism.plates import CLEARANCE, Pair, pairs_of, plate_of
from mechdesign.motion.rows import Poses
from mechdesign.questions.friction import JointFriction
from mechdesign.questions.kinematics import targets
from mechdesign.questions.kinematics.instant_centres import Centre
from mechdesign.questions.kinematics.moved import AT_REST, MovedQuestion, Static, watched
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.loads import coordinates_in
from mechdesign.questions.outputs import default_outputs, expand_outputs
from mechdesign.study import Study
from mechdesign.study.schema.loads import EFFICIENCIES, joints_of

# Columns of a cam behind the name of its coupling, and their kinds of quantity.
CAM_COLUMNS: Mapping[str, Quantity] = {"pressure_angle": "angle", "curvature_radius": "length"}


def characteristic_length(study: Study) -> float | None:
    """Length that turns angles into lengths, from the section of kinematics or workspace."""
    for section in (study.kinematics, study.workspace):
        if section is not None and section.characteristic_length is not None:
            return section.characteristic_length
    return None


@dataclass(frozen=True, eq=False)
class KinematicQuestion(MovedQuestion):
    """What a study asks of every pose of its kinematics.

    Parameters
    ----------
    listed : sequence of Coordinate
        Rows of the Jacobian, which is wanted where it is `square`: where the study names as many of them (or of the
        outputs) as drives.
    targeted : tuple of str
        Coordinates whose values the errors need.
    cams : sequence of CamFollower
        Cams whose pressure angle and radius of curvature are computed.
    """

    listed: Sequence[Coordinate] = ()
    square: bool = False
    targeted: tuple[str, ...] = ()
    cams: Sequence[CamFollower] = ()

    @classmethod
    def of(cls, study: Study, poses: Poses) -> Self:
        """Read what a study asks of its motion at some poses.

        Raises
        ------
        MechanismError
            If an output does not exist.
        """
        section, mechanism = KinematicsSection.of(study), study.mechanism
        outputs = expand_outputs(study, section.outputs or default_outputs(mechanism))
        listed = outputs if section.jacobian is None else expand_outputs(study, section.jacobian)
        shown = {output.name: output for output in outputs}
        for target in (*study.targets.values(), *study.curves.values()):
            shown |= {name: mechanism.coordinate(name) for name in target.coordinates if name not in shown}
        targeted = targets.needed(study, poses)
        return cls(
            study, section, study.motion(poses), poses, watched(study, section, [*shown, *targeted]),
            section.inverse(mechanism.drives), list(shown.values()), targets.followed(study, poses), listed,
            (section.outputs or section.jacobian) is not None and len(listed) == len(mechanism.drives), targeted,
            mechanism.cams,
        )  # fmt: skip

    @property
    def evaluated(self) -> list[Coordinate]:
        coordinates = [*super().evaluated, *(self.listed if self.square else ())]
        coordinates += self.rated.values() if self.section.rated else ()
        return coordinates + [self.study.mechanism.coordinate(name) for name in self.section.mechanical_advantage]

    @property
    def centres(self) -> list[Centre]:
        """Pairs of links whose instant centres are asked."""
        return [Centre(*pair) for pair in self.section.instant_centres]

    @cached_property
    def pairs(self) -> dict[str, Pair]:
        """Plates and pins whose clearances are asked, by the column of each."""
        chosen = self.section.collisions
        if chosen is None:
            return {}
        named = [Pair(plate_of(one), plate_of(other)) for one, other in chosen]
        pairs = named or pairs_of(self.study.mechanism.description)
        return {pair.name: pair for pair in pairs}

    @property
    def clearances(self) -> list[str]:
        """Columns of clearances: of every pair, and the smallest."""
        return [*self.pairs, CLEARANCE] if self.pairs else []

    @property
    def statics(self) -> list[Static]:
        """Efforts of the drives, where there are loads, mechanical advantages, and what cams have."""
        label, statics = self.study.units.label, []
        for drive in self.drives if self.section.loads else ():
            unit = label("moment" if drive.quantity == "angle" else "force")
            statics.append(Static(f"{drive.name}_effort", unit, "<drive>_effort", {"drive": drive.name}))
        statics += [Static(name, "", name, {}) for name in EFFICIENCIES if self.friction is not None]
        for name, input_name in self.section.mechanical_advantage.items():
            units = {"length": label("length"), "angle": ""}
            above, below = (units[self.study.mechanism.quantity(coordinate)] for coordinate in (input_name, name))
            unit = "" if above == below else above or f"1/{below}"
            words = {"output": name, "input": input_name}
            statics.append(Static(f"{name}_advantage", unit, "<output>_advantage", words))
        for cam in self.cams:
            for word, kind in CAM_COLUMNS.items():
                words = {"coupling": cam.coupling}
                name = f"{cam.coupling}_{word}"
                statics.append(Static(name, label(kind), f"<coupling>_{word}", words, self.sizes[kind]))
        return statics

    @property
    def poled(self) -> list[str]:
        """Columns that go to infinity where nothing is singular."""
        advantages = [f"{name}_advantage" for name in self.section.mechanical_advantage]
        centres = [column for centre in self.centres for column in centre.columns]
        return [*advantages, *(f"{cam.coupling}_curvature_radius" for cam in self.cams), *centres]

    @cached_property
    def friction(self) -> JointFriction | None:
        """Friction in the joints under the loads, if the study gives any."""
        mechanism, loads = self.study.mechanism, self.section.loads
        if not loads or not mechanism.description.friction:
            return None
        return JointFriction(mechanism, joints_of(mechanism, loads))

    @property
    def rated(self) -> dict[str, Coordinate]:
        """What has velocities and accelerations, where rates are asked: outputs, and drives whose rates change."""
        drives = self.drives if self.inverse or self.section.motion is not None else []
        return {output.name: output for output in [*drives, *self.outputs]}

    @property
    def orders(self) -> dict[str, tuple[Quantity, int]]:
        """Columns of velocities and accelerations, where the study gives rates: of what quantity, and which order."""
        return {
            f"{output.name}_{word}": (output.quantity, order)
            for output in (self.rated.values() if self.section.rated else ())
            for order, word in ((1, "velocity"), (2, "acceleration"))
        }

    def lean(self, names: Collection[str]) -> Self:
        section, unasked = self.section, dict[str, object]()
        centres = [
            pair for pair in section.instant_centres if any(name.startswith(Centre(*pair).name) for name in names)
        ]
        rates = bool(centres) or any(name.endswith(("_velocity", "_acceleration")) for name in names)
        forced = any(static.name in names for static in self.statics)
        if not (rates or (self.friction is not None and forced) or coordinates_in(self.study, section.loads)):
            unasked |= AT_REST
        if not any(name in names for name in self.clearances):
            unasked |= {"collisions": None}
        if not forced:
            unasked |= {"loads": (), "mechanical_advantage": {}}
        square = self.square and any(name in ("det_J", "inverse_condition") or "_by_" in name for name in names)
        values = {*names, *(self.targeted if any(name.endswith("_error") for name in names) else ())}
        return replace(
            self, section=section.model_copy(update={**unasked, "instant_centres": tuple(centres)}), square=square,
            watched=[coordinate for coordinate in self.watched if coordinate.name in values],
            inverse=self.inverse and rates,
            cams=[cam for cam in self.cams if any(f"{cam.coupling}_{word}" in names for word in CAM_COLUMNS)],
        )  # fmt: skip

    @property
    def mixed(self) -> bool:
        """Whether the Jacobian mixes lengths and angles, and the study gives no length that makes them comparable."""
        return self.square and mixes(self.listed, self.drives) and characteristic_length(self.study) is None

    @property
    def absent(self) -> Mapping[str, str]:
        """Columns and tables of the Jacobian that have no values: why, and what to write for them."""
        if self.square:
            words = "J mixes lengths and angles; give kinematics.characteristic_length"
            return {"inverse_condition": words} if self.mixed else {}
        study, drives = self.study, self.study.mechanism.drives
        # One point, then angles; of outputs that are left out the last, as the end of a chain.
        named, others = self.section.outputs or (), default_outputs(study.mechanism)[::-1]
        parts = {c.name: c for c in expand_outputs(study, (*named, *others)) if c.name not in drives}
        node = next((c.node for c in parts.values() if c.kind in ("x", "y")), -1)
        picked = sorted(parts, key=lambda name: (parts[name].node != node, parts[name].kind != "angle"))[: len(drives)]
        points = {name[:-2] for name in picked if name.endswith(".x") and f"{name[:-2]}.y" in picked}
        rows = dict.fromkeys(name[:-2] if name[:-2] in points else name for name in picked)
        listing = f"{counted(len(self.listed), 'output')} ({', '.join(c.name for c in self.listed)})"
        words = f"{listing} for {counted(len(drives), 'drive')}; name as many"
        if not named:
            words = f"no outputs are named; name as many as there are drives, {len(drives)},"
        words += f" by kinematics.jacobian: [{', '.join(rows)}]"
        return dict.fromkeys(("det_J", "inverse_condition", "jacobian"), words)
