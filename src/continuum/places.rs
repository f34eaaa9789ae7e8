//! Displacement and stress at the places that a scene names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::mechanics::Stresses;
use super::pieces::CellNumbers;
use crate::engine::Engine;
use crate::flock::body::{Body, Cut};
use crate::material::cells::Cells;
use crate::material::place::Around;
use crate::material::stress::{AroundParticles, StressState};
use crate::ranks::{Team, gathered};
use crate::scene::{BodySource, Scene, SceneError};

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

/// How far outside the body a place is that was rounded when it was written \[spacings\].
const ROUNDING: f64 = 1e-3;

/// The region of the shape that a place is in, and whether it is where two meet; of a body in whole cells, whose regions are theirs,
/// unknown.
fn region(scene: &Scene, place: [f64; 2]) -> (Option<u32>, bool) {
    let rounding = ROUNDING * scene.lattice.spacing();
    let within = |tolerance: f64| {
        let last = scene.inclusions.iter().rposition(|part| part.shape.contains(place, tolerance));
        last.map_or(0, |k| k as u32 + 1)
    };
    match scene.is_fitted {
        true => (Some(within(0.0)), within(rounding) != within(-rounding)),
        false => (None, false),
    }
}

/// The particles around each place of `record.places`; of those that another rank has, where each has a part of the body, none.
///
/// # Errors
/// Names a place that is not of the body, and a body without cells; on all ranks alike.
pub fn around(
    scene: &Scene,
    (body, cells): (&Body, Option<&Cells>),
    team: Option<&Team>,
) -> Result<Vec<Option<Around>>, SceneError> {
    let spacing = scene.lattice.spacing();
    let rounding = ROUNDING * spacing;
    // Chords and staircases may be that far within the shape.
    let reach = |place| match &scene.body {
        BodySource::Cut(Cut::Shape(shape)) if shape.contains(place, rounding) => spacing,
        _ => rounding,
    };
    let numbers = cells.map(|cells| CellNumbers::of(body, cells, team));
    let of = |(k, &place): (usize, &[f64; 2])| {
        let key = format!("record.places[{k}]");
        let (Some(cells), Some(numbers)) = (cells, &numbers) else {
            let message = "there are no cells to find a place in: the scene has no material";
            return Err(scene.refuse(&key, message, "add [material], or name particles in record.probes"));
        };
        let own = numbers.owned.iter().cloned().flatten();
        let own = Around::nearest(place, (cells, own), &body.reference);
        let found = own.as_ref().map_or([f64::INFINITY.to_bits(), u64::MAX], |(around, apart)| {
            [apart.to_bits(), numbers.number(around.cell) as u64]
        });
        let ranks = team.map_or_else(|| Vec::from([found]), |team| team.each(found));
        // The first of several cells, whose rank has it.
        let order = |a: &[u64; 2], b: &[u64; 2]| {
            f64::from_bits(a[0]).total_cmp(&f64::from_bits(b[0])).then(a[1].cmp(&b[1]))
        };
        let nearest = ranks.into_iter().min_by(order).filter(|of| f64::from_bits(of[0]) <= reach(place));
        let help = "give a place of the undeformed body";
        let nearest = nearest.ok_or_else(|| scene.refuse(&key, "is outside the body", help))?;
        Ok(own.filter(|_| found == nearest).map(|(around, ..)| around))
    };
    scene.record.places.iter().enumerate().map(of).collect()
}

/// Displacement and stress at each place of `record.places`, under the stresses at present; on all ranks that share the body.
pub fn at_places(scene: &Scene, engine: &Engine, stresses: &Stresses) -> Vec<AtPlace> {
    if scene.record.places.is_empty() {
        return Vec::new();
    }
    let team = engine.parted();
    let around = around(scene, (engine.body(), engine.cells()), team).unwrap_or_default();
    let material = engine.cells().zip(engine.elastic());
    let sides = material
        .map(|(cells, elastic)| AroundParticles::new(cells, elastic, &stresses.cells, engine.body().count()));
    let at = |(k, around): (usize, Option<Around>)| {
        let around = around?;
        let [ux, uy] = around.mean(|i| Some(engine.displacement(i))).unwrap_or_default();
        let found = sides.as_ref().and_then(|sides| {
            sides.at_place(&around, region(scene, scene.record.places[k]), &stresses.particles)
        });
        let of = |StressState { components: [xx, yy, xy], von_mises, .. }| [xx, yy, xy, von_mises];
        let [xx, yy, xy, von_mises] = found.map_or([f64::NAN; 4], of);
        let place = scene.record.places[k];
        Some((k, AtPlace { place, displacement: [ux, uy], stress: [xx, yy, xy], von_mises }))
    };
    let all = gathered(team, around.into_iter().enumerate().filter_map(at).collect());
    all.into_iter().collect::<BTreeMap<_, _>>().into_values().collect()
}
