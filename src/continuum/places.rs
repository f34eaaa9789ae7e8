//! Displacement and stress at the places that a scene names.

use serde::{Deserialize, Serialize};

use super::mechanics::Stresses;
use crate::engine::Engine;
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::place::Around;
use crate::material::stress::StressState;
use crate::scene::{Scene, SceneError};

/// Displacement and stress at a place of a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtPlace {
    /// In the reference configuration \[length\].
    pub place: [f64; 2],
    /// \[length\]
    pub displacement: [f64; 2],
    /// xx, yy, xy \[force / length^2\]; if the rule is corotated, in axes that turn with the body.
    pub stress: [f64; 3],
    /// \[force / length^2\]
    pub von_mises: f64,
}

/// The particles around each place of `record.places`.
///
/// # Errors
/// Names a place that is not of the body, and a body without cells.
pub fn around(scene: &Scene, cells: Option<&Cells>, reference: &Vectors) -> Result<Vec<Around>, SceneError> {
    // An outline of chords may be that far from the shape.
    let reach = scene.lattice.spacing();
    let of = |(k, &place): (usize, &[f64; 2])| {
        let key = format!("record.places[{k}]");
        let Some(cells) = cells else {
            let message = "there are no cells to find a place in: the scene has no material";
            return Err(scene.refuse(&key, message, "add [material], or name particles in record.probes"));
        };
        let help = "give a place of the undeformed body";
        Around::of(place, cells, reference, reach)
            .ok_or_else(|| scene.refuse(&key, "is more than a spacing away from the body", help))
    };
    scene.record.places.iter().enumerate().map(of).collect()
}

/// Displacement and stress at each place of `record.places`, under the stresses at present.
pub fn at_places(scene: &Scene, engine: &Engine, stresses: &Stresses) -> Vec<AtPlace> {
    let around = around(scene, engine.cells(), &engine.body().reference).unwrap_or_default();
    let at = |(&place, around): (&[f64; 2], Around)| {
        let displacement = around.mean(|i| Some(engine.displacement(i))).unwrap_or_default();
        let of = |StressState { components: [xx, yy, xy], von_mises, .. }| [xx, yy, xy, von_mises];
        let found = around.mean(|i| stresses.particles[i].map(of));
        let [xx, yy, xy, von_mises] = found.unwrap_or([f64::NAN; 4]);
        AtPlace { place, displacement, stress: [xx, yy, xy], von_mises }
    };
    scene.record.places.iter().zip(around).map(at).collect()
}
