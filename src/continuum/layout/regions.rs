//! From a region of a scene to the particles, or the parts of the outline, that it holds.

use std::collections::HashSet;
use std::sync::Arc;

use super::Layout;
use crate::flock::body::{Body, Cut};
use crate::flock::region::{Region, Side};
use crate::flock::vectors::distance;
use crate::geometry::locate::Finder;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::portion::{Area, Portion, Selection};
use crate::material::boundary::Boundary;
use crate::scene::{BodySource, Scene, SceneError, SceneRegion};

/// Depth within which particles stand on a flat side \[spacings\].
pub(in crate::continuum) const FLAT: f64 = 1e-6;

/// The parts of an outline no farther in than a depth from the outermost coordinate on a side \[length\].
fn band(outline: &Outline, side: Side, depth: f64, grain: f64) -> Vec<Portion> {
    let (low, high) = outline.bounds();
    let (mut min, mut max) = (low, high);
    match side {
        Side::Left => max[0] = low[0] + depth,
        Side::Right => min[0] = high[0] - depth,
        Side::Bottom => max[1] = low[1] + depth,
        Side::Top => min[1] = high[1] - depth,
    }
    outline.portions(&Selection::In(Area::Box { min, max }), grain)
}

/// The warnings about regions that hold what is outermost on a side that is not straight, and less of it the narrower the
/// spacing is.
pub(crate) fn uneven_sides(scene: &Scene) -> Vec<String> {
    let BodySource::Cut(Cut::Shape(shape)) = &scene.body else { return Vec::new() };
    let outermost = scene.regions().filter_map(|(key, region)| match region {
        SceneRegion::Outermost(side) => Some((key, *side)),
        _ => None,
    });
    let outermost: Vec<(String, Side)> = outermost.collect();
    // An outline of many corners takes a while.
    if !scene.is_fitted || outermost.is_empty() {
        return Vec::new();
    }
    let Ok(outline) = Outline::of_shape(shape) else { return Vec::new() };
    let grain = 1e-9 * scene.lattice.spacing();
    let uneven = outermost.into_iter().filter(|(_, side)| band(&outline, *side, 0.0, grain).is_empty());
    uneven
        .map(|(key, _)| {
            format!(
                "{key}: no side is straight there, so that it holds what is within half a spacing of the outermost \
                 place, and less with a narrower spacing; give it a depth, or kind = \"outline\" and pieces"
            )
        })
        .collect()
}

impl Layout {
    /// The parts of the outline in the region that stands at `key`.
    ///
    /// # Errors
    /// Names a region without any, and a shape that has no outline.
    pub fn portions(
        &self,
        scene: &Scene,
        key: &str,
        region: &SceneRegion,
    ) -> Result<Vec<Portion>, SceneError> {
        let key = format!("{key}.region");
        check_ids(scene, &key, region, &self.body)?;
        let Some(outline) = &self.outline else {
            let message = "the shape has no outline that bounds one area: it crosses or touches itself";
            return Err(scene.refuse("body.shape", message, "mend the shape and its holes"));
        };
        check_pieces(scene, &key, region, outline)?;
        let portions = self.portions_of(region, outline);
        if portions.is_empty() {
            let (low, high) = outline.bounds();
            let message = format!(
                "no part of the outline lies in this region; the shape spans [{}, {}] to [{}, {}]",
                low[0], low[1], high[0], high[1]
            );
            let help = "move or widen the region; a curved side needs a depth";
            return Err(scene.refuse(&key, message, help));
        }
        Ok(portions)
    }

    fn portions_of(&self, region: &SceneRegion, outline: &Outline) -> Vec<Portion> {
        let spacing = self.body.lattice.spacing();
        let grain = 1e-9 * spacing;
        let band = |side: Side, depth: f64| band(outline, side, depth, grain);
        match region {
            SceneRegion::Outline(selection) => outline.portions(selection, grain),
            SceneRegion::Outermost(side) => match band(*side, 0.0) {
                flat if !flat.is_empty() => flat,
                _ => band(*side, self.outermost_depth(*side)),
            },
            SceneRegion::Known(region) => match region {
                Region::All | Region::Boundary => outline.portions(&Selection::All, grain),
                Region::Edge { side, depth } => band(*side, *depth),
                Region::In(area) => outline.portions(&Selection::In(*area), grain),
                Region::Ids(ids) => self.portions_between(ids, outline),
            },
        }
    }

    /// The outline along those sides of the cells' boundary both of whose particles have these ids.
    fn portions_between(&self, ids: &[usize], outline: &Outline) -> Vec<Portion> {
        let inside: HashSet<usize> = ids.iter().filter_map(|&id| self.body.index_of(id)).collect();
        let boundary = self.boundary();
        let sides = boundary.ends.iter().zip(&boundary.places);
        let sides = sides.filter(|(ends, _)| ends.iter().all(|end| inside.contains(end)));
        let grain = 1e-9 * self.body.lattice.spacing();
        let between = |&[from, to]: &[[f64; 2]; 2]| outline.portions(&Selection::Between { from, to }, grain);
        sides.flat_map(|(_, places)| between(places)).collect()
    }

    pub(super) fn boundary(&self) -> Arc<Boundary> {
        let of_cells = || self.cells.as_ref().map(|cells| Boundary::of(cells, &self.body.reference));
        self.boundary.clone().unwrap_or_else(|| Arc::new(of_cells().unwrap_or_default()))
    }

    /// Particles of the region that stands at `key`.
    ///
    /// # Errors
    /// Names a region without particles and an id that does not exist.
    pub fn pick(&self, scene: &Scene, key: &str, region: &SceneRegion) -> Result<Vec<usize>, SceneError> {
        let key = format!("{key}.region");
        check_ids(scene, &key, region, &self.body)?;
        let mut particles = match (region, &self.outline) {
            (SceneRegion::Outline(selection), Some(outline)) => {
                check_pieces(scene, &key, region, outline)?;
                self.pick_along(scene, selection, outline)
            }
            (SceneRegion::Outline(_), None) => {
                let message = "the body has no outline of its own";
                return Err(scene.refuse(&key, message, "pick the particles by place or by id"));
            }
            (SceneRegion::Known(Region::Boundary), _) => self.along_boundary(scene),
            (SceneRegion::Known(region), _) => region.pick(&self.body, &self.neighbours, &[]),
            (SceneRegion::Outermost(side), _) => self.outermost(*side),
        };
        let exact = self.body.exact();
        particles.retain(|i| exact.contains(i));
        // Of a part it is nothing wrong if others have them.
        if particles.is_empty() && self.body.part.is_none() {
            return Err(self.holds_none(scene, &key));
        }
        Ok(particles)
    }

    fn along_boundary(&self, scene: &Scene) -> Vec<usize> {
        let offsets = scene.neighbourhood.offsets(&scene.lattice).unwrap_or_default();
        // Points have no sites that could be complete.
        let complete = if scene.is_of_points() { Vec::new() } else { offsets.iter().map(Vec::len).collect() };
        Region::Boundary.pick(&self.body, &self.neighbours, &complete)
    }

    /// The particles on parts of the outline, or, of a body of whole cells, nearest to them, ascending.
    fn pick_along(&self, scene: &Scene, selection: &Selection, outline: &Outline) -> Vec<usize> {
        let near = 1e-6 * self.body.lattice.spacing();
        let portions = outline.portions(selection, 0.0);
        let candidates: Vec<(usize, Place)> = match &self.body.outline {
            Some(known) => (0..self.body.count()).filter_map(|i| Some((i, known.places[i]?))).collect(),
            None => {
                let finder = Finder::new(outline);
                self.along_boundary(scene)
                    .into_iter()
                    .map(|i| (i, finder.nearest(self.body.reference.get(i)).0))
                    .collect()
            }
        };
        let is_on = |place: &Place| {
            let p = outline.point(*place);
            portions.iter().any(|portion| {
                let piece = outline.piece(portion.ring, portion.piece);
                let t = piece.nearest(p).clamp(portion.t[0], portion.t[1]);
                distance(piece.point(t), p) <= near
            })
        };
        candidates.into_iter().filter(|(_, place)| is_on(place)).map(|(i, _)| i).collect()
    }

    /// The error for the region at `key` if it holds no particle.
    pub(in crate::continuum) fn holds_none(&self, scene: &Scene, key: &str) -> SceneError {
        let (low, high) = self.body.bounds();
        let message = format!(
            "no particle of the body lies in this region; the body spans [{}, {}] to [{}, {}]",
            low[0], low[1], high[0], high[1]
        );
        scene.refuse(key, message, "move or widen the region")
    }

    /// Whether the shape is flat on a side, so that its outermost particles are those along that.
    #[cfg(feature = "fem")]
    pub(crate) fn is_flat(&self, side: Side) -> bool {
        let grain = 1e-9 * self.body.lattice.spacing();
        self.outline.as_ref().is_some_and(|outline| !band(outline, side, 0.0, grain).is_empty())
    }

    /// The particles at the outermost coordinate on a side; of a body that has no flat side there, those half a spacing
    /// deep, or of whole cells as deep as a row.
    fn outermost(&self, side: Side) -> Vec<usize> {
        let within = |depth: f64| Region::Edge { side, depth }.pick(&self.body, &self.neighbours, &[]);
        if self.body.outline.is_some() {
            let flat = within(FLAT * self.body.lattice.spacing());
            if self.flat.map_or(flat.len() > 1, |flat| flat[side as usize]) {
                return flat;
            }
        }
        within(self.outermost_depth(side))
    }

    /// Half a spacing; of whole cells deep enough for a staggered edge: less than one period of the lattice's rows across the
    /// side.
    fn outermost_depth(&self, side: Side) -> f64 {
        let lattice = &self.body.lattice;
        let spacing = lattice.spacing();
        if self.body.outline.is_some() {
            return 0.5 * spacing;
        }
        let k = usize::from(matches!(side, Side::Bottom | Side::Top));
        let steps = lattice.first_neighbours(0).into_iter().map(|offset| lattice.vector(offset)[k].abs());
        let shortest = steps.clone().filter(|&step| step > 1e-6 * spacing).fold(f64::INFINITY, f64::min);
        let longest = steps.fold(0.0, f64::max);
        // Rows that are staggered by part of a period count as one edge.
        if longest > 1.5 * shortest { 0.75 * longest } else { shortest / 2.0 }
    }
}

fn check_ids(scene: &Scene, key: &str, region: &SceneRegion, body: &Body) -> Result<(), SceneError> {
    let SceneRegion::Known(Region::Ids(ids)) = region else { return Ok(()) };
    for (n, &id) in ids.iter().enumerate() {
        let message = match body.particle(id).map(|i| body.is_frame[i]) {
            Some(false) => continue,
            Some(true) => format!("particle {id} belongs to the frame, whose role is fixed"),
            None if body.part.is_some() && (1..=body.total()).contains(&id) => continue,
            None => no_particle(id, body),
        };
        let help = match body.numbering {
            Some(_) => "ids are those of the body's file, or, where that has none, the numbers of its rows",
            None => {
                "particles count from 1, column by column from the bottom left, the frame's included; in a report a \
                 particle that is pointed at shows its number"
            }
        };
        return Err(scene.refuse(&format!("{key}.ids[{n}]"), message, help));
    }
    Ok(())
}

/// Message that no particle has this id.
pub(in crate::continuum) fn no_particle(id: usize, body: &Body) -> String {
    let ids = body.rows().map(|i| body.id(i));
    let (low, high) = match &body.part {
        Some(part) => (1, part.total),
        None => ids.fold((usize::MAX, 0), |(low, high), id| (low.min(id), high.max(id))),
    };
    match (low..=high).contains(&id) {
        true => format!("there is no particle {id} among the ids from {low} to {high}"),
        false => format!("there is no particle {id}: ids run from {low} to {high}"),
    }
}

/// Refuses a hole or a piece that the outline does not have, and angles where there are no arcs.
fn check_pieces(scene: &Scene, key: &str, region: &SceneRegion, outline: &Outline) -> Result<(), SceneError> {
    let SceneRegion::Outline(Selection::Pieces { ring, pieces, angles }) = region else { return Ok(()) };
    let rings = outline.rings();
    if *ring >= rings.len() {
        let (message, help) = match rings.len() - 1 {
            0 => ("the body has no holes".to_owned(), "leave it out, or give the body holes by body.holes"),
            holes => (format!("there is no hole {ring}: the body has {holes}"), "count body.holes from 1"),
        };
        return Err(scene.refuse(&format!("{key}.hole"), message, help));
    }
    let known: HashSet<usize> = rings[*ring].iter().map(|piece| piece.number).collect();
    let is_asked = |number: usize| pieces.is_empty() || pieces.contains(&number);
    let has_arcs = rings[*ring].iter().any(|piece| is_asked(piece.number) && piece.arc.is_some());
    match pieces.iter().position(|number| !known.contains(number)) {
        None if angles.is_some() && !has_arcs => {
            let message = "there are no arcs in this part of the outline, whose angles these could be";
            let help = "leave angles out, and pick by pieces, by hole or between two points";
            Err(scene.refuse(&format!("{key}.angles"), message, help))
        }
        None => Ok(()),
        Some(k) => {
            let most = rings[*ring].iter().map(|piece| piece.number + 1).max().unwrap_or(0);
            let message = format!("there is no piece {}: they run from 1 to {most}", pieces[k] + 1);
            Err(scene.refuse(&format!("{key}.pieces[{k}]"), message, "`flockform plan` prints the pieces"))
        }
    }
}
