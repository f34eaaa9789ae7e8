//! The body that engines are timed on: a grid that is held all around and stirred, so that every particle moves in every
//! step.

use crate::continuum::plan::Plan;
use crate::flock::vectors::Vectors;
use crate::scene;

/// The plan of a body of so many columns and rows, with these keys besides.
pub(super) fn plan([columns, rows]: [usize; 2], keys: &[&str]) -> Plan {
    let body = format!("body.shape={{kind=\"grid\",columns={columns},rows={rows}}}");
    let held = "roles=[{region={kind=\"boundary\"},role=\"clamped\"}]";
    let mut overrides: Vec<String> =
        vec!["frame=\"none\"".into(), body, held.into(), "record.probes=[]".into()];
    overrides.extend(keys.iter().map(|&key| key.to_owned()));
    let scene = scene::bundled("tension").expect("bundled").load(&overrides);
    let plan = scene.and_then(|scene| Plan::new(&scene));
    plan.unwrap_or_else(|error| panic!("the benchmark's own scene is refused: {error}"))
}

/// No particle is at rest to the bit.
pub(super) fn stirred(reference: &Vectors) -> impl Iterator<Item = [f64; 2]> + '_ {
    reference.iter().map(|[x, y]| [x + 0.01 * (0.1 * y).sin(), y + 0.01 * (0.1 * x).sin()])
}
