"""Types of flockform's compiled part, with units in brackets and shapes of arrays."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, SupportsIndex, TypeAlias, TypedDict, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

_File: TypeAlias = str | PathLike[str] | Mapping[str, Any]
_Set: TypeAlias = Mapping[str, Any] | Sequence[str]
_Role: TypeAlias = Literal["follower", "leader", "clamped", "frame", "ghost"]
_Reason: TypeAlias = Literal["equilibrium", "unsettled", "stuck", "steps", "interrupted", "diverged"]
_Health: TypeAlias = Literal["waiting", "fresh", "held", "degraded", "stopped"]

__version__: str
ROLES: list[_Role]
SCENES: list[str]
SWARMS: list[str]

class _Problem(TypedDict):
    place: str
    line: int | None
    key: str
    found: str | None
    message: str
    help: str | None

class _Solution(TypedDict):
    reason: _Reason
    words: str
    residual: float
    solver: str | None
    iterations: int | None

class _Stress(TypedDict):
    cells: NDArray[np.float64]
    cell_places: NDArray[np.float64]
    cell_von_mises: NDArray[np.float64]
    particles: NDArray[np.float64]
    particle_von_mises: NDArray[np.float64]

class SceneError(ValueError):
    """A scene or swarm file that cannot be: its text names file, line, key, value and remedy.

    `problems` has the same as a list of dicts with the keys `place`, `line`, `key`, `found`, `message` and `help`.
    """

    problems: list[_Problem]

class DivergedError(RuntimeError):
    """A body that ceased to be one: its text names step, particle and likely cause."""

def run(
    scene: _File,
    *,
    set: _Set | None = None,
    every: int | None = None,
    progress: Callable[[int, float], object] | None = None,
) -> Run:
    """Runs a scene to its end, as `flockform run` does, and returns what came of it.

    scene: name of a bundled scene, path of a scene file, or a scene as a dict.
    set: keys to change, a dict such as {"stop.steps": 50} or texts KEY.PATH=VALUE.
    every: steps from one frame to the next; without it the end alone is kept.
    progress: called as progress(step, residual) several times a second; the residual is infinite before the first
    report. A scene that is solved reports its end alone.

    Raises SceneError for a scene that cannot be, and MemoryError for more frames than fit where
    the address space is limited (ulimit -v).
    """

@final
class Run:
    """A scene that was run to its end."""

    @property
    def name(self) -> str:
        """Short name of the scene."""

    @property
    def unit(self) -> str:
        """The unit of length."""

    @property
    def reason(self) -> _Reason:
        """Why the run ended: "equilibrium", "unsettled", "stuck", "steps" or "diverged"."""

    @property
    def words(self) -> str:
        """The same as a sentence, where there is more to say."""

    @property
    def residual(self) -> float:
        """Largest one-step motion over the spacing, at the last step [1]."""

    @property
    def solver(self) -> str | None:
        """The solver that found the equilibrium; None for a run that was stepped."""

    @property
    def iterations(self) -> int | None:
        """Iterations of the solver."""

    @property
    def steps(self) -> NDArray[np.int64]:
        """Steps of the frames, int64, shape (frames,); the last is the end."""

    @property
    def positions(self) -> NDArray[np.float64]:
        """Places in the frames [length], float64, shape (frames, count, 2)."""

    @property
    def body(self) -> Body:
        """The body at the end."""

@final
class Body:
    """A body that is stepped, led and read.

    Body(scene, *, set=None) lays a scene out in its reference configuration. Particles are counted from 0, in the
    order of all arrays; `ids` has the numbers that files and messages call them by.
    """

    def __init__(self, scene: _File, *, set: _Set | None = None) -> None: ...
    @property
    def step(self) -> int:
        """Steps taken so far; of a body that was put to rest, the step that it rests at."""

    @property
    def count(self) -> int:
        """Number of particles, those of a frame included."""

    @property
    def spacing(self) -> float:
        """Distance between neighbours in the lattice [length]."""

    @property
    def residual(self) -> float:
        """Largest motion of a particle in the last step, over the spacing [1], 0 before the first; of a body that was put to rest, the
        force that its solver left over that of its load [1].
        """

    def advance(self, steps: int = 1) -> None:
        """Steps the body, by one step unless `steps` is given.

        Raises DivergedError once a particle has no finite place any more, or one so far that energies overflow. The body is
        lost then: what is to be kept is copied before.
        """

    def lead(self, particles: ArrayLike, places: ArrayLike) -> None:
        """Leads particles to these places in the next step: an index and a place, or as many of both.

        places [length], shape (2,) or (k, 2). They stay there, but for leaders with a motion of their own.
        """

    def observe(self, places: ArrayLike, particles: ArrayLike | None = None) -> None:
        """Puts particles where they were seen, in place of where the last step sent them.

        places [length], shape (k, 2) for k particles, or (count, 2) for all of them.
        """

    def solve(self) -> _Solution:
        """Puts the body to the equilibrium that the scene asks for, without stepping there: under its loads, its leaders
        where their motions end. What was led or observed by hand is not part of the scene, and forgotten.

        Returns a dict with the keys reason, words, residual, solver, iterations.
        """

    def copy(self) -> Body:
        """A body in the same state that goes its own way."""

    def positions(self) -> NDArray[np.float64]:
        """Present places [length], float64, shape (count, 2); a copy."""

    def reference(self) -> NDArray[np.float64]:
        """Places in the reference configuration [length], float64, shape (count, 2)."""

    def displacements(self) -> NDArray[np.float64]:
        """Displacements from the reference configuration [length], float64, shape (count, 2): of a body that was put to
        rest, to the digits of the solver.
        """

    def ids(self) -> NDArray[np.int64]:
        """Ids of the particles, int64, shape (count,)."""

    def roles(self) -> NDArray[np.uint8]:
        """Roles of the particles as numbers of flockform.ROLES, uint8, shape (count,)."""

    def particles(self, role: _Role) -> NDArray[np.int64]:
        """Indices of the particles of a role, int64, shape (k,)."""

    def pe1(self) -> NDArray[np.float64]:
        """First pseudo-energy, the squared change of the distances to the neighbours [length^2], shape (count,)."""

    def pe2(self) -> NDArray[np.float64]:
        """Second pseudo-energy, the length of the last move [length], shape (count,)."""

    def strain(self) -> NDArray[np.float64]:
        """Strain and rotation of each particle's surroundings: xx, yy, xy [1] and rotation [rad], shape (count, 4); NaN
        where a particle sees too few.
        """

    def broken_bonds(self) -> NDArray[np.int64]:
        """Index pairs of the bonds broken so far, in the order they broke, int64, shape (k, 2)."""

    def stress(self) -> _Stress:
        """Stress of a body with a material [force / length^2], a dict of arrays:
        cells (cells, 3) with xx, yy, xy at their centres, cell_places (cells, 2) [length], cell_von_mises (cells,);
        particles (count, 3), particle_von_mises (count,). NaN across a broken bond, and for a particle in no cell.
        """

    def reactions(self) -> list[dict[str, Any]]:
        """Force, moment and place of what holds the body, a dict for each entry of `roles` that holds particles: key,
        role, particles, centre [length], displacement [length], force [force], moment and moment_about_origin
        [force length].
        """

    def mechanics(self) -> dict[str, Any]:
        """Reactions, loads, strain energy, work and the largest stress, with the keys of `summary.json`."""

    def __copy__(self) -> Body: ...
    def __deepcopy__(self, _memo: object) -> Body: ...

def material(scene: _File, *, set: _Set | None = None) -> dict[str, Any]:
    """The material that a scene's rule is in a body without edges: a dict with the keys of `flockform material --json`.

    scene and set as for run().
    """

def stability(
    scene: _File, *, set: _Set | None = None, quick: bool = False, extremes: bool = False
) -> dict[str, Any]:
    """When a scene's body grows instead of coming to rest, predicted and found by runs: a dict with the keys of
    `stability.json`.

    scene and set as for run(). quick: fewer and shorter runs. extremes: also bodies as bad as they come, slow.
    """

def compare(
    scene: _File,
    *,
    set: _Set | None = None,
    truth_error: float | None = None,
    progress: Callable[[int, float], object] | None = None,
) -> Comparison:
    """Runs a scene's rule and holds it against finite elements on the shape itself, as `flockform compare` does.

    scene, set and progress as for run(). truth_error: largest relative error of displacement that the finite elements
    may state of themselves [1].
    """

@final
class Comparison:
    """A rule beside the truth, which is that of finite elements."""

    @property
    def name(self) -> str:
        """Short name of the scene."""

    @property
    def reason(self) -> _Reason:
        """Why the rule's run ended, as of a Run."""

    @property
    def words(self) -> str:
        """The same as a sentence, where there is more to say."""

    @property
    def measures(self) -> dict[str, Any]:
        """Errors and energies, a dict with the keys of `compare.json`: displacement_rel_l2 [1], von_mises_rel_l2 [1], ..."""

    @property
    def rule(self) -> NDArray[np.float64]:
        """Displacements by the rule [length], float64, shape (count, 2)."""

    @property
    def truth(self) -> NDArray[np.float64]:
        """True displacements [length], float64, shape (count, 2); NaN outside the shape."""

    @property
    def cell_places(self) -> NDArray[np.float64]:
        """Centres of the cells in the reference configuration [length], float64, shape (cells, 2)."""

    @property
    def von_mises_rule(self) -> NDArray[np.float64]:
        """Von Mises stress of the rule at the centres of the cells [force / length^2], float64, shape (cells,)."""

    @property
    def von_mises_truth(self) -> NDArray[np.float64]:
        """The same of the finite elements, float64, shape (cells,)."""

    @property
    def body(self) -> Body:
        """The body at the end of the rule's run."""

@final
class Swarm:
    """A formation whose poses come from Python and whose targets go there.

    Swarm(file, *, set=None) reads a swarm: name of a bundled one, path of a swarm file, or a swarm as a dict. Robots
    are counted from 0, in the order of `names`.
    """

    def __init__(self, file: _File, *, set: _Set | None = None) -> None: ...
    @property
    def count(self) -> int:
        """Number of robots."""

    @property
    def names(self) -> list[str]:
        """Names of the robots."""

    @property
    def period(self) -> float:
        """Time from one tick to the next [s]."""

    @property
    def mode(self) -> Literal["running", "emergency-stopped"]:
        """The mode of the loop: "running" or "emergency-stopped"."""

    @property
    def manoeuvres(self) -> list[str]:
        """Names of the manoeuvres that begin() takes."""

    def places(self) -> NDArray[np.float64]:
        """Places of the robots in the formation as the file gives it [m], float64, shape (count, 2)."""

    def leaders(self) -> NDArray[np.bool_]:
        """Which robots lead, bool, shape (count,)."""

    def tick(
        self,
        poses: ArrayLike,
        *,
        heard: ArrayLike | None = None,
        stamps: ArrayLike | None = None,
        now: float | None = None,
        ranges: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """One period: poses in, safe targets out.

        poses: x, y [m] and, if there is a third column, yaw [rad], shape (count, 2) or (count, 3).
        heard: whose pose arrived, bool, shape (count,); all unless given. The row of a robot that was not heard is not
        read, but must be finite.
        stamps: when the poses were measured [s], shape (count,); now unless given.
        now: time of the tick [s]; one period after the last one unless given.
        ranges: how far robots measured others to be at the tick [m], shape (count, count), a row for each that measured;
        NaN where none did. Only of a swarm with [ranges].

        Returns the targets [m], float64, shape (count, 2); NaN for a robot without a usable pose, which is to stay
        where it is.
        """

    def rejections(self) -> dict[str, str]:
        """Why poses of the last tick were rejected: a dict from the robot's name to the reason."""

    def health(self) -> list[_Health]:
        """How young each robot's pose is: "waiting", "fresh", "held", "degraded" or "stopped"."""

    def wanted(self) -> NDArray[np.float64]:
        """Targets by the rule alone, before they were made safe [m], float64, shape (count, 2)."""

    def clearance(self) -> NDArray[np.float64]:
        """Free space around each robot, to its neighbours and to obstacles [m], float64, shape (count,)."""

    def formation_error(self) -> float | None:
        """Largest distance of a follower from where it comes to rest [m]; None where the rule is not linear, while a leader is lost, and
        where no follower is known.
        """

    def lead(self, robot: SupportsIndex | str, place: ArrayLike) -> None:
        """Gives a leader whose program is external its next place [m], shape (2,).

        robot: its name or index.
        """

    def begin(self, manoeuvre: str) -> None:
        """Moves all leaders by a manoeuvre of the swarm file from the next tick on."""

    def emergency_stop(self) -> None:
        """Brings every robot to rest from the next tick on, and holds it there until resume()."""

    def resume(self) -> bool:
        """Lifts an emergency stop; False if there is none."""

    def copy(self) -> Swarm:
        """A swarm in the same state that goes its own way."""

    def __copy__(self) -> Swarm: ...
    def __deepcopy__(self, _memo: object) -> Swarm: ...
