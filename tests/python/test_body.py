"""Bodies that Python steps, leads, observes, solves and reads."""

import copy

import numpy as np
import pytest

import flockform


def test_a_stepped_body_is_where_a_run_has_it():
    run = flockform.run("tension", every=50)
    body = flockform.Body("tension")
    for step, positions in zip(run.steps[1:], run.positions[1:]):
        body.advance(int(step) - body.step)
        assert body.step == step and np.array_equal(body.positions(), positions)


def test_a_led_particle_stays_where_it_was_led(held_sheet):
    body = flockform.Body(held_sheet)
    right = body.particles("clamped")[-12:]
    reference = body.reference()
    places = reference[right] + [0.5, 0.0]
    body.lead(right, places)
    for _ in range(5):
        body.advance()
        assert np.array_equal(body.positions()[right], places)
    body.advance(2000)
    moved = body.positions() - reference
    # At rest the columns are evenly stretched.
    assert moved[:, 0] == pytest.approx(0.5 * (reference[:, 0] - reference[:, 0].min()) / 11.0, abs=1e-6)
    body.lead(int(right[0]), [20.0, 20.0])
    body.advance()
    assert body.positions()[right[0]].tolist() == [20.0, 20.0]


def test_a_body_whose_scene_asks_for_equilibrium_is_stepped_as_well():
    body = flockform.Body("bar")
    for begin in (lambda: None, body.solve):
        begin()
        body.advance(300)
        # In the elongation of its load, not beyond it.
        assert np.abs(body.displacements()).max() < 0.4 + 1e-9


def test_a_body_seen_where_it_was_sent_goes_on_as_if_it_were_not(held_sheet):
    body, other = flockform.Body(held_sheet), flockform.Body(held_sheet)
    for one in (body, other):
        one.lead(0, [-3.0, -3.0])
    for _ in range(6):
        body.advance()
        other.advance()
        other.observe(other.positions())
    assert np.array_equal(body.positions(), other.positions())
    seen = body.positions()[20:22] + 0.25
    body.observe(seen, [20, 21])
    assert np.array_equal(body.positions()[20:22], seen)


def test_a_particle_of_which_one_component_is_held_is_not_led(soft_bar):
    left = {"region": {"kind": "edge", "side": "left"}, "role": "clamped"}
    body = flockform.Body(soft_bar, set={"roles": [left | {"axis": axis} for axis in ("x", "y")]})
    with pytest.raises(ValueError, match="held along an axis alone: .* leave `axis` out"):
        body.lead(0, [0.0, 0.0])


def test_a_solved_body_balances_its_load(soft_bar):
    body = flockform.Body(soft_bar)
    way = body.solve()
    assert way["reason"] == "equilibrium" and way["iterations"] >= 0
    assert np.array_equal(body.positions(), flockform.run(soft_bar).positions[-1])
    (reaction,) = body.reactions()
    assert reaction["role"] == "clamped" and reaction["force"] == pytest.approx([-40.0, 0.0], abs=1e-6)
    stress = body.stress()
    assert stress["cells"].shape == (80, 3) and stress["cell_places"].shape == (80, 2)
    assert stress["particles"].shape == (body.count, 3)
    middle = np.abs(stress["cell_places"][:, 0] - 10.0) < 1.0
    assert stress["cells"][middle] == pytest.approx(np.tile([10.0, 0.0, 0.0], (middle.sum(), 1)), abs=1e-3)
    assert stress["cell_von_mises"][middle] == pytest.approx(10.0, abs=1e-3)
    mechanics = body.mechanics()
    assert mechanics["work"]["loads"] / 2 == pytest.approx(mechanics["strain_energy"], rel=1e-9)


def test_a_body_that_changes_on_its_way_has_no_equilibrium_without_steps(soft_bar):
    # The side that is pulled is let go at step 21, and the body goes back.
    for scene, key in (("tension", r"roles\[\d\].from"), ("fracture", "fracture")):
        with pytest.raises(flockform.SceneError, match=key):
            flockform.Body(scene).solve()
    body = flockform.Body(soft_bar | {"equilibrium": {"solver": "jacobi", "most_iterations": 3}})
    way = body.solve()
    assert way["reason"] != "equilibrium" and body.residual == way["residual"] > 0.0
    body.advance()
    assert body.residual != way["residual"]


def test_a_body_is_laid_out_for_the_accuracy_that_its_scene_asks_for(soft_bar):
    cantilever = soft_bar | {
        "lattice": {"kind": "square", "spacing": 2.0},
        "body": {"shape": {"kind": "rectangle", "max": [20.0, 8.0]}},
        "loads": [{"kind": "traction", "region": {"kind": "edge", "side": "right"}, "traction": [0.0, 1.0]}],
        "equilibrium": {"accuracy": "3%"},
    }
    body = flockform.Body(cantilever)
    body.solve()
    assert np.array_equal(body.positions(), flockform.run(cantilever).positions[-1])


def test_a_load_that_is_taken_off_in_steps_is_solved_to_the_last_of_them(soft_bar):
    body = flockform.Body(soft_bar | {"load_steps": {"schedule": [1.0, 0.3]}})
    body.solve()
    (reaction,) = body.reactions()
    assert reaction["force"] == pytest.approx([-12.0, 0.0], abs=1e-6)


def test_a_body_without_material_has_no_stress():
    body = flockform.Body("tension")
    for read in (body.stress, body.reactions, body.mechanics):
        with pytest.raises(flockform.SceneError, match="help: "):
            read()


def test_measures_of_a_body_have_a_row_for_each_particle():
    body = flockform.run("tension", set={"stop.steps": 20}).body
    assert body.pe1().shape == body.pe2().shape == body.ids().shape == body.roles().shape == (144,)
    assert body.strain().shape == (144, 4) and body.displacements().shape == (144, 2)
    names = np.asarray(flockform.ROLES)[body.roles()]
    assert {role: int((names == role).sum()) for role in set(names)} == {
        "follower": 80,
        "leader": 10,
        "clamped": 10,
        "frame": 44,
    }
    assert np.array_equal(np.flatnonzero(names == "leader"), body.particles("leader"))
    assert body.broken_bonds().shape == (0, 2)
    assert 0.0 < body.residual < 1.0


def test_bonds_break():
    body = flockform.run("fracture", set={"stop.steps": 95}).body
    broken = body.broken_bonds()
    assert broken.shape[1] == 2 and len(broken) > 20 and (broken[:, 0] < broken[:, 1]).all()


def test_a_copy_goes_its_own_way(held_sheet):
    body = flockform.Body(held_sheet)
    body.lead(0, [-1.0, -1.0])
    twin, other = body.copy(), copy.deepcopy(body)
    body.advance(3)
    assert twin.step == other.step == 0
    twin.advance(3)
    assert np.array_equal(twin.positions(), body.positions())


@pytest.mark.parametrize(
    ("particles", "places", "error", "words"),
    [
        (0, [1.0], ValueError, "places has shape (1,): give (1, 2)"),
        ([0, 1], [[1.0, 2.0]], ValueError, "places has shape (1, 2): give (2, 2)"),
        ([0, 1], [[1.0, 2.0], [3.0, np.nan]], ValueError, "places[1, 1] is NaN"),
        (0, [np.inf, 0.0], ValueError, "places[0] is inf"),
        (0, [1j, 0.0], TypeError, "places has dtype complex128"),
        (0, ["a", "b"], TypeError, "places has dtype <U1"),
        (0, [[1.0, 2.0], [3.0]], TypeError, "places is no array"),
        (0, None, TypeError, "places has dtype object"),
        (144, [0.0, 0.0], IndexError, "index 144: there are 0 to 143"),
        (-1, [0.0, 0.0], IndexError, "index -1"),
        (1.5, [0.0, 0.0], TypeError, "particles has dtype float64"),
        ([[0, 1]], [0.0, 0.0], ValueError, "particles has shape (1, 2)"),
        (30, [0.0, 0.0], ValueError, "is a follower: only leaders and clamped particles are led"),
    ],
)
def test_bad_arrays_are_refused_by_name(held_sheet, particles, places, error, words):
    body = flockform.Body(held_sheet)
    with pytest.raises(error) as caught:
        body.lead(particles, places)
    assert words in str(caught.value)
    body.advance()
    assert np.array_equal(body.positions(), body.reference())


def test_other_real_numbers_and_strides_are_taken(held_sheet):
    body = flockform.Body(held_sheet)
    body.lead(np.array([0, 1], dtype=np.uint8), np.array([[-1, -2], [-3, -4]], dtype=np.float32)[::-1])
    body.advance()
    assert body.positions()[:2].tolist() == [[-3.0, -4.0], [-1.0, -2.0]]
    body.lead([], np.empty((0, 2)))
    with pytest.raises(ValueError, match="places has shape"):
        body.observe(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="steps = 0"):
        body.advance(0)
    with pytest.raises(ValueError, match="give one of follower"):
        body.particles("boss")
