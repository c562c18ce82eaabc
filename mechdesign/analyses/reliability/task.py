"""What the methods of reliability are asked, and what each says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from mechdesign.analyses.reliability.engine.precision import Precision as Wanted
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.simulation import Setting, Sums
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.numerics.arrays import Floats
from mechdesign.progress import Progress
from mechdesign.study.schema.reliability import Precision

# Samples that `auto` draws at most where the study says nothing, and its precision.
MOST, RELATIVE = 2_000_000, 0.05


@dataclass(frozen=True, eq=False)
class Task:
    """What all methods are asked.

    Parameters
    ----------
    settings : sequence of Setting
        Poses that can be assembled.
    linear : FirstOrder
        Of all poses.
    channels, poses : int
        How many there are.
    samples : int
        As the study asks.
    most : int
        Samples of `auto`.
    cycle : bool
        Whether the poses are one motion, whose probability as a whole is asked.
    """

    settings: Sequence[Setting]
    sources: Sources
    linear: FirstOrder
    channels: int
    poses: int
    seed: int
    samples: int
    most: int
    precision: Precision | None
    jobs: int | None
    progress: Progress
    cycle: bool = False


@dataclass(frozen=True, eq=False)
class Found:
    """What a method says.

    Parameters
    ----------
    estimates : dict of int to Estimate
        By pose, where there are limits.
    mean, sigma : ndarray, shape (channels, poses), or None
        Of the errors (radians, lengths); None where the method gives no moments.
    rho : ndarray, shape (poses,)
        Correlation of the two outputs.
    sums : dict of int to Sums
        By pose, of methods that sample the errors.
    used : dict of int to str
        By pose, the method that the value comes from, where it is not this one.
    rungs : dict of int to dict of str to Estimate
        By pose, what the methods tried before say.
    cycle : Estimate or None
        Of the whole motion.
    """

    method: str
    estimates: dict[int, Estimate] = field(default_factory=dict)
    mean: Floats | None = None
    sigma: Floats | None = None
    rho: Floats | None = None
    sums: dict[int, Sums] = field(default_factory=dict)
    used: dict[int, str] = field(default_factory=dict)
    rungs: dict[int, dict[str, Estimate]] = field(default_factory=dict)
    cycle: Estimate | None = None


class Partial(KeyboardInterrupt):
    """An interrupted method, and what it had found."""

    def __init__(self, found: Found) -> None:
        super().__init__()
        self.found = found


def wanted_precision(task: Task) -> Wanted:
    """What the study asks of `auto`, or a twentieth of the probability of failure."""
    asked = task.precision
    return Wanted(RELATIVE, None) if asked is None else Wanted(asked.relative, asked.half_width)
