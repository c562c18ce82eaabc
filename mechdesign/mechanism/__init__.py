"""Planar mechanisms: description, compilation into groups, solution and derivatives."""

from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.mechanism import Mechanism, Pose
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.plan import Plan

__all__ = ["Configuration", "Description", "Mechanism", "Plan", "Pose", "Reason"]
