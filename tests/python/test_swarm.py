"""Formations in somebody else's simulator."""

import copy

import numpy as np
import pytest

import flockform


def fly(swarm, periods, places=None):
    """Ideal robots: each is at its target one period later."""
    places = swarm.places() if places is None else places
    for _ in range(periods):
        targets = swarm.tick(places)
        places = np.where(np.isfinite(targets), targets, places)
    return places


def test_ideal_robots_end_in_the_formation():
    swarm = flockform.Swarm("square")
    assert swarm.count == len(swarm.names) == 25 and swarm.period == 0.05
    assert swarm.leaders().sum() == 4
    assert swarm.formation_error() is None, "no robot was seen yet"
    fly(swarm, 1500)
    assert swarm.formation_error() < 1e-9
    assert swarm.clearance().shape == (25,) and swarm.clearance().min() > 0.3
    assert swarm.rejections() == {} and set(swarm.health()) == {"fresh"}


def test_targets_are_safe():
    swarm = flockform.Swarm("square")
    places = swarm.places()
    for _ in range(200):
        targets = swarm.tick(places)
        assert np.linalg.norm(targets - places, axis=1).max() <= 1.0 * swarm.period * (1 + 1e-9)
        places = targets


def test_a_robot_that_is_not_heard_gets_no_target():
    swarm = flockform.Swarm("square")
    places = fly(swarm, 10)
    heard = np.ones(swarm.count, dtype=bool)
    heard[7] = False
    for _ in range(100):
        targets = swarm.tick(places, heard=heard)
    assert np.isnan(targets[7]).all() and np.isfinite(np.delete(targets, 7, axis=0)).all()
    assert swarm.health()[7] in ("degraded", "stopped")


def test_a_pose_that_cannot_be_is_rejected_with_a_reason():
    swarm = flockform.Swarm("square")
    places = fly(swarm, 10)
    places[3] += 100.0
    swarm.tick(places)
    assert list(swarm.rejections()) == [swarm.names[3]]
    assert "100" in swarm.rejections()[swarm.names[3]] or "141" in swarm.rejections()[swarm.names[3]]


def test_a_leader_is_led_from_python():
    swarm = flockform.Swarm("square", set={"leaders[0].program": {"kind": "external"}})
    places = fly(swarm, 1)
    corners = np.flatnonzero(swarm.leaders())
    for corner in corners:
        swarm.lead(int(corner), swarm.places()[corner] + [2.0, 1.0])
    places = fly(swarm, 600, places)
    assert places == pytest.approx(swarm.places() + [2.0, 1.0], abs=1e-6)
    with pytest.raises(ValueError, match="cannot be led"):
        swarm.lead(int(np.flatnonzero(~swarm.leaders())[0]), [0.0, 0.0])
    with pytest.raises(ValueError, match="give one of"):
        swarm.lead("nobody", [0.0, 0.0])


def test_a_manoeuvre_begins_by_name():
    swarm = flockform.Swarm("square")
    assert swarm.manoeuvres == ["turn"]
    swarm.begin("turn")
    with pytest.raises(ValueError, match="the swarm has these: turn"):
        swarm.begin("jump")


def test_an_emergency_stop_holds_every_robot():
    swarm = flockform.Swarm("square")
    places = fly(swarm, 20)
    swarm.emergency_stop()
    assert np.array_equal(swarm.tick(places), places) and swarm.mode == "emergency-stopped"
    assert swarm.resume() and not swarm.resume() and swarm.mode == "running"


def test_a_copy_goes_its_own_way():
    swarm = flockform.Swarm("square")
    places = fly(swarm, 20)
    twin = copy.deepcopy(swarm)
    assert np.array_equal(fly(swarm, 50, places), fly(twin, 50, places))


def test_a_lie_about_a_place_is_found_by_the_ranges_of_others():
    swarm, deaf = (flockform.Swarm("square", set={"ranges": {"tolerance": 0.2}}) for _ in range(2))
    places = swarm.places()
    ranges = np.linalg.norm(places[:, None] - places, axis=2)
    ranges[ranges > 3.5] = np.nan
    np.fill_diagonal(ranges, np.nan)
    for _ in range(4):
        swarm.tick(places, ranges=ranges)
        deaf.tick(places)
        assert not swarm.rejections()
    said = places.copy()
    said[12] += [0.4, 0.0]
    # Half a metre is noise that the speed limit allows for: only the ranges tell.
    deaf.tick(said)
    assert not deaf.rejections()
    swarm.tick(said, ranges=ranges)
    assert list(swarm.rejections()) == ["robot_13"]
    assert "range" in swarm.rejections()["robot_13"]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"poses": np.zeros((3, 2))}, ValueError, "poses has shape (3, 2): give (25, 2)"),
        ({"poses": np.zeros((25, 4))}, ValueError, "poses has shape (25, 4)"),
        ({"poses": np.full((25, 3), np.nan)}, ValueError, "poses[0, 0] is NaN"),
        ({"poses": 3.0}, ValueError, "poses has shape ()"),
        ({"heard": np.ones(25)}, TypeError, "heard has dtype float64"),
        ({"heard": [True]}, ValueError, "heard has shape (1,): give (25,)"),
        ({"stamps": np.zeros(3)}, ValueError, "stamps has shape (3,): give (25,)"),
        ({"now": float("nan")}, ValueError, "now = NaN"),
        ({"ranges": np.zeros(25)}, ValueError, "ranges has shape (25,): give (25, 25)"),
        ({"ranges": np.zeros((25, 25))}, ValueError, "swarm `square` has no [ranges]"),
    ],
)
def test_bad_arrays_are_refused_by_name(arguments, error, words):
    swarm = flockform.Swarm("square")
    with pytest.raises(error) as caught:
        swarm.tick(**({"poses": swarm.places()} | arguments))
    assert words in str(caught.value)


def test_a_scene_is_no_swarm_and_a_swarm_no_scene():
    with pytest.raises(flockform.SceneError, match="tension: is a bundled scene, no swarm"):
        flockform.Swarm("tension")
    with pytest.raises(flockform.SceneError, match="square: is a bundled swarm, no scene"):
        flockform.Body("square")
