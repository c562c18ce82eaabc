"""Chunks on threads, processes and executors: order, bounded look-ahead, clean ends, lost workers, the same bytes."""

import multiprocessing
import os
import pickle
import signal
import site
import threading
import time
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

import mechdesign
from mechdesign.door.report.tables import to_csv
from mechdesign.ground.work import executors, pool
from mechdesign.ground.work.chunks import map_chunks, on
from mechdesign.ground.work.pool import LOOK_AHEAD, ChunkMap, LostWorkerError, Pool
from mechdesign.ground.work.processes import Processes

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_order_is_that_of_the_items(jobs):
    def slow_when_even(k):
        time.sleep(0.002 * (k % 2 == 0))
        return k * k

    assert list(map_chunks(slow_when_even, range(40), jobs)) == [k * k for k in range(40)]


def test_chunks_that_do_not_travel_are_shared_by_threads():
    both = threading.Barrier(2, timeout=10)

    def meet(k):
        both.wait()
        return threading.get_ident()

    assert len({*map_chunks(meet, range(2), 2)} - {threading.get_ident()}) == 2


def test_an_endless_source_is_read_only_a_little_ahead():
    taken = []

    def source():
        k = 0
        while True:
            taken.append(k)
            yield k
            k += 1

    results = map_chunks(lambda k: k, source(), 2)
    assert [next(results) for _ in range(10)] == list(range(10))
    results.close()
    assert len(taken) <= 10 + 8


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_ends_the_work_and_leaves_no_thread(error):
    done = []

    def work(k):
        if k == 3:
            raise error
        done.append(k)
        return k

    with pytest.raises(error):
        list(map_chunks(work, range(1000), 2))
    assert len(done) < 20
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("mechdesign")]


def test_interrupt_of_the_consumer_drops_what_is_not_begun():
    done = []
    results = map_chunks(lambda k: done.append(k) or time.sleep(0.01), range(1000), 2)
    next(results)
    with pytest.raises(KeyboardInterrupt):
        results.throw(KeyboardInterrupt)
    assert len(done) < 20


def test_jobs_must_be_positive():
    with pytest.raises(ValueError, match="from 1 to"):
        list(map_chunks(abs, [1], 0))


def squared(k):
    return k * k


def fatal(marks, times, k):
    """Kill the process that computes chunk 7 so many times; a mark for every chunk that is begun."""
    (marks / f"{k}_{os.getpid()}").touch()
    if k == 7 and len([*marks.glob("7_*")]) <= times:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.001)
    return k * k


def on_processes(function, items):
    """A map on two processes from the first item on."""
    with on(Pool(partial(Processes, 2), 2)):
        yield from map_chunks(function, items, travels=True)


@pytest.mark.slow
def test_a_lost_worker_costs_its_chunk(tmp_path):
    assert [*on_processes(partial(fatal, tmp_path, 1), range(200))] == [k * k for k in range(200)]
    # Of the others only those are computed twice that were under way.
    assert len([*tmp_path.iterdir()]) <= 200 + 2 * LOOK_AHEAD * 8
    assert len([*tmp_path.glob("199_*")]) == 1


@pytest.mark.slow
def test_a_chunk_that_is_always_lost_is_named(tmp_path):
    found = []
    with pytest.raises(LostWorkerError, match=r"^chunk 8 of the work ends each process"):
        found.extend(on_processes(partial(fatal, tmp_path, 99), range(200)))
    assert len([*tmp_path.glob("7_*")]) <= 4


def test_an_error_in_a_process_ends_the_work():
    with pytest.raises(ZeroDivisionError):
        list(on_processes(partial(divmod, 1), range(1000)))
    assert not multiprocessing.active_children()


def test_chunks_go_together_when_they_are_short():
    lengths = []

    class Heard(ThreadPoolExecutor):
        def submit(self, perform, items):
            lengths.append(len(items))
            return super().submit(perform, items)

    found = ChunkMap(Pool(lambda: Heard(2), 2), squared)
    assert [*found(range(10_000))] == [k * k for k in range(10_000)]
    assert lengths[0] == 1
    assert 100 < max(lengths) <= 10_000 / (2 * LOOK_AHEAD)
    assert lengths[-1] == 1


def test_chunks_on_threads_of_this_process_go_one_by_one():
    """What they give may be great, and is all in memory."""
    lengths = []

    class Heard(ThreadPoolExecutor):
        def submit(self, perform, items):
            lengths.append(len(items))
            return super().submit(perform, items)

    assert [*ChunkMap(Pool(lambda: Heard(2), 2, threads=True), squared)(range(100))] == [k * k for k in range(100)]
    assert lengths == [1] * 100


class Long:
    """A function with a great deal to read, which a mark is left of each time."""

    def __init__(self, marks):
        self.marks, self.content = marks, bytes(100_000)

    def __setstate__(self, state):
        self.__dict__ |= state
        (self.marks / f"{os.getpid()}_{time.monotonic_ns()}").touch()

    def __call__(self, k):
        return len(self.content) + k


def test_a_long_function_is_read_once_by_each_worker(tmp_path):
    fresh, root = multiprocessing.get_context("spawn"), str(Path(__file__).parents[2])
    # Workers import this module, by its name below the root.
    with on(Pool(lambda: ProcessPoolExecutor(2, fresh, site.addsitedir, (root,)), 2)):
        found = [*map_chunks(Long(tmp_path), range(300), travels=True)]
    assert found == [100_000 + k for k in range(300)]
    assert 1 <= len([*tmp_path.iterdir()]) <= 2


def test_workers_have_the_same_version(monkeypatch):
    before = pool._perform
    monkeypatch.setattr(pool, "_perform", lambda version, *rest: before("0.0", *rest))
    with on(Pool(lambda: ThreadPoolExecutor(1), 1)), pytest.raises(mechdesign.MechdesignError, match=r"not 0\.0"):
        list(map_chunks(squared, [1], travels=True))


class Stranger(ThreadPoolExecutor):
    """An executor that does something else with its work."""

    def __init__(self, does):
        super().__init__(2)
        self.does = does

    def submit(self, *work):
        if self.does == "refuses":
            raise RuntimeError("the queue is closed")
        future = Future()
        if self.does == "drops":
            future.cancel()
        elif self.does == "loses":
            future.set_exception(ConnectionResetError("by peer"))
        else:
            values, seconds = work[0](*work[1:])
            future.set_result((values[1:], seconds) if self.does == "shortens" else 42)
        return future


@pytest.mark.parametrize(
    ("does", "told"),
    [
        ("refuses", "the executor takes no work: RuntimeError: the queue is closed"),
        ("drops", "the executor lost the work: CancelledError"),
        ("loses", "the executor lost the work: ConnectionResetError by peer"),
        ("shortens", "the executor gives something else than the values"),
        ("answers", "the executor gives something else than the values"),
    ],
)
def test_what_an_executor_does_wrong_is_told(does, told):
    """Above all no value may be missing."""
    with on(Pool(lambda: Stranger(does), 2)), pytest.raises(LostWorkerError, match=f"^{told}"):
        list(map_chunks(squared, range(50), travels=True))


def test_an_executor_whose_shutdown_knows_no_cancelling():
    """As that of dask, of which a factory may give one."""

    class Dasks(ThreadPoolExecutor):
        def shutdown(self, wait=True):
            super().shutdown(wait)

    with on(Pool(lambda: Dasks(2), 2)):
        assert [*map_chunks(squared, range(50), travels=True)] == [k * k for k in range(50)]


@pytest.mark.parametrize("how", ["no workers", "no answer", "cancelled"])
def test_a_scheduler_that_will_not_answer_is_not_waited_for(monkeypatch, how):
    """Its last worker ended, or it did itself: dask would wait for others for ever."""

    class Client:
        def nthreads(self):
            if how == "no answer":
                raise OSError("connection closed")
            return {}

    monkeypatch.setattr(executors, "_NO_WORKERS", 0.05)
    there = object.__new__(executors._Dask)
    there._name, there._client = "dask:tcp://there", Client()
    future = Future()
    if how == "cancelled":
        future.cancel()
        future.set_running_or_notify_cancel()
    told = "has had no workers for 0.05 seconds" if how == "no workers" else "does not answer any more"
    with pytest.raises(LostWorkerError, match=f"^--executor dask:tcp://there: the scheduler {told}"):
        there.outcome(future)


def texts(command, study, **options):
    result = getattr(mechdesign, command)(study, **options)
    return {name: to_csv(table) for name, table in result.tables.items()} | dict(result.files)


METHODS = "[analytic, second_order, monte_carlo, form, importance_sampling, auto]"


CASES = [
    (
        "reliability",
        "gallery/slider_crank_tolerances",
        [f"reliability.methods={METHODS}", "reliability.samples=45000", "reliability.sobol=300"],
    ),
    ("optimize", "gallery/path_synthesis", ["optimize.evaluations=60"]),
    ("optimize", "two_rpr", []),
]


@pytest.mark.nightly
def test_the_same_bytes_wherever_it_is_computed():
    asked = [(command, mechdesign.load(CONFIGS / f"{name}.yaml", changes)) for command, name, changes in CASES]
    expected = [texts(*each) for each in asked]
    assert [texts(command, pickle.loads(pickle.dumps(study))) for command, study in asked] == expected
    assert [texts(*each, jobs=2) for each in asked] == expected
    fresh = multiprocessing.get_context("spawn")
    for open_ in (lambda: ThreadPoolExecutor(2), lambda: ProcessPoolExecutor(1, mp_context=fresh)):
        with on(Pool(open_, 2)):
            assert [texts(*each) for each in asked] == expected
