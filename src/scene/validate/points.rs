//! A body given as points: reads them, and refuses what only a lattice has.

use std::path::Path;

use super::material::is_material;
use super::{Refuse, read_table};
use crate::flock::cloud::Cloud;
use crate::scene::document::problem::SceneError;
use crate::scene::points::PointTable;
use crate::scene::raw::*;

/// The points of the body, where it is given by them.
pub fn cloud(raw: &RawScene, folder: Option<&Path>, refuse: Refuse<'_>) -> Result<Option<Cloud>, SceneError> {
    let RawShape::Points { file, scale } = &raw.body.shape else { return Ok(None) };
    refuse_what_needs_a_lattice(raw, refuse)?;
    let radius = radius(raw, refuse)?;
    let parse = |text: &str| PointTable::parse(text, *scale);
    let PointTable { points, ids } = read_table(("body.shape.file", file), folder, refuse, parse)?;
    let cloud = Cloud::new(points, ids, radius);
    cloud.map(Some).map_err(|error| refuse("neighbours.radius", error.to_string(), "use a smaller radius"))
}

/// Points have neighbours by distance alone.
fn radius(raw: &RawScene, refuse: Refuse<'_>) -> Result<f64, SceneError> {
    match &raw.neighbours {
        Some(RawNeighbours::Within { radius } | RawNeighbours::Dynamic { radius }) => Ok(*radius),
        given => {
            let message = match given {
                None => "a body of points must state how far its particles see",
                Some(_) => "points are no sites of a lattice, whose neighbourhoods these are",
            };
            let help = "give `neighbours = { kind = \"within\", radius = 1.5 }`, in the unit of the points";
            Err(refuse("neighbours", message.into(), help))
        }
    }
}

fn refuse_what_needs_a_lattice(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let of_lattice = |what: &str| format!("{what}, and a body of points has none");
    let cut = "cut the body from a lattice, or leave this out";
    let truth = raw.roles.iter().position(|entry| matches!(entry.motion, Some(RawMotion::Reference { .. })));
    let led = format!("roles[{}].motion", truth.unwrap_or_default());
    let weights = matches!(raw.rule.weights, Some(RawWeights::List { .. } | RawWeights::Gradient { .. }));
    let clash = [
        ("lattice", raw.lattice.is_some(), "a lattice says where the sites of a body are", {
            "leave the lattice out: the file says where the particles are"
        }),
        ("body.holes", !raw.body.holes.is_empty(), "holes are cut out of a lattice", {
            "leave the points in the hole out of the file"
        }),
        (
            "body.inclusions",
            !raw.body.inclusions.is_empty(),
            "a material lives in the cells of a lattice",
            cut,
        ),
        ("body.anchor", raw.body.anchor.is_some(), "the anchor is a site of a lattice", {
            "move the points, or leave this out"
        }),
        ("frame", raw.frame != RawFrame::None, "a frame goes on as the lattice of the body does", {
            "use frame = \"none\": each particle at the edge keeps its place at rest by an offset"
        }),
        ("material", raw.material.is_some(), "a material lives in the cells of a lattice", cut),
        ("loads", !raw.loads.is_empty(), "loads act on the cells of a lattice", cut),
        (&led, truth.is_some(), "the truth is computed on the cells of a lattice", {
            "give the leaders a motion of their own"
        }),
        ("equilibrium", raw.equilibrium.is_some(), "solvers work on the sites of a lattice", {
            "leave it out and step to rest: stop = { tolerance = 1e-6, steps = 100000 }"
        }),
        ("rule.mean", is_material(raw), "the material rule lives in the cells of a lattice", {
            "use kind = \"barycentre\""
        }),
        ("rule.weights", weights, "weights of this kind belong to the neighbours of a lattice", {
            "use kind = \"distance\" or \"solved\", or leave the weights out"
        }),
    ];
    match clash.into_iter().find(|(_, used, ..)| *used) {
        None => Ok(()),
        Some((key, _, what, help)) => Err(refuse(key, of_lattice(what), help)),
    }
}
