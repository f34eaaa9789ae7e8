"""What the tests of the Python package share."""

import csv
import os
import subprocess

import numpy as np
import pytest


@pytest.fixture(scope="session")
def program_result(tmp_path_factory):
    """Positions at the end of a run of the program, in the order of ids; FLOCKFORM_PROGRAM is the program."""
    program = os.environ.get("FLOCKFORM_PROGRAM")
    if program is None:
        pytest.skip("FLOCKFORM_PROGRAM does not name the program to compare with")
    folder = tmp_path_factory.mktemp("runs")

    def result(scene):
        out = folder / scene
        command = [program, "run", scene, "--quiet", "--no-report", "--out", str(out)]
        subprocess.run(command, check=True, timeout=120)
        with open(out / "final.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        assert [int(row["id"]) for row in rows] == list(range(1, len(rows) + 1))
        return np.array([[float(row["x"]), float(row["y"])] for row in rows])

    return result


@pytest.fixture
def soft_bar():
    """A bar of 20 x 4 cells: clamped at the left, pulled at the right."""
    return {
        "lattice": {"kind": "square", "spacing": 1.0},
        "body": {"shape": {"kind": "rectangle", "max": [20.0, 4.0]}},
        "material": {"kind": "isotropic", "young": 1000.0, "poisson": 0.3},
        "rule": {"mean": {"kind": "material"}},
        "roles": [{"region": {"kind": "edge", "side": "left"}, "role": "clamped"}],
        "loads": [{"kind": "traction", "region": {"kind": "edge", "side": "right"}, "traction": [10.0, 0.0]}],
        "equilibrium": {"solver": "auto"},
        "stop": {"steps": 1},
    }


@pytest.fixture
def held_sheet():
    """A square of 12 x 12 particles, clamped at two sides, which Python moves."""
    return {
        "lattice": {"kind": "square", "spacing": 1.0},
        "body": {"shape": {"kind": "grid", "columns": 12, "rows": 12}},
        "roles": [
            {"region": {"kind": "edge", "side": side}, "role": "clamped"} for side in ("left", "right")
        ],
        "stop": {"steps": 1000, "tolerance": 1e-6},
    }
