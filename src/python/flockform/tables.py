"""Runs and bodies as tables: xarray and pandas, which are imported only here (``pip install flockform[tables]``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._core import ROLES, Body, Run

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = ["to_pandas", "to_xarray"]


def to_xarray(run: Run) -> xarray.Dataset:
    """Frames of a run, without a copy of them.

    ``position`` [length] over ``step``, ``particle`` (ids) and ``axis``; ``reference`` [length] over the last two.
    """
    import xarray

    body = run.body
    return xarray.Dataset(
        {
            "position": (("step", "particle", "axis"), run.positions, {"units": run.unit}),
            "reference": (("particle", "axis"), body.reference(), {"units": run.unit}),
            "role": ("particle", np.asarray(ROLES)[body.roles()]),
        },
        coords={"step": run.steps, "particle": body.ids(), "axis": ["x", "y"]},
        attrs={"name": run.name, "reason": run.reason},
    )


def to_pandas(body: Body) -> pandas.DataFrame:
    """A row for each particle, by id: role, reference and present place [length], PE1 [length^2], PE2 [length]."""
    import pandas

    (X, Y), (x, y) = body.reference().T, body.positions().T
    columns = {
        "role": pandas.Categorical.from_codes(body.roles(), list(ROLES)),
        "X": X,
        "Y": Y,
        "x": x,
        "y": y,
        "pe1": body.pe1(),
        "pe2": body.pe2(),
    }
    return pandas.DataFrame(columns, index=pandas.Index(body.ids(), name="id"))
