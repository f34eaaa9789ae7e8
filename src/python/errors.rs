//! Exceptions with the program's own words.

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde::Serialize;

use crate::continuum::run::Divergence;
use crate::scene::{self, Place, Problem};

create_exception!(
    flockform,
    SceneError,
    PyValueError,
    "A scene or swarm file that cannot be: its text names file, line, key, value and remedy.\n\n`problems` has the same \
     as a list of dicts with the keys `place`, `line`, `key`, `found`, `message` and `help`."
);
create_exception!(
    flockform,
    DivergedError,
    PyRuntimeError,
    "A body that ceased to be one: its text names step, particle and likely cause."
);

impl From<scene::SceneError> for PyErr {
    fn from(error: scene::SceneError) -> Self {
        // There is no command line: what lies over a file is a dict, or `set`.
        let error = error.of_keys();
        let raised = SceneError::new_err(error.to_string());
        let outcome = Python::attach(|py| {
            let problems = error.problems().iter().map(|problem| described(py, problem));
            let problems = problems.collect::<PyResult<Vec<_>>>()?;
            raised.value(py).setattr("problems", PyList::new(py, problems)?)
        });
        outcome.err().unwrap_or(raised)
    }
}

fn described<'py>(py: Python<'py>, problem: &Problem) -> PyResult<Bound<'py, PyDict>> {
    let line = match problem.place {
        Place::Line { line, .. } => Some(line),
        Place::File { .. } | Place::Override { .. } | Place::Varied { .. } | Place::Key { .. } => None,
    };
    let description = PyDict::new(py);
    description.set_item("place", problem.place.to_string())?;
    description.set_item("line", line)?;
    description.set_item("key", &problem.key)?;
    description.set_item("found", &problem.found)?;
    description.set_item("message", &problem.message)?;
    description.set_item("help", &problem.help)?;
    Ok(description)
}

/// The exception of a body that diverged.
pub(super) fn diverged(divergence: &Divergence) -> PyErr {
    DivergedError::new_err(divergence.to_string())
}

/// A value as dicts and lists, with the keys of the program's JSON; infinities are `None`.
pub(super) fn as_dict<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}
