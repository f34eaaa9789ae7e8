"""Puts the plate of `flockform bench scale --large` to rest by PETSc: N x N bilinear cells in plane stress, clamped along the
left edge and pulled along the right one, by conjugate gradients with smoothed aggregation (GAMG), to a relative residual of 1e-10.

    mpirun -n 2 python3 petsc.py N [options of PETSc, such as -log_view]

Prints one line of JSON: seconds of the assembly, of the set-up of the solver and of the solve; iterations; and the displacement
of the middle of the right edge. Needs petsc4py, with real numbers; on Debian `python3-petsc4py`.
"""

import json
import sys
from itertools import product

import numpy
import petsc4py

petsc4py.init(sys.argv)
from petsc4py import PETSc  # noqa: E402

YOUNG, POISSON, TRACTION = 1000.0, 0.3, 1.0
TOLERANCE = 1e-10
CORNERS = list(product((0, 1), (0, 1)))
# Ascending as the numbers of the particles are, column by column.
OFFSETS = list(product((-1, 0, 1), (-1, 0, 1)))


def cell_stiffness():
    """Blocks between the corners of a square cell, shape [4, 4, 2, 2]; 2 x 2 Gauss points."""
    law = YOUNG / (1 - POISSON**2) * numpy.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, (1 - POISSON) / 2]])
    stiffness = numpy.zeros((4, 2, 4, 2))
    for s, t in product((0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5), repeat=2):
        along = {0: (1 - s, -1.0), 1: (s, 1.0)}
        across = {0: (1 - t, -1.0), 1: (t, 1.0)}
        strain = numpy.zeros((3, 4, 2))
        for corner, (p, q) in enumerate(CORNERS):
            x, y = along[p][1] * across[q][0], along[p][0] * across[q][1]
            strain[:, corner] = [[x, 0], [0, y], [y, x]]
        stiffness += 0.25 * numpy.einsum("ikm,ij,jln->kmln", strain, law, strain)
    return stiffness.transpose(0, 2, 1, 3)


def rows(cells, own):
    """The rows of the particles in these columns, without those of the clamped one: ends, columns, values."""
    column, row = (grid.ravel() for grid in numpy.meshgrid(own, numpy.arange(cells + 1), indexing="ij"))
    blocks = numpy.zeros((len(column), 2, len(OFFSETS), 2))
    stiffness = cell_stiffness()
    for (own_corner, (p, q)), (other, (r, s)) in product(enumerate(CORNERS), enumerate(CORNERS)):
        exists = (column - p < cells) & (row - q >= 0) & (row - q < cells)
        offset = OFFSETS.index((r - p, s - q))
        blocks[:, :, offset] += exists[:, None, None] * stiffness[own_corner, other]
    a, b = numpy.array(OFFSETS).T
    columns, rows = column[:, None] + a, row[:, None] + b
    is_there = (columns >= 1) & (columns <= cells) & (rows >= 0) & (rows <= cells)
    number = (columns - 1) * (cells + 1) + rows
    unknowns = numpy.broadcast_to((2 * number[..., None] + [0, 1])[:, None], blocks.shape)
    is_there = numpy.broadcast_to(is_there[:, None], blocks.shape[:3])
    ends = numpy.concatenate([[0], numpy.cumsum(2 * is_there.sum(axis=2).ravel())])
    return ends.astype(PETSc.IntType), unknowns[is_there].ravel().astype(PETSc.IntType), blocks[is_there].ravel()


def main():
    if len(sys.argv) < 2 or not sys.argv[1].isdigit() or int(sys.argv[1]) < 2:
        sys.exit("give the number of cells along a side, at least 2")
    cells, world = int(sys.argv[1]), PETSc.COMM_WORLD
    rank, ranks = world.getRank(), world.getSize()
    times = {}

    def timed(name, work):
        world.barrier()
        begin = PETSc.Log.getTime()
        result = work()
        world.barrier()
        times[name] = PETSc.Log.getTime() - begin
        return result

    own = 1 + numpy.arange(cells * rank // ranks, cells * (rank + 1) // ranks)
    sizes = [(2 * len(own) * (cells + 1), 2 * cells * (cells + 1))] * 2
    # Places as unknowns are ordered: both components of a particle after each other.
    places = numpy.stack(numpy.meshgrid(own, numpy.arange(cells + 1.0), indexing="ij"), axis=-1)

    def assemble():
        matrix = PETSc.Mat().createAIJ(sizes, bsize=2, csr=rows(cells, own), comm=world)
        matrix.setOption(PETSc.Mat.Option.SPD, True)
        coordinates = matrix.createVecRight()
        coordinates.setBlockSize(2)
        coordinates.setArray(places.ravel())
        matrix.setNearNullSpace(PETSc.NullSpace().createRigidBody(coordinates))
        load = matrix.createVecLeft()
        forces = numpy.zeros(places.shape)
        share = numpy.where((places[..., 1] == 0) | (places[..., 1] == cells), 0.5, 1.0)
        forces[..., 0] = TRACTION * share * (places[..., 0] == cells)
        load.setArray(forces.ravel())
        return matrix, load

    matrix, load = timed("assembly", assemble)
    solver = PETSc.KSP().create(world)
    solver.setOperators(matrix)
    solver.setType("cg")
    solver.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
    solver.getPC().setType("gamg")
    solver.setTolerances(rtol=TOLERANCE, max_it=1000)
    solver.setFromOptions()
    displacement = matrix.createVecRight()
    timed("set_up", solver.setUp)
    timed("solve", lambda: solver.solve(load, displacement))
    middle = displacement.getArray().reshape(places.shape)[own == cells, cells // 2].sum(axis=0)
    tip = [world.tompi4py().allreduce(component) for component in middle.tolist()]
    if rank == 0:
        iterations, reason = solver.getIterationNumber(), solver.getConvergedReason()
        seconds = {f"{name}_seconds": round(time, 4) for name, time in times.items()}
        answer = {"cells": cells, "ranks": ranks, **seconds, "iterations": iterations}
        print(json.dumps({**answer, "converged": reason > 0, "tip": tip}))


main()
