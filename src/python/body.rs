//! `flockform.Body`: a body that Python steps, leads and reads.

use std::time::{Duration, Instant};

use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{moved, pairs, placed, rows};
use super::beside::beside;
use super::errors::{as_dict, diverged};
use super::run::{interrupt_by, positive, words};
use super::source::Source;
use super::threads::{Threads, here};
use crate::continuum::equilibrium::{run_to_equilibrium_watched, solve_equilibrium};
use crate::continuum::mechanics::{Mechanics, Stresses};
use crate::continuum::run::{Divergence, Outcome, StopReason, overflow};
use crate::engine::Engine;
use crate::engine::forces::{Forces, held};
use crate::engine::observer::EachStep;
use crate::flock::role::Role;
use crate::scene::{Scene, SceneError};
use crate::solve::equilibrium::Request;
use crate::solve::interrupt::Interrupt;
use crate::study::compare::run::plan;

/// Longest time between two looks for a signal, but for a single step that takes longer.
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// A body that is stepped, led and read.
///
/// Body(scene, *, set=None) lays a scene out in its reference configuration. Particles are counted from 0, in the
/// order of all arrays; `ids` has the numbers that files and messages call them by.
#[pyclass(module = "flockform")]
pub(super) struct Body {
    scene: Scene,
    engine: Engine,
    /// Of the solve that put the body to rest, if it has not moved since.
    residual: Option<f64>,
}

impl Body {
    /// The body of a scene as an engine has it.
    pub(super) fn at(scene: Scene, engine: Engine, residual: Option<f64>) -> Self {
        Self { scene, engine, residual }
    }

    pub(super) fn count(&self) -> usize {
        self.engine.body().count()
    }

    /// Steps until `end`, until the body diverges, or for as long as Python may have to wait.
    fn go(&mut self, end: usize) -> Option<Divergence> {
        let begun = Instant::now();
        while self.engine.step() < end && begun.elapsed() < BETWEEN_LOOKS {
            self.engine.advance_at_most(end - self.engine.step());
            // After every batch, so that the step of it does not depend on the clock.
            let divergence = overflow(&self.engine);
            if divergence.is_some() {
                return divergence;
            }
        }
        None
    }

    fn require_led(&self, particle: usize) -> PyResult<()> {
        let role = self.engine.roles()[particle];
        if role.is_led() {
            return Ok(());
        }
        let id = self.engine.body().id(particle);
        let is_held = held(&self.engine).iter().flatten().any(|held| held.particle == particle);
        let (what, help) = match is_held {
            true => ("held along an axis alone".to_owned(), "leave `axis` out of its role in the scene"),
            false => (format!("a {}", role.name()), "give it a role in the scene"),
        };
        Err(PyValueError::new_err(format!(
            "particle {particle} (id {id}) is {what}: only leaders and clamped particles are led; {help}"
        )))
    }

    fn require_material(&self) -> Result<(), SceneError> {
        self.scene.material.map(|_| ()).ok_or_else(|| {
            let help = "add [material] with kind = \"isotropic\", young and poisson";
            self.scene.refuse("material", "stress is that of a material, and the scene has none", help)
        })
    }

    fn without_stiffness(&self) -> SceneError {
        let help = "use rule.mean.kind = \"material\"";
        self.scene.refuse(
            "rule.mean",
            "the rule has no stiffness, so nothing holds the body by a force",
            help,
        )
    }

    fn of_each<'py>(
        &self,
        py: Python<'py>,
        value: impl Fn(usize) -> f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        moved(py, (0..self.count()).map(value).collect(), &[self.count()])
    }
}

#[pymethods]
impl Body {
    #[new]
    #[pyo3(signature = (scene, *, set=None))]
    fn new(py: Python<'_>, scene: &Bound<'_, PyAny>, set: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let source = Source::scene(scene, set)?;
        let laid_out = beside(py, None, move |progress| {
            let scene = source.chosen(progress)?;
            let plan = plan(&scene)?;
            Ok::<_, SceneError>((scene, Engine::new(plan.setup)))
        });
        let (scene, engine) = laid_out??;
        Ok(Self::at(scene, engine, None))
    }

    /// Steps taken so far; of a body that was put to rest, the step that it rests at.
    #[getter]
    fn step(&self) -> usize {
        self.engine.step()
    }

    /// Number of particles, those of a frame included.
    #[getter(count)]
    fn particle_count(&self) -> usize {
        self.count()
    }

    /// Distance between neighbours in the lattice [length].
    #[getter]
    fn spacing(&self) -> f64 {
        self.engine.body().lattice.spacing()
    }

    /// Largest motion of a particle in the last step, over the spacing [1], 0 before the first; of a body that was put to rest, the
    /// force that its solver left over that of its load [1].
    #[getter]
    fn residual(&self, py: Python<'_>) -> PyResult<f64> {
        match self.residual {
            Some(residual) => Ok(residual),
            None => Ok(here(py, || self.engine.movement())?.largest_move),
        }
    }

    /// Steps the body, by one step unless `steps` is given.
    ///
    /// Raises DivergedError once a particle has no finite place any more, or one so far that energies overflow. The body is
    /// lost then: what is to be kept is copied before.
    #[pyo3(signature = (steps=1))]
    fn advance(&mut self, py: Python<'_>, steps: i64) -> PyResult<()> {
        let end = self.engine.step().saturating_add(positive("steps", steps)?);
        let threads = Threads::taken()?;
        self.residual = None;
        while self.engine.step() < end {
            let mut go = || self.go(end);
            if let Some(divergence) = py.detach(|| threads.install(&mut go)) {
                return Err(diverged(&divergence));
            }
            py.check_signals()?;
        }
        Ok(())
    }

    /// Leads particles to these places in the next step: an index and a place, or as many of both.
    ///
    /// places [length], shape (2,) or (k, 2). They stay there, but for leaders with a motion of their own.
    fn lead(&mut self, particles: &Bound<'_, PyAny>, places: &Bound<'_, PyAny>) -> PyResult<()> {
        let led = placed(Some(particles), places, self.count())?;
        led.iter().try_for_each(|&(particle, _)| self.require_led(particle))?;
        led.into_iter().for_each(|(particle, place)| self.engine.lead(particle, place));
        Ok(())
    }

    /// Puts particles where they were seen, in place of where the last step sent them.
    ///
    /// places [length], shape (k, 2) for k particles, or (count, 2) for all of them.
    #[pyo3(signature = (places, particles=None))]
    fn observe(&mut self, places: &Bound<'_, PyAny>, particles: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        self.engine.observe(placed(particles, places, self.count())?);
        self.residual = None;
        Ok(())
    }

    /// Puts the body to the equilibrium that the scene asks for, without stepping there: under its loads, its leaders
    /// where their motions end. What was led or observed by hand is not part of the scene, and forgotten.
    ///
    /// Returns a dict with the keys reason, words, residual, solver, iterations.
    fn solve<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut scene = self.scene.clone();
        let outcome = beside(py, None, move |progress| {
            interrupt_by(&mut scene, progress);
            scene.require_stepless()?;
            let plan = plan(&scene)?;
            if scene.equilibrium.is_some() {
                let mut see = |_: &Engine, _: f64| std::ops::ControlFlow::Continue(());
                return run_to_equilibrium_watched(&scene, plan, &mut EachStep(&mut see));
            }
            let request = Request { interrupt: Interrupt::new(progress.flag), ..Request::default() };
            solve_equilibrium(&scene, &request, plan)
        });
        let Outcome { engine, reason, residual, solved } = outcome??;
        if let StopReason::Diverged(divergence) = &reason {
            return Err(diverged(divergence));
        }
        *self = Self::at(self.scene.clone(), engine, Some(residual));
        let way = PyDict::new(py);
        way.set_item("reason", reason.name())?;
        way.set_item("words", words(&reason))?;
        way.set_item("residual", residual)?;
        way.set_item("solver", solved.as_ref().map(|solved| solved.solver.name()))?;
        way.set_item("iterations", solved.as_ref().map(|solved| solved.iterations))?;
        Ok(way)
    }

    /// A body in the same state that goes its own way.
    fn copy(&self) -> Self {
        Self { scene: self.scene.clone(), engine: self.engine.clone(), residual: self.residual }
    }

    /// Present places [length], float64, shape (count, 2); a copy.
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        pairs(py, self.engine.present())
    }

    /// Places in the reference configuration [length], float64, shape (count, 2).
    fn reference<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        pairs(py, &self.engine.body().reference)
    }

    /// Displacements from the reference configuration [length], float64, shape (count, 2): of a body that was put to
    /// rest, to the digits of the solver.
    fn displacements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        pairs(py, &self.engine.displacements())
    }

    /// Ids of the particles, int64, shape (count,).
    fn ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        let ids = (0..self.count()).map(|i| self.engine.body().id(i) as i64);
        moved(py, ids.collect(), &[self.count()])
    }

    /// Roles of the particles as numbers of flockform.ROLES, uint8, shape (count,).
    fn roles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
        moved(py, self.engine.roles().iter().map(|role| role.number()).collect(), &[self.count()])
    }

    /// Indices of the particles of a role, int64, shape (k,).
    fn particles<'py>(&self, py: Python<'py>, role: &str) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        if !Role::ALL.iter().any(|one| one.name() == role) {
            let all = Role::ALL.map(Role::name).join(", ");
            return Err(PyValueError::new_err(format!("role = `{role}`: give one of {all}")));
        }
        let of_role = self.engine.roles().iter().enumerate().filter(|(_, one)| one.name() == role);
        let found: Vec<i64> = of_role.map(|(i, _)| i as i64).collect();
        let shape = [found.len()];
        moved(py, found, &shape)
    }

    /// First pseudo-energy, the squared change of the distances to the neighbours [length^2], shape (count,).
    fn pe1<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.of_each(py, |i| self.engine.pe1(i))
    }

    /// Second pseudo-energy, the length of the last move [length], shape (count,).
    fn pe2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.of_each(py, |i| self.engine.pe2(i))
    }

    /// Strain and rotation of each particle's surroundings: xx, yy, xy [1] and rotation [rad], shape (count, 4); NaN
    /// where a particle sees too few.
    fn strain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let of = |i| match self.engine.strain(i) {
            Some(strain) => {
                let [xx, yy, xy] = strain.components;
                [xx, yy, xy, strain.rotation]
            }
            None => [f64::NAN; 4],
        };
        rows(py, (0..self.count()).map(of))
    }

    /// Index pairs of the bonds broken so far, in the order they broke, int64, shape (k, 2).
    fn broken_bonds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        let breaks = self.engine.breaks();
        moved(py, breaks.iter().flat_map(|one| one.pair.map(i64::from)).collect(), &[breaks.len(), 2])
    }

    /// Stress of a body with a material [force / length^2], a dict of arrays:
    /// cells (cells, 3) with xx, yy, xy at their centres, cell_places (cells, 2) [length], cell_von_mises (cells,);
    /// particles (count, 3), particle_von_mises (count,). NaN across a broken bond, and for a particle in no cell.
    fn stress<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.require_material()?;
        let found = here(py, || Stresses::at_present(&self.engine))?;
        let (Some(stresses), Some(cells)) = (found, self.engine.cells()) else {
            return Err(self.without_stiffness().into());
        };
        let of_particle = |k: usize| stresses.particles[k].map_or([f64::NAN; 3], |one| one.components);
        let mises = |k: usize| stresses.particles[k].map_or(f64::NAN, |one| one.von_mises);
        let dict = PyDict::new(py);
        dict.set_item("cells", rows(py, stresses.cells.iter().map(|one| one.components))?)?;
        dict.set_item("cell_places", pairs(py, &cells.centres(&self.engine.body().reference))?)?;
        let of_cells: Vec<f64> = stresses.cells.iter().map(|one| one.von_mises).collect();
        dict.set_item("cell_von_mises", moved(py, of_cells, &[stresses.cells.len()])?)?;
        dict.set_item("particles", rows(py, (0..self.count()).map(of_particle))?)?;
        dict.set_item("particle_von_mises", self.of_each(py, mises)?)?;
        Ok(dict)
    }

    /// Force, moment and place of what holds the body, a dict for each entry of `roles` that holds particles: key,
    /// role, particles, centre [length], displacement [length], force [force], moment and moment_about_origin
    /// [force length].
    fn reactions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = here(py, || Forces::of(&self.engine).map(|forces| forces.reactions(&self.engine)))?;
        as_dict(py, &found.ok_or_else(|| self.without_stiffness())?)
    }

    /// Reactions, loads, strain energy, work and the largest stress, with the keys of `summary.json`.
    fn mechanics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.require_material()?;
        let found = here(py, || Mechanics::of(&self.engine))?;
        as_dict(py, &found.ok_or_else(|| self.without_stiffness())?)
    }

    fn __copy__(&self) -> Self {
        self.copy()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.copy()
    }

    fn __repr__(&self) -> String {
        format!(
            "<flockform.Body of {}, {} particles, step {}>",
            self.scene.name,
            self.count(),
            self.engine.step()
        )
    }
}
