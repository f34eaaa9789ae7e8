//! The known traction along a fitted body's outline, for the recovery of stress there.

use std::sync::OnceLock;

use crate::flock::body::Body;
use crate::geometry::locate::Finder;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::piece::Piece;
use crate::geometry::point::dot;
use crate::material::cells::Cells;
use crate::material::outline_loads::{Load, OutlineLoad};
use crate::material::recovery::KnownTraction;

/// Distances from sides to pieces that are computed at most: beyond, no stress is recovered.
const MOST_DISTANCES: usize = 20_000_000;

/// Turn to the right from which a corner is an inner one, where stress has no largest value, and up to which a polygon stands for a
/// smooth curve: that of eleven corners around a hole \[rad\].
const CHORDS: f64 = 0.6;

/// The outline of a body and what acts on it. The [`Edge`] is found on first use: tables and pictures of stress need
/// it, solvers do not.
#[derive(Clone, Debug)]
pub struct FreeEdge {
    outline: Outline,
    /// Sides of the boundary of the whole body, where this is of a part of one.
    sides: Option<usize>,
    loads: Vec<Load>,
    /// \[length\]
    thickness: f64,
    /// Components that are held, shape \[count\]\[x, y\].
    held: Vec<[bool; 2]>,
    edge: OnceLock<Option<Edge>>,
}

/// The outline of a body, for [`crate::material::recovery`].
#[derive(Clone, Debug, Default)]
pub struct Edge {
    /// Components of the traction that are known, at points along the outline.
    pub tractions: Vec<KnownTraction>,
    /// Which cell each of them acts on.
    pub cells: Vec<u32>,
    /// Ends of the straight piece of the outline that each is on; of an arc there are none \[length\].
    pub straights: Vec<Option<[[f64; 2]; 2]>>,
    /// One over the radius of the hollow that each is in, 0 in none \[1 / length\].
    pub hollows: Vec<f64>,
    /// Particles on the outline that are at no inner corner and not held altogether.
    pub particles: Vec<usize>,
    /// On all of the body under the whole load \[force / length^3\].
    pub body_force: [f64; 2],
    /// Whether a force of its own acts on each particle, shape \[count\].
    pub pushed: Vec<bool>,
    /// Loads that begin and end on sides, with less than [`FEWEST_LOADED`] spacings between.
    pub narrow: usize,
}

/// Spacings of an edge under a load from which its stress is seen \[1\].
pub const FEWEST_LOADED: f64 = 4.0;

impl FreeEdge {
    /// The outline with how many sides the boundary of the whole body has, where this is of a part of one. `loads` act on the outline of a sheet of this `thickness` \[length\]; `held` names the components of each
    /// particle that a support or leader holds, shape \[count\].
    pub fn new(
        (outline, sides): (Outline, Option<usize>),
        (loads, thickness): (Vec<Load>, f64),
        held: Vec<[bool; 2]>,
    ) -> Self {
        Self { outline, sides, loads, thickness, held, edge: OnceLock::new() }
    }

    /// Tractions of the loads, and none elsewhere, in the middle of each side of the boundary at whose ends no particle is
    /// pushed by a force of its own, along those components that are not held at both. `None` where they are not known or too many.
    pub fn of(&self, body: &Body, cells: &Cells) -> Option<&Edge> {
        self.edge.get_or_init(|| self.found(body, cells)).as_ref()
    }

    /// \[force / length^3\]
    fn body_force(&self) -> [f64; 2] {
        let of = |load: &Load| if let Load::Body(force) = load { *force } else { [0.0; 2] };
        let sum = self.loads.iter().map(of).fold([0.0; 2], |sum, f| [sum[0] + f[0], sum[1] + f[1]]);
        sum.map(|force| force / self.thickness)
    }

    fn found(&self, body: &Body, cells: &Cells) -> Option<Edge> {
        let (outline, held) = (&self.outline, &self.held);
        let places = &body.outline.as_ref()?.places;
        let incidence = cells.incidence(body.count());
        let sides = cells.boundary_sides(&incidence);
        let fits =
            self.sides.unwrap_or(sides.len()).saturating_mul(outline.pieces().count()) <= MOST_DISTANCES;
        if !fits {
            return None;
        }
        let outlined = |load: &Load| match load {
            Load::Outline(load) => Some(load.clone()),
            Load::Particles { .. } | Load::Body(_) => None,
        };
        let loads: Vec<OutlineLoad> = self.loads.iter().filter_map(outlined).collect();
        // What a single particle is pushed by acts on its sides in a way that is not known.
        let mut is_pushed = vec![false; body.count()];
        for load in &self.loads {
            if let Load::Particles { particles, force } = load
                && *force != [0.0; 2]
            {
                particles.iter().for_each(|&i| is_pushed[i as usize] = true);
            }
        }
        let spacing = body.lattice.spacing();
        let narrow = loads.iter().filter(|load| load.is_narrow(outline, FEWEST_LOADED * spacing)).count();
        let mut edge = Edge { body_force: self.body_force(), narrow, ..Edge::default() };
        let finder = Finder::new(outline);
        let exact = body.exact();
        // Where a part ends is no outline.
        let is_of_body = |side: &[u32; 2]| side.iter().any(|&i| exact.contains(&(i as usize)));
        let is_known = |side: &[u32; 2]| !side.iter().any(|&i| is_pushed[i as usize]);
        for [a, b] in sides.into_iter().filter(|side| is_of_body(side) && is_known(side)) {
            let [from, to] = [a, b].map(|i| body.reference.get(i as usize));
            let (place, _) = finder.nearest([0, 1].map(|k| 0.5 * (from[k] + to[k])));
            let piece = outline.piece(place.ring, place.piece);
            let (point, normal) = (piece.point(place.t), piece.normal(place.t));
            let acting = loads.iter().filter(|load| acts_at(load, &place)).map(|load| load.at(point, normal));
            let traction = acting.fold([0.0; 2], |sum, t| [0, 1].map(|k| sum[k] + t[k] / self.thickness));
            let around = incidence.of(a as usize).iter();
            let cell = around.copied().find(|&cell| cells.of(cell as usize).contains(&b))?;
            for axis in (0..2).filter(|&axis| ![a, b].iter().all(|&i| held[i as usize][axis])) {
                let direction = if axis == 0 { [1.0, 0.0] } else { [0.0, 1.0] };
                edge.tractions.push(KnownTraction { point, normal, direction, value: traction[axis] });
                edge.cells.push(cell);
                edge.straights.push(piece.arc.is_none().then_some([piece.from, piece.to]));
                edge.hollows.push(hollow(outline, &place));
            }
        }
        let on_outline = places.iter().enumerate().filter_map(|(i, place)| Some((i, (*place)?)));
        // Where everything is held no traction is known.
        let is_recovered =
            |(i, place): &(usize, Place)| held[*i] != [true; 2] && !is_inner_corner(outline, place);
        let on_outline = on_outline.filter(|(i, _)| exact.contains(i));
        edge.particles = on_outline.filter(is_recovered).map(|(i, _)| i).collect();
        edge.pushed = is_pushed;
        Some(edge)
    }
}

fn acts_at(load: &OutlineLoad, place: &Place) -> bool {
    let holds = |portion: &crate::geometry::portion::Portion| {
        (portion.ring, portion.piece) == (place.ring, place.piece)
            && (portion.t[0]..=portion.t[1]).contains(&place.t)
    };
    load.portions.iter().any(holds)
}

/// One over the radius of the outline where it is bent away from the body, and smooth or a polygon in place of a smooth
/// curve; 0 elsewhere \[1 / length\].
fn hollow(outline: &Outline, place: &Place) -> f64 {
    let (ring, number) = (&outline.rings()[place.ring], place.piece);
    let piece = &ring[number];
    if let Some(arc) = &piece.arc {
        return if arc.sweep < 0.0 { 1.0 / arc.radius } else { 0.0 };
    }
    let (before, after) = (&ring[(number + ring.len() - 1) % ring.len()], &ring[(number + 1) % ring.len()]);
    // A chord turns from the one before by its length over the radius.
    let turns = [turn_to_right(before, piece), turn_to_right(piece, after)];
    turns.into_iter().filter(|&turn| turn < CHORDS).fold(0.0, f64::max) / piece.length()
}

/// The angle between the end of a piece and the beginning of the next \[rad\].
fn turn_to_right(before: &Piece, after: &Piece) -> f64 {
    let (a, b) = (before.tangent(1.0), after.tangent(0.0));
    (a[1] * b[0] - a[0] * b[1]).atan2(dot(a, b))
}

fn is_inner_corner(outline: &Outline, place: &Place) -> bool {
    let ring = &outline.rings()[place.ring];
    let (before, after) = match place.t {
        0.0 => ((place.piece + ring.len() - 1) % ring.len(), place.piece),
        1.0 => (place.piece, (place.piece + 1) % ring.len()),
        _ => return false,
    };
    turn_to_right(&ring[before], &ring[after]) >= CHORDS
}
