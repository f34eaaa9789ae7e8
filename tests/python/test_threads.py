"""Interrupts, other threads, forked processes."""

import multiprocessing
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import flockform

def test_other_threads_go_on_while_a_run_computes():
    ticks = []
    over = threading.Event()

    def tick():
        while not over.wait(0.005):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    before = len(ticks)
    begun = time.monotonic()
    flockform.Body("tension").advance(200_000)
    took = time.monotonic() - begun
    over.set()
    thread.join()
    assert len(ticks) - before > 0.1 * took / 0.005


def test_a_run_whose_body_another_thread_steps_is_printed_or_says_so():
    run = flockform.run("tension", set={"stop.steps": 1})
    thread = threading.Thread(target=run.body.advance, args=(200_000,))
    thread.start()
    refusals = 0
    while thread.is_alive():
        try:
            assert "144 particles" in repr(run)
        except RuntimeError:
            refusals += 1
        time.sleep(0.001)
    thread.join()
    assert refusals > 0 and "144 particles" in repr(run)


def test_runs_in_several_threads_do_not_disturb_each_other():
    alone = flockform.run("tension").positions
    ends = [None] * 6

    def go(k):
        ends[k] = flockform.run("tension").positions

    threads = [threading.Thread(target=go, args=(k,)) for k in range(len(ends))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(end, alone) for end in ends)


def _end_of(scene):
    return flockform.run(scene).positions[-1]


def _force_of(scene):
    return flockform.Body(scene).reactions()[0]["force"]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_computes_with_threads_of_its_own():
    # Large enough for several threads: those of the parent do not exist in the child.
    scene = {
        "lattice": {"kind": "square", "spacing": 1.0},
        "body": {"shape": {"kind": "grid", "columns": 400, "rows": 400}},
        "roles": [{"region": {"kind": "edge", "side": "left"}, "role": "clamped"}],
        "stop": {"steps": 3},
    }
    here = _end_of(scene)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        there = pool.apply_async(_end_of, (scene,)).get(timeout=300)
    assert np.array_equal(here, there)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_reads_forces_with_threads_of_its_own():
    scene = {
        "lattice": {"kind": "square", "spacing": 1.0},
        "body": {"shape": {"kind": "grid", "columns": 60, "rows": 60}},
        "material": {"kind": "isotropic", "young": 1.0, "poisson": 0.3},
        "rule": {"mean": {"kind": "material"}},
        "roles": [{"region": {"kind": "edge", "side": "left"}, "role": "clamped"}],
        "stop": {"steps": 1},
    }
    here = _force_of(scene)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        there = pool.apply_async(_force_of, (scene,)).get(timeout=300)
    assert here == there


# Each takes minutes if nothing ends it.
LONG = {
    "stepping": lambda: flockform.run("tension", set={"stop.steps": 2_000_000_000}),
    "a body": lambda: flockform.Body("tension").advance(2_000_000_000),
    # Small enough to be laid out at once, and never as near as that.
    "a solver": lambda: flockform.run(
        "beam",
        set={
            "lattice.spacing": 0.05,
            "equilibrium.solver": "jacobi",
            "equilibrium.tolerance": 1e-300,
            "equilibrium.most_iterations": 1_000_000_000,
            "roles[1].motion.kind": "velocity",
            "roles[1].motion.per_step": [0.0, 1.0],
        },
    ),
    "finite elements": lambda: flockform.compare("beam", truth_error=1e-9),
    "a study": lambda: flockform.stability("tension", extremes=True),
}
# Seconds until the interrupt comes.
SOON = {"finite elements": 0.1}
# Work that looks at its flag at every step; other work may go on unseen, so it comes last here.
PROMPT = ["stepping", "a body", "a solver"]


def _works():
    """Whether a thread of flockform is at work on something."""
    names = [task / "comm" for task in Path(f"/proc/{os.getpid()}/task").iterdir()]
    return any(_text(name) == "flockform\n" for name in names)


def _text(file):
    try:
        return file.read_text()
    except OSError:
        # The thread has ended.
        return ""


@pytest.mark.parametrize("what", LONG)
def test_an_interrupt_ends_it_soon(what):
    raised = []

    def handler(*_):
        raised.append(time.monotonic())
        raise KeyboardInterrupt

    former = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, SOON.get(what, 0.5))
    try:
        with pytest.raises(KeyboardInterrupt):
            LONG[what]()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, former)
    # A second, and more for a machine that has other things to do.
    assert raised and time.monotonic() - raised[0] < 10.0
    if what in PROMPT:
        end = time.monotonic() + 60.0
        while _works() and time.monotonic() < end:
            time.sleep(0.05)
        assert not _works()
    # The next one is not ended by what ended this one, and does not wait for it.
    assert flockform.run("tension", set={"stop.steps": 3}).reason == "steps"
