"""flockform: one set of flocking rules that makes a body deform or a swarm hold a formation.

Arrays are numpy's; lengths are in the unit of the scene, those of a swarm in metres. Particles and robots are counted
from 0. What is wrong with a scene is said by :class:`SceneError`, with file, line, key and remedy.
"""

from ._core import (
    ROLES,
    SCENES,
    SWARMS,
    Body,
    Comparison,
    DivergedError,
    Run,
    SceneError,
    Swarm,
    __version__,
    compare,
    material,
    run,
    stability,
)

__all__ = [
    "ROLES",
    "SCENES",
    "SWARMS",
    "Body",
    "Comparison",
    "DivergedError",
    "Run",
    "SceneError",
    "Swarm",
    "__version__",
    "compare",
    "material",
    "run",
    "stability",
]
