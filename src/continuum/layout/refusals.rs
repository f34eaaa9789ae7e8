//! Scenes whose body cannot be laid out, by the key at fault.

use crate::flock::body::{Body, BodyError, Cut};
use crate::flock::lattice::Site;
use crate::flock::neighbourhood::{Neighbourhood, NeighbourhoodError};
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::outline::OutlineError;
use crate::geometry::shape::Shape;
use crate::material::cells::{neighbourhood, neighbourhood_of};
use crate::material::fit::{FitError, Part};
use crate::scene::{BodySource, Scene, SceneError};

/// Least spacing over the distance of two doubles at the body's largest coordinate: six digits of a
/// displacement of one spacing.
const LEAST_RESOLUTION: f64 = 1e6;

/// Cells \[length\] within which areas, strains and pseudo-energies fit a double.
const CELLS: std::ops::RangeInclusive<f64> = 1e-152..=1e152;

/// Refuses a lattice whose squares of lengths no double holds.
pub(super) fn require_in_range(scene: &Scene) -> Result<(), SceneError> {
    let sides = [[1, 0], [0, 1]].map(|step| distance(scene.lattice.vector(step), [0.0; 2]));
    match sides.into_iter().find(|side| !CELLS.contains(side)) {
        None => Ok(()),
        Some(side) => {
            let message = format!("particles {side:e} apart: no double holds the squares of such lengths");
            let help = "use another unit of length, with distances from 1e-152 to 1e152";
            Err(scene.refuse(key_of_spacing(scene), message, help))
        }
    }
}

/// The key that says how far apart particles are.
fn key_of_spacing(scene: &Scene) -> &'static str {
    match scene.body {
        BodySource::Cut(_) => "lattice",
        BodySource::Points(_) => "body.shape",
    }
}

/// Refuses a body whose places, or small displacements from them, doubles cannot resolve.
pub(super) fn require_resolved(scene: &Scene, body: &Body) -> Result<(), SceneError> {
    let spacing = body.lattice.spacing();
    let Vectors { x, y } = &*body.reference;
    let farthest = x.iter().chain(y).fold(0.0, |most: f64, v| most.max(v.abs()));
    let grain = farthest.next_up() - farthest;
    // Not a number where the body reaches beyond the doubles.
    let is_resolved = spacing >= LEAST_RESOLUTION * grain;
    if !is_resolved {
        let message = format!(
            "particles {spacing:e} apart with coordinates up to {farthest:e}: a double has steps of {grain:.1e} there, and \
             displacements would be rounded to them"
        );
        let key = if scene.raw.body.anchor.is_some() { "body.anchor" } else { "body.shape" };
        return Err(scene.refuse(key, message, "put the origin of the coordinates near the body"));
    }
    Ok(())
}

/// Refuses a hole that takes no site out of a body on a lattice: it would make no difference.
pub(super) fn require_holes(scene: &Scene) -> Result<(), SceneError> {
    let BodySource::Cut(Cut::Shape(Shape::WithHoles { body, holes })) = &scene.body else { return Ok(()) };
    let (lattice, tolerance) = (&scene.lattice, 1e-9 * scene.lattice.spacing());
    let (low, high) = body.bounds();
    for (k, hole) in holes.iter().enumerate() {
        let (from, to) = hole.bounds();
        let (from, to) =
            ([0, 1].map(|k| f64::max(low[k], from[k])), [0, 1].map(|k| f64::min(high[k], to[k])));
        let is_out = |site| {
            let place = lattice.position(site);
            lattice.is_site(site) && hole.contains(place, -tolerance) && body.contains(place, tolerance)
        };
        // Within the body's bounds the grid is within range.
        let takes_some = || {
            let (first, last) = lattice.grid_bounds((from, to));
            let [columns, mut rows] = [0, 1].map(|k| first[k].floor() as i32 - 1..=last[k].ceil() as i32 + 1);
            rows.any(|row| columns.clone().any(|column| is_out([column, row])))
        };
        let overlaps = (0..2).all(|k| from[k] <= to[k]);
        if !(overlaps && takes_some()) {
            let message =
                "takes no particle out of the body: no site of the lattice lies both in it and in the shape";
            let help = "use a smaller lattice.spacing, move it, or leave it out";
            return Err(scene.refuse(&format!("body.holes[{k}]"), message, help));
        }
    }
    Ok(())
}

/// Refuses neighbours as written that leave out a particle sharing a cell.
pub(super) fn require_cell_neighbours(scene: &Scene) -> Result<(), SceneError> {
    let refuse = |message: String| {
        let help = "use kind = \"cells\", or leave the neighbours out: the rule takes those that it needs";
        scene.refuse("neighbours", message, help)
    };
    let offsets = |neighbourhood: &Neighbourhood| {
        neighbourhood.offsets(&scene.lattice).map_err(|error| refuse(error.to_string()))
    };
    let needed = match scene.farthest_seeing() {
        Some(elastic) => neighbourhood_of(&scene.lattice, elastic),
        None => neighbourhood(&scene.lattice),
    };
    let (given, needed) = (offsets(&scene.neighbourhood)?, offsets(&needed)?);
    let has_all = |(given, needed): (&Vec<Site>, &Vec<Site>)| needed.iter().all(|site| given.contains(site));
    if given.iter().zip(&needed).all(has_all) {
        return Ok(());
    }
    Err(refuse(format!(
        "{} neighbours cannot carry shear coupling: particles share a cell but are no neighbours, so the cell's \
         stiffness is cut",
        given[0].len()
    )))
}

pub(in crate::continuum) fn refuse_pieces(scene: &Scene, error: &BodyError) -> SceneError {
    let help = "close the gap, use a wider neighbourhood, or run the parts as scenes of their own";
    scene.refuse("body.shape", error.to_string(), help)
}

pub(in crate::continuum) fn refuse_body(scene: &Scene, error: &BodyError) -> SceneError {
    let (key, help) = match error {
        BodyError::Alone { .. } => {
            ("neighbours.radius", "use a wider radius, or leave the point out of the file")
        }
        BodyError::TooManyNeighbours { .. }
        | BodyError::ManyNeighbours { .. }
        | BodyError::Neighbourhood(NeighbourhoodError::TooLarge { .. }) => {
            ("neighbours.radius", "use a smaller radius")
        }
        BodyError::Neighbourhood(_) => ("neighbours", "choose a neighbourhood that the lattice has"),
        BodyError::TooLarge { .. } => ("body.shape", "use a wider spacing or a smaller shape"),
        _ => ("body.shape", "use a smaller spacing or a larger shape"),
    };
    scene.refuse(key, error.to_string(), help)
}

/// Names the part of the body that is too narrow, or too large, for the lattice.
pub(in crate::continuum) fn refuse_fit(scene: &Scene, error: &FitError) -> SceneError {
    let help = match error {
        FitError::TooLarge { .. } => "use a wider spacing or a smaller shape",
        _ => "use a smaller spacing, leave the detail out, or set body.outline = \"lattice\"",
    };
    let key = match error {
        FitError::SmallHole { hole, .. } => format!("body.holes[{}]", hole - 1),
        FitError::Narrow { part, .. } => part_key(*part),
        FitError::Detail { .. } | FitError::TooLarge { .. } => "body.shape".into(),
    };
    scene.refuse(&key, error.to_string(), help)
}

/// The key of what bounds the body: its shape, one of its holes, one of its inclusions.
fn part_key(part: Part) -> String {
    match part {
        Part::Outer => "body.shape".into(),
        Part::Hole(hole) => format!("body.holes[{}]", hole - 1),
        Part::Region(region) => format!("body.inclusions[{}].shape", region - 1),
    }
}

/// The remedy for an outline that crosses itself, or whose area is lost beside its length.
pub(super) const CORNERS: &str =
    "give its corners in order, once around, with no side a billion times as long as the shape is wide";

pub(super) fn refuse_outline(scene: &Scene, error: &OutlineError) -> SceneError {
    let (key, help) = match error {
        OutlineError::Touching { rings: [_, hole], .. }
        | OutlineError::Outside { hole, .. }
        | OutlineError::Nested { inner: hole, .. } => (
            format!("body.holes[{}]", hole - 1),
            "keep holes inside and apart, draw a notch as part of a polygon, or set body.outline = \"lattice\"",
        ),
        OutlineError::SelfCrossing { ring, .. } | OutlineError::NoArea { ring, .. } => {
            let key = if *ring == 0 { "body.shape".into() } else { format!("body.holes[{}]", ring - 1) };
            (key, CORNERS)
        }
        OutlineError::TooDense { .. } => ("body.shape".into(), "or set body.outline = \"lattice\""),
    };
    scene.refuse(&key, error.to_string(), help)
}
