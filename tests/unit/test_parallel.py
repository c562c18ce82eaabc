"""Chunks on threads: order, bounded look-ahead, clean ends."""

import threading
import time

import pytest

from mechdesign.parallel import map_chunks


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_order_is_that_of_the_items(jobs):
    def slow_when_even(k):
        time.sleep(0.002 * (k % 2 == 0))
        return k * k

    assert list(map_chunks(slow_when_even, range(40), jobs)) == [k * k for k in range(40)]


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
