"""Runs: the program's bits, frames, refusals."""

import re

import numpy as np
import pytest

import flockform


@pytest.mark.parametrize("scene", ["tension", "beam-loaded"])
def test_a_run_has_the_bits_of_the_program(scene, program_result):
    run = flockform.run(scene)
    assert np.array_equal(run.positions[-1], program_result(scene))


def test_frames_come_at_the_steps_asked_for_and_at_the_end():
    run = flockform.run("tension", set={"stop.steps": 45}, every=10)
    assert run.steps.dtype == np.int64 and run.steps.tolist() == [0, 10, 20, 30, 40, 45]
    assert run.positions.dtype == np.float64 and run.positions.shape == (6, 144, 2)
    assert np.array_equal(run.positions[0], run.body.reference())
    assert np.array_equal(run.positions[-1], run.body.positions())
    assert run.reason == "steps" and run.body.step == 45


def test_the_frames_of_a_run_do_not_change_its_bits():
    ends = [flockform.run("tension", every=every).positions[-1] for every in (None, 1, 7)]
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[0], ends[2])


def test_frames_are_moved_and_not_copied():
    positions = flockform.run("tension", set={"stop.steps": 5}, every=1).positions
    owner = positions
    while isinstance(owner, np.ndarray):
        assert not owner.flags.owndata
        owner = owner.base
    assert type(owner).__name__ == "PySliceContainer"


def test_the_paper_sample_moves_as_its_oracle_says():
    run = flockform.run("tension", every=1)
    ux = (run.positions - run.body.reference())[:, 67 - 1, 0]
    assert np.flatnonzero(np.abs(ux) > 0)[0] == 6
    assert run.steps[np.argmax(ux)] == 63 and ux.max() == pytest.approx(2.265537, abs=1e-6)
    assert ux[401] == pytest.approx(0.314566, abs=1e-6)


def test_a_scene_is_a_name_a_path_or_a_dict(tmp_path, held_sheet):
    text = """
title = "A sheet"
lattice = { kind = "square", spacing = 1.0 }
body.shape = { kind = "grid", columns = 12, rows = 12 }
stop = { steps = 1000, tolerance = 1e-6 }
roles = [
    { region = { kind = "edge", side = "left" }, role = "clamped" },
    { region = { kind = "edge", side = "right" }, role = "clamped" },
]
"""
    path = tmp_path / "sheet.toml"
    path.write_text(text)
    runs = [flockform.run(scene) for scene in (path, str(path), held_sheet)]
    assert [run.name for run in runs] == ["sheet", "sheet", "python"]
    for run in runs:
        assert run.reason == "equilibrium" and np.array_equal(run.positions, runs[0].positions)


def test_keys_are_set_by_a_dict_or_by_texts(held_sheet):
    plain = flockform.run(held_sheet, set={"lattice.spacing": np.float64(0.5), "stop.steps": np.int32(3)})
    texts = flockform.run(held_sheet, set=["lattice.spacing=0.5", "stop.steps=3"])
    assert plain.body.spacing == texts.body.spacing == 0.5
    array = flockform.run(held_sheet, set={"record.probes": np.array([1, 2])})
    assert array.reason == "equilibrium"


def test_texts_keep_their_quotes_and_lines():
    title = 'a "title"\n\\ of \u00e4ll k\x01in\x7fds'
    assert flockform.run("tension", set={"title": title, "stop.steps": 1}).reason == "steps"
    with pytest.raises(flockform.SceneError) as caught:
        flockform.run("tension", set={"unit": 3, "title": title})
    assert caught.value.problems[0]["key"] == "unit"


def test_progress_is_called_and_its_exception_ends_the_run():
    seen = []

    def progress(step, residual):
        seen.append((step, residual))
        if len(seen) == 3:
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        flockform.run("tension", set={"stop.steps": 50_000_000}, progress=progress)
    assert len(seen) == 3 and seen[0][0] <= seen[1][0] <= seen[2][0]
    assert all(residual > 0.0 for step, residual in seen if step == 0)


def test_a_scene_that_cannot_be_is_refused_with_file_line_key_and_remedy(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text('title = "Wrong"\nlattice = { kind = "square", spacing = -1.0 }\nbody = { shape = 3 }\n')
    with pytest.raises(flockform.SceneError) as caught:
        flockform.run(path)
    assert isinstance(caught.value, ValueError)
    assert re.search(r"wrong\.toml:2: lattice\.spacing = -1", str(caught.value)), caught.value
    problems = {problem["key"]: problem for problem in caught.value.problems}
    assert problems["lattice.spacing"]["line"] == 2 and problems["lattice.spacing"]["found"] == "-1.0"


def test_a_dict_that_cannot_be_is_refused_by_its_key():
    scene = {"lattice": {"kind": "square", "spacing": -1.0}, "body": {"shape": {"kind": "disc", "radius": 3.0}}}
    with pytest.raises(flockform.SceneError) as caught:
        flockform.run(scene, set={"stop.steps": -5})
    assert "--set" not in str(caught.value), caught.value
    places = {problem["key"]: problem["place"] for problem in caught.value.problems}
    assert places["lattice.spacing"] == "the key `lattice`" and places["stop.steps"] == "the key `stop.steps`"


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: flockform.run("tensoin"), flockform.SceneError, "the nearest name is `tension`"),
        (lambda: flockform.run("nowhere/at/all.toml"), flockform.SceneError, "nowhere/at/all.toml"),
        (lambda: flockform.run(3), TypeError, "scene: give the name"),
        (lambda: flockform.run({}), flockform.SceneError, "body"),
        (lambda: flockform.run({"a=b": 1}), flockform.SceneError, "a=b"),
        (lambda: flockform.run({1: 2}), TypeError, "texts"),
        (lambda: flockform.run("tension", set="stop.steps=3"), TypeError, "set: give a dict"),
        (lambda: flockform.run("tension", set={"stop.steps": None}), TypeError, "stop.steps: a NoneType"),
        (lambda: flockform.run("tension", set={"stop.steps": 10**30}), flockform.SceneError, "stop.steps"),
        (lambda: flockform.run("tension", set={"stop.stepz": 3}), flockform.SceneError, "stop.stepz"),
        (
            lambda: flockform.run("tension", set={"lattice.spacing": float("nan")}),
            flockform.SceneError,
            "spacing",
        ),
        (lambda: flockform.run("tension", every=0), ValueError, "every = 0"),
        (lambda: flockform.run("tension", every=-1), ValueError, "every = -1"),
        (lambda: flockform.compare("beam", truth_error=2.0), ValueError, "truth_error = 2"),
        (lambda: flockform.compare("tension"), flockform.SceneError, "material"),
    ],
)
def test_what_cannot_be_is_refused_by_name(call, error, words):
    with pytest.raises(error) as caught:
        call()
    assert words in str(caught.value)
    if error is flockform.SceneError:
        assert caught.value.problems and all(problem["message"] for problem in caught.value.problems)


def test_values_nested_without_end_are_refused():
    endless = []
    endless.append(endless)
    with pytest.raises(ValueError, match="nested"):
        flockform.run("tension", set={"record.probes": endless})


def test_a_body_that_diverges_says_why():
    feedback = {"rule.feedback.factor": 0.5, "rule.feedback.reference": "initial", "stop.steps": 100_000}
    run = flockform.run("tension", set=feedback)
    assert run.reason == "diverged" and "feedback factor 0.5" in run.words
    steps = set()
    for _ in range(3):
        body = flockform.Body("tension", set=feedback)
        with pytest.raises(flockform.DivergedError, match="feedback factor 0.5"):
            body.advance(100_000)
        steps.add(body.step)
    # Where it is seen does not depend on the clock.
    assert len(steps) == 1


def test_more_frames_than_memory_holds_are_refused():
    # The bound is on the address space of another process, which is what a full memory looks like.
    import subprocess
    import sys

    script = """
import resource, flockform
sheet = {
    "lattice": {"kind": "square", "spacing": 1.0},
    "body": {"shape": {"kind": "grid", "columns": 400, "rows": 400}},
    "roles": [{"region": {"kind": "edge", "side": "left"}, "role": "clamped"}],
    "stop": {"steps": 10_000_000},
}
flockform.run(sheet, set={"stop.steps": 1})
with open("/proc/self/statm") as sizes:
    most = int(sizes.read().split()[0]) * resource.getpagesize() + (256 << 20)
resource.setrlimit(resource.RLIMIT_AS, (most, most))
try:
    flockform.run(sheet, every=1)
except MemoryError as error:
    print(error)
"""
    end = subprocess.run(
        [sys.executable, "-c", script], check=False, capture_output=True, text=True, timeout=120
    )
    assert "raise `every`" in end.stdout, end
