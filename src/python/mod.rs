//! The Python package: a thin layer over the rooms that compute.
//!
//! Built by maturin from `src/python/pyproject.toml` (`pip install ./src/python`); `flockform/` is what Python imports, this
//! module its `flockform._core`. [`source`] turns arguments into scenes, [`arrays`] numpy memory into vectors and back,
//! [`beside`] computes in another thread while the interpreter waits for results and for Ctrl-C, and [`threads`] has the
//! threads that it computes with. Nothing is computed here.

mod arrays;
mod beside;
mod body;
mod errors;
mod run;
mod source;
mod studies;
mod swarm;
mod threads;

use pyo3::pymodule;

/// flockform's compiled part.
#[pymodule(name = "_core")]
mod core {
    use pyo3::prelude::*;

    use crate::flock::role::Role;
    use crate::scene::{Bundled, bundled};

    #[pymodule_export]
    use super::body::Body;
    #[pymodule_export]
    use super::errors::{DivergedError, SceneError};
    #[pymodule_export]
    use super::run::{Run, run};
    #[pymodule_export]
    use super::studies::{Comparison, compare, material, stability};
    #[pymodule_export]
    use super::swarm::Swarm;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let names = |files: &[Bundled]| files.iter().map(|file| file.name).collect::<Vec<_>>();
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("ROLES", Role::ALL.map(Role::name))?;
        module.add("SCENES", names(bundled::SCENES))?;
        module.add("SWARMS", names(bundled::SWARMS))
    }
}
