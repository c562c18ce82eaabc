"""From the validated mechanism section to `mechdesign.mechanism.model.Description`."""

from __future__ import annotations

from typing import Literal

from mechdesign.mechanism.model import Description
from mechdesign.study.build import joints as joint_rules
from mechdesign.study.build import quantities
from mechdesign.study.build.builder import Builder


def build(builder: Builder) -> Description:
    """Run all steps; the result is of use only if the reporter has no problems."""
    builder.check_distinct()
    builder.check_sketch()
    builder.build_links()
    joints = joint_rules.build(builder)
    joint_rules.check_connected(builder)
    joint_rules.check_pins(builder)
    drives = quantities.drives(builder)
    measures = quantities.measures(builder)
    limits = quantities.limits(builder)
    branch: Literal["side", "follow"] = "follow" if builder.section.branch == "follow" else "side"
    return Description(
        builder.places, builder.links, joints, drives, measures, limits, builder.sketch, branch,
        builder.units.angle_factor,
    )  # fmt: skip
