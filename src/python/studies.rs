//! `flockform.material`, `flockform.stability` and `flockform.compare`.

use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{moved, pairs};
use super::beside::beside;
use super::body::Body;
use super::errors::as_dict;
use super::run::words;
use super::source::Source;
use crate::continuum::bulk_response;
use crate::fem::Effort;
use crate::scene::{Scene, SceneError};
use crate::study::compare::run::{Compared, compare as compare_scene};
use crate::study::stability::bisection;
use crate::study::stability::extremes::plan;
use crate::study::stability::study::{Options, Study, run};

/// The material that a scene's rule is in a body without edges: a dict with the keys of `flockform material --json`.
///
/// scene and set as for run().
#[pyfunction]
#[pyo3(signature = (scene, *, set=None))]
pub(super) fn material<'py>(
    py: Python<'py>,
    scene: &Bound<'py, PyAny>,
    set: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let source = Source::scene(scene, set)?;
    let report = beside(py, None, move |_| bulk_response::material(&source.load(&[])?))??;
    as_dict(py, &report)
}

/// When a scene's body grows instead of coming to rest, predicted and found by runs: a dict with the keys of
/// `stability.json`.
///
/// scene and set as for run(). quick: fewer and shorter runs. extremes: also bodies as bad as they come, slow.
#[pyfunction]
#[pyo3(signature = (scene, *, set=None, quick=false, extremes=false))]
pub(super) fn stability<'py>(
    py: Python<'py>,
    scene: &Bound<'py, PyAny>,
    set: Option<&Bound<'py, PyAny>>,
    quick: bool,
    extremes: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let source = Source::scene(scene, set)?;
    let effort = if quick { bisection::Effort::quick() } else { bisection::Effort::default() };
    let options = Options { effort, no_extremes: !extremes };
    let study: Study = beside(py, None, move |progress| {
        plan(&source.load(&[])?)?;
        let load = |more: &[String]| {
            progress.leave_if_raised();
            source.load(more)
        };
        run(&load, options, &mut |_| progress.leave_if_raised())
    })??;
    let report = as_dict(py, &study)?;
    report.set_item("holds", study.holds())?;
    Ok(report)
}

/// Runs a scene's rule and holds it against finite elements on the shape itself, as `flockform compare` does.
///
/// scene, set and progress as for run(). truth_error: largest relative error of displacement that the finite elements
/// may state of themselves [1].
#[pyfunction]
#[pyo3(signature = (scene, *, set=None, truth_error=None, progress=None))]
pub(super) fn compare(
    py: Python<'_>,
    scene: &Bound<'_, PyAny>,
    set: Option<&Bound<'_, PyAny>>,
    truth_error: Option<f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Comparison> {
    let source = Source::scene(scene, set)?;
    let mut effort = Effort::default();
    if let Some(truth_error) = truth_error {
        effort.target = part_of_one(truth_error)?;
    }
    let (scene, compared) = beside(py, progress, move |progress| {
        let scene = source.chosen(progress)?;
        let compared =
            compare_scene(&scene, &effort, &mut |engine, residual| progress.see(engine, residual))?;
        Ok::<_, SceneError>((scene, compared))
    })??;
    Comparison::new(py, scene, compared)
}

fn part_of_one(truth_error: f64) -> PyResult<f64> {
    if truth_error > 0.0 && truth_error < 1.0 {
        return Ok(truth_error);
    }
    let message = format!("truth_error = {truth_error}: give a number more than 0 and less than 1");
    Err(PyValueError::new_err(message))
}

/// A rule beside the truth, which is that of finite elements.
#[pyclass(frozen, module = "flockform")]
pub(super) struct Comparison {
    /// Short name of the scene.
    #[pyo3(get)]
    name: String,
    /// Why the rule's run ended, as of a Run.
    #[pyo3(get)]
    reason: &'static str,
    /// The same as a sentence, where there is more to say.
    #[pyo3(get)]
    words: String,
    /// Errors and energies, a dict with the keys of `compare.json`: displacement_rel_l2 [1], von_mises_rel_l2 [1], ...
    #[pyo3(get)]
    measures: Py<PyAny>,
    /// Displacements by the rule [length], float64, shape (count, 2).
    #[pyo3(get)]
    rule: Py<PyArrayDyn<f64>>,
    /// True displacements [length], float64, shape (count, 2); NaN outside the shape.
    #[pyo3(get)]
    truth: Py<PyArrayDyn<f64>>,
    /// Centres of the cells in the reference configuration [length], float64, shape (cells, 2).
    #[pyo3(get)]
    cell_places: Py<PyArrayDyn<f64>>,
    /// Von Mises stress of the rule at the centres of the cells [force / length^2], float64, shape (cells,).
    #[pyo3(get)]
    von_mises_rule: Py<PyArrayDyn<f64>>,
    /// The same of the finite elements, float64, shape (cells,).
    #[pyo3(get)]
    von_mises_truth: Py<PyArrayDyn<f64>>,
    /// The body at the end of the rule's run.
    #[pyo3(get)]
    body: Py<Body>,
}

impl Comparison {
    fn new(py: Python<'_>, scene: Scene, compared: Compared) -> PyResult<Self> {
        let Compared { comparison, outcome, reference, cells, rule, von_mises_rule, von_mises_truth, .. } =
            compared;
        let known = |i: usize| {
            if reference.solution.knows(i) { reference.solution.displacement.get(i) } else { [f64::NAN; 2] }
        };
        let shape = [cells.count()];
        Ok(Self {
            name: scene.name.clone(),
            reason: outcome.reason.name(),
            words: words(&outcome.reason),
            measures: as_dict(py, &comparison)?.unbind(),
            rule: pairs(py, &rule)?.unbind(),
            truth: pairs(py, &(0..rule.len()).map(known).collect())?.unbind(),
            cell_places: pairs(py, &cells.centres(&outcome.engine.body().reference))?.unbind(),
            von_mises_rule: moved(py, von_mises_rule, &shape)?.unbind(),
            von_mises_truth: moved(py, von_mises_truth, &shape)?.unbind(),
            body: Py::new(
                py,
                Body::at(scene, outcome.engine, outcome.solved.as_ref().map(|_| outcome.residual)),
            )?,
        })
    }
}

#[pymethods]
impl Comparison {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let error: f64 = self.measures.bind(py).get_item("displacement_rel_l2")?.extract()?;
        Ok(format!("<flockform.Comparison of {}, displacement off by {:.3} %>", self.name, 100.0 * error))
    }
}
