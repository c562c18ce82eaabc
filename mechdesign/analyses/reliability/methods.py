"""What each method says of every pose: estimates of failure, and moments of the errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.sampling import generator
from mechdesign.analyses.reliability.simulation import Setting, Sums, simulate, simulate_chunk, sums_of
from mechdesign.analyses.reliability.task import Found, Partial, Task, wanted_precision
from mechdesign.numerics.arrays import Floats
from mechdesign.parallel import map_chunks
from mechdesign.progress import NULL

# Streams of their own, beside those of the chunks.
_SEARCH, _QUASI = 1, 2


def analytic(task: Task) -> Found:
    """First-order errors, normal [S2, S3]; no interval is claimed."""
    return normal("analytic", task, task.linear.shift(), task.linear.covariance())


def normal(method: str, task: Task, mean: Floats, covariance: Floats) -> Found:
    """Normal errors of these means, shape (channels, poses), and covariances, shape (poses, channels, channels)."""
    from mechdesign.analyses.reliability.error_limits import correlation

    estimates = {}
    rho = np.full(task.poses, np.nan)
    for setting in task.settings:
        pose, block = setting.pose, covariance[setting.pose]
        if setting.bands or setting.discs:
            from mechdesign.analyses.reliability.probability import failure_probability

            value = failure_probability(block, setting.bands, setting.discs, mean[:, pose])
            estimates[pose] = Estimate(value, value, value, 0)
        if setting.pair is not None:
            rho[pose] = correlation(block[np.ix_(setting.pair, setting.pair)])
    with np.errstate(invalid="ignore"):
        sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2).T)
    return Found(method, estimates, mean, sigma, rho)


def second_order(task: Task) -> Found:
    """Second-order errors, normal about the shifted mean; no interval is claimed."""
    from mechdesign.analyses.reliability.second_order import moments

    return normal("second_order", task, *moments(task))


def monte_carlo(task: Task) -> Found:
    """Plain simulation; an interrupt leaves what was drawn so far in `Found.sums`."""
    sums: list[Sums | None] = [None] * len(task.settings)
    task.progress.start(len(task.settings) * task.samples, "samples")
    try:
        simulate(task.settings, task.sources, task.seed, task.samples, task.jobs, task.progress, sums)
    except KeyboardInterrupt:
        raise Partial(_summed("monte_carlo", task, sums)) from None
    return _summed("monte_carlo", task, sums)


@contextmanager
def _keeping(found: Found, task: Task) -> Iterator[None]:
    """On an interrupt the poses that are finished are kept."""
    try:
        yield
    except KeyboardInterrupt:
        raise Partial(_with_moments(found, task) if found.sums else found) from None


def _summed(method: str, task: Task, sums: Sequence[Sums | None]) -> Found:
    known = {s.pose: found for s, found in zip(task.settings, sums, strict=True) if found is not None}
    found = Found(method, sums=known)
    if task.settings and task.settings[0].limited:
        found.estimates.update({pose: counted(each) for pose, each in known.items()})
    return _with_moments(found, task)


def counted(sums: Sums) -> Estimate:
    """Estimate from counted failures, with the interval of Clopper and Pearson."""
    from mechdesign.analyses.reliability.engine.intervals import binomial

    low, high = binomial(sums.failures, sums.samples)
    invalid = sums.samples - sums.valid
    return Estimate(sums.failures / sums.samples, low, high, sums.samples, sums.samples, sums.failures, invalid)


def _with_moments(found: Found, task: Task) -> Found:
    mean, sigma = (np.full((task.channels, task.poses), np.nan) for _ in range(2))
    rho = np.full(task.poses, np.nan)
    for setting in task.settings:
        sums = found.sums.get(setting.pose)
        if sums is not None and sums.valid:
            mean[:, setting.pose], sigma[:, setting.pose] = sums.mean, sums.deviation
            if setting.pair is not None:
                rho[setting.pose] = sums.correlation(setting.pair)
    return replace(found, mean=mean, sigma=sigma, rho=rho)


def quasi_monte_carlo(task: Task) -> Found:
    """Scrambled Sobol points, in replicates that give the interval."""
    from mechdesign.analyses.reliability.engine import quasi

    counts = quasi.replicates(task.samples)
    task.progress.start(len(task.settings) * sum(counts), "samples")

    def work(setting: Setting) -> tuple[Sums, Estimate]:
        plain = replace(setting, trend=False, scale=None)
        seeds = generator(task.seed, setting.pose, _QUASI, 0).integers(2**62, size=len(counts))
        total: Sums | None = None
        broken, blocks = [], 0
        for count, seed in zip(counts, seeds.tolist(), strict=True):
            broken.append(0)
            for u in quasi.points(len(task.sources.owners), count, seed):
                part = sums_of(plain, task.sources.made(task.sources.at(u)), u.shape[1], blocks)
                total = part if total is None else total + part
                blocks += 1
                broken[-1] += part.failures
        assert total is not None
        return total, quasi.estimate(broken, counts[0], total.samples - total.valid)

    found = Found("quasi_monte_carlo")
    with _keeping(found, task):
        for setting, (sums, estimate) in zip(task.settings, map_chunks(work, task.settings, task.jobs), strict=True):
            found.sums[setting.pose] = sums
            if setting.limited:
                found.estimates[setting.pose] = estimate
            task.progress.update(sums.samples)
    return _with_moments(found, task)


def form(task: Task) -> Found:
    """Tangents at the design points; no interval is claimed."""
    from mechdesign.analyses.reliability.engine.design_points import find
    from mechdesign.analyses.reliability.engine.form import form as tangents
    from mechdesign.analyses.reliability.limit_states import problem_of

    def work(setting: Setting) -> Estimate:
        problem = problem_of(setting, task.sources)
        return tangents(problem, find(problem, generator(task.seed, setting.pose, _SEARCH, 0)))

    return _each("form", task, work)


def importance_sampling(task: Task) -> Found:
    """A mixture of normal densities about the design points, that learns where failures lie."""
    from mechdesign.analyses.reliability.engine.design_points import find
    from mechdesign.analyses.reliability.engine.importance import importance_sampling as sampled
    from mechdesign.analyses.reliability.limit_states import problem_of

    def work(setting: Setting) -> Estimate:
        problem = problem_of(setting, task.sources)
        rng = generator(task.seed, setting.pose, _SEARCH, 1)
        found = sampled(problem, find(problem, rng), rng, task.samples)
        # No failure was seen: plain samples bound what was missed.
        return found if found.failures else _bounded(setting, task, problem.evaluations)

    return _each("importance_sampling", task, work)


def _bounded(setting: Setting, task: Task, evaluations: int) -> Estimate:
    sums: list[Sums | None] = [None]
    simulate([setting], task.sources, task.seed, task.samples, 1, NULL, sums)
    assert sums[0] is not None
    found = counted(sums[0])
    return replace(found, evaluations=found.evaluations + evaluations)


def auto(task: Task) -> Found:
    """The cheapest method that reaches the precision asked for; moments from its plain samples."""
    from mechdesign.analyses.reliability.engine import ladder
    from mechdesign.analyses.reliability.limit_states import problem_of

    precision = wanted_precision(task)
    found = Found("auto")

    def work(setting: Setting) -> tuple[Sums, Estimate | None, str, dict[str, Estimate]]:
        drawn: list[Sums] = []

        def plain(count: int) -> Estimate:
            while (have := sum(part.samples for part in drawn)) < count:
                # The first chunk is the pilot, the following ones are whole.
                size = min(ladder.PILOT if not drawn else ladder.FEW, count - have)
                drawn.append(simulate_chunk(setting, task.sources, task.seed, len(drawn), size))
            return counted(_total(drawn))

        if not setting.limited:
            plain(min(ladder.FEW, task.most))
            return _total(drawn), None, "", {}
        rng = generator(task.seed, setting.pose, _SEARCH, 2)
        # Where nothing else helps, plain samples are as many all told.
        problem, shared = problem_of(setting, task.sources), max(ladder.FEW, task.most // task.poses)
        estimate, used, rungs = ladder.climb(problem, precision, plain, rng, task.most, shared)
        return _total(drawn), estimate, used, rungs

    task.progress.start(len(task.settings), "poses")
    with _keeping(found, task):
        for setting, (sums, estimate, used, rungs) in zip(
            task.settings, map_chunks(work, task.settings, task.jobs), strict=True
        ):
            found.sums[setting.pose] = sums
            if estimate is not None:
                found.estimates[setting.pose], found.used[setting.pose] = estimate, used
                found.rungs[setting.pose] = rungs
            task.progress.update(1)
    return _with_moments(found, task)


def _total(parts: Sequence[Sums]) -> Sums:
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


def _each(method: str, task: Task, work: Callable[[Setting], Estimate]) -> Found:
    found = Found(method)
    settings = [setting for setting in task.settings if setting.limited]
    task.progress.start(len(settings), "poses")
    with _keeping(found, task):
        for setting, estimate in zip(settings, map_chunks(work, settings, task.jobs), strict=True):
            found.estimates[setting.pose] = estimate
            task.progress.update(1)
    return found


METHODS: dict[str, Callable[[Task], Found]] = {
    "analytic": analytic,
    "second_order": second_order,
    "monte_carlo": monte_carlo,
    "quasi_monte_carlo": quasi_monte_carlo,
    "form": form,
    "importance_sampling": importance_sampling,
    "auto": auto,
}
