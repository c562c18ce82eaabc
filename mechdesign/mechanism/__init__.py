"""Planar mechanisms: description, compilation into groups, solution and derivatives."""

from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.mechanism import Mechanism, Plan, Pose
from mechdesign.mechanism.model import Description

__all__ = ["Configuration", "Description", "Mechanism", "Plan", "Pose", "Reason"]
