"""Studies, tables, stubs."""

import ast
import inspect
from pathlib import Path

import numpy as np
import pytest

import flockform


def test_the_rule_of_the_paper_is_a_material_of_ratio_minus_one():
    report = flockform.material("tension")
    assert report["material"]["poisson_plane_stress"] == pytest.approx(-1.0)
    assert flockform.material("beam")["material"]["poisson_plane_stress"] == pytest.approx(0.33)


def test_the_material_rule_is_near_the_truth_and_the_paper_rule_is_not():
    near, far = flockform.compare("beam"), flockform.compare("beam-paper")
    assert near.measures["displacement_rel_l2"] < 0.005 and far.measures["displacement_rel_l2"] > 0.2
    follows = near.body.particles("follower")
    off = np.linalg.norm((near.rule - near.truth)[follows]) / np.linalg.norm(near.truth[follows])
    assert off == pytest.approx(near.measures["displacement_rel_l2"], rel=1e-9)
    assert near.von_mises_rule.shape == near.von_mises_truth.shape == (121,) == near.cell_places.shape[:1]
    assert near.reason == "equilibrium" and near.name == "beam"


def test_thresholds_are_predicted_and_found():
    study = flockform.stability("tension", quick=True)
    assert study["holds"] and study["extremes"] == []
    found = {(one["parameter"], one["side"]): one for one in study["linear"]["thresholds"]}
    assert any(one["predicted"]["value"] == pytest.approx(0.006866, abs=2e-6) for one in found.values())


def test_tables_have_the_numbers_of_the_run():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    from flockform import tables

    run = flockform.run("tension", set={"stop.steps": 20}, every=5)
    data = tables.to_xarray(run)
    assert np.shares_memory(data["position"].values, run.positions)
    assert data["position"].sel(step=20, particle=67, axis="x").item() == run.positions[-1, 66, 0]
    table = tables.to_pandas(run.body)
    assert table.loc[67, "x"] == run.positions[-1, 66, 0] and (table["role"] == "clamped").sum() == 10


def stubs():
    """Classes, functions and methods of the stub, by dotted name."""
    text = (Path(flockform.__file__).parent / "_core.pyi").read_text()
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef):
            if node.name.startswith("_"):
                continue
            yield node.name, node
            for inner in node.body:
                if isinstance(inner, ast.FunctionDef):
                    yield f"{node.name}.{inner.name}", inner
        elif isinstance(node, ast.FunctionDef):
            yield node.name, node


def runtime(name):
    thing = flockform
    for part in name.split("."):
        thing = getattr(thing, part)
    return thing


def test_stubs_describe_what_is_there():
    names = dict(stubs())
    for name, node in names.items():
        thing = runtime(name)
        documented = not name.rpartition(".")[2].startswith("__")
        if documented:
            assert inspect.getdoc(thing) == ast.get_docstring(node), name
        if isinstance(node, ast.FunctionDef) and callable(thing) and documented:
            found = [p for p in inspect.signature(thing).parameters]
            assert found == [a.arg for a in node.args.args + node.args.kwonlyargs], name
    for thing in flockform.__all__:
        if isinstance(getattr(flockform, thing), type):
            own = {one for one in vars(getattr(flockform, thing)) if not one.startswith("_")}
            assert own == {
                name.split(".")[1]
                for name in names
                if name.startswith(f"{thing}.") and not name.split(".")[1].startswith("__")
            }, thing
        elif callable(getattr(flockform, thing)):
            assert thing in names
