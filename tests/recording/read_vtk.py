"""Reads the last frame of a run with the package `meshio` (and `pyvista`, where it is installed), and holds it
against final.csv.

    read_vtk.py FOLDER-OF-THE-RUN
"""

import csv
import json
import math
import sys
import xml.etree.ElementTree as xml
from pathlib import Path

import meshio

ROLES = ["follower", "leader", "clamped", "frame", "ghost"]


def number(text):
    return float(text) if text else math.nan


def same(found, expected, where):
    found = float(found)
    assert found == expected or (math.isnan(found) and math.isnan(expected)), f"{where}: {found}, expected {expected}"


def hold(rows, points, data, where):
    assert len(points) == len(rows), f"{where}: {len(points)} points, {len(rows)} rows"
    for i, row in enumerate(rows):
        assert int(data["id"][i]) == int(row["id"])
        assert ROLES[int(data["role"][i])] == row["role"]
        for axis, (now, then) in enumerate((("x", "X"), ("y", "Y"))):
            same(points[i][axis], number(row[now]), f"{where}, {now} of {i + 1}")
            moved = number(row[now]) - number(row[then])
            same(data["displacement"][i][axis], moved, f"{where}, displacement of {i + 1}")
        for name in ("pe1", "pe2", "rotation"):
            same(data[name][i], number(row[name]), f"{where}, {name} of {i + 1}")
        for k, name in enumerate(("strain_xx", "strain_yy", "strain_xy")):
            same(data["strain"][i][k], number(row[name]), f"{where}, {name} of {i + 1}")
        if "von_mises" in row:
            same(data["von_mises"][i], number(row["von_mises"]), f"{where}, von_mises of {i + 1}")
            for k, name in enumerate(("stress_xx", "stress_yy", "stress_xy")):
                same(data["stress"][i][k], number(row[name]), f"{where}, {name} of {i + 1}")


def main(folder):
    folder = Path(folder)
    rows = list(csv.DictReader((folder / "final.csv").open()))
    frames = xml.parse(folder / "steps.pvd").getroot().findall(".//DataSet")
    last = folder / frames[-1].get("file")
    mesh = meshio.read(last)
    hold(rows, mesh.points, mesh.point_data, "meshio")
    kinds = {kind: [k for k, block in enumerate(mesh.cells) if block.type == kind] for kind in ("vertex", "line")}
    lines = sum(len(mesh.cells[k].data) for k in kinds["line"])
    polygons = [k for k in range(len(mesh.cells)) if k not in kinds["vertex"] + kinds["line"]]
    if kinds["vertex"] or not polygons:
        assert sum(len(mesh.cells[k].data) for k in kinds["vertex"]) == len(rows)
    breaks = folder / "breaks.csv"
    broken = len(list(csv.DictReader(breaks.open()))) if breaks.exists() else 0
    found = sum(int(mesh.cell_data["broken"][k].sum()) for k in kinds["line"])
    assert found == broken, (found, broken)
    if "von_mises" in mesh.cell_data:
        assert polygons
        # The summary names the largest of any cell, or, where that is larger, of a particle on a free edge.
        peak = json.loads((folder / "summary.json").read_text())["mechanics"]["largest_von_mises"]
        largest = max(float(mesh.cell_data["von_mises"][k].max()) for k in polygons)
        if peak["cell"] is None:
            at_edge = [row for row in rows if int(row["id"]) == peak["particles"][0]]
            same(number(at_edge[0]["von_mises"]), peak["von_mises"], "largest von Mises stress at the edge")
            assert peak["von_mises"] > largest
        else:
            same(largest, peak["von_mises"], "largest von Mises stress")
    if "stress" in mesh.point_data:
        # sqrt(xx^2 - xx yy + yy^2 + 3 xy^2) in plane stress.
        for i, (xx, yy, xy) in enumerate(mesh.point_data["stress"]):
            expected = math.sqrt(xx * xx - xx * yy + yy * yy + 3 * xy * xy)
            found = float(mesh.point_data["von_mises"][i])
            assert math.isclose(found, expected, rel_tol=1e-12) or math.isnan(expected), (i, found, expected)
    cells = sum(len(mesh.cells[k].data) for k in polygons)
    words = f"{len(frames)} frames, {len(rows)} points, {lines} bonds, {broken} broken, {cells} cells"
    try:
        import pyvista
    except ImportError:
        print(f"{words}; no pyvista")
        return
    grid = pyvista.read(last)
    hold(rows, grid.points, grid.point_data, "pyvista")
    assert int(grid.cell_data["broken"].sum()) == broken
    print(f"{words}; read by pyvista too")


main(*sys.argv[1:])
