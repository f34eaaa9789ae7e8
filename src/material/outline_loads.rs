//! Loads to the forces on particles.
//!
//! A load on the outline is integrated along the true outline, arcs included, and handed to the side of the cells'
//! boundary that is nearest: each force to the two particles of the side, so that resultant and moment are kept. On a
//! body that is fitted to its outline the sides are the outline, and the forces do the same work as the load in every
//! displacement that the cells can have; on a body of whole cells they replace the load by an equivalent one.

use super::boundary::Boundary;
use super::cells::Cells;
use crate::flock::body::Body;
use crate::flock::vectors::Vectors;
use crate::geometry::box_tree::BoxTree;
use crate::geometry::outline::{Outline, Place};
use crate::geometry::point::bounds;
use crate::geometry::portion::Portion;
use crate::geometry::shape::segment_distance;

/// Something that acts along an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Push {
    /// Along x and y \[force / length\]: stress times the thickness of the sheet.
    Traction([f64; 2]),
    /// Against the outward normal \[force / length\].
    Pressure(f64),
}

/// A factor that is linear along a line \[1\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Where the first factor holds \[length\].
    pub from: [f64; 2],
    /// Where the second factor holds \[length\].
    pub to: [f64; 2],
    /// At `from` and at `to` \[1\].
    pub factors: [f64; 2],
}

/// A load on parts of an outline.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineLoad {
    /// Where it acts.
    pub portions: Vec<Portion>,
    /// The load there, before the profile.
    pub push: Push,
    /// How it varies along a line; the same everywhere where there is none.
    pub profile: Option<Profile>,
}

/// Something that pushes on a body.
#[derive(Clone, Debug, PartialEq)]
pub enum Load {
    /// On parts of the outline.
    Outline(OutlineLoad),
    /// The same force on each of these particles \[force\].
    Particles {
        /// Indices of the particles.
        particles: Vec<u32>,
        /// On each of them \[force, world frame\].
        force: [f64; 2],
    },
    /// On every cell alike \[force / length^2\]: weight per volume times the thickness of the sheet.
    Body([f64; 2]),
}

/// Why a load cannot be put on a body. Particles are named by their ids, which count from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LoadError {
    /// A force acts on a particle without a cell around it.
    #[error("a force acts on particle {particle}, but it belongs to no cell")]
    NoCell {
        /// Id of the particle.
        particle: usize,
    },
    /// A load acts on the outline of a body that has none, or that has no cells.
    #[error("the cells have no boundary for a load to act on")]
    NoBoundary,
    /// A force is not finite, or they add up beyond the range of a double.
    #[error("a load must be finite")]
    NotFinite,
}

/// A load's sum of forces and their moment about the origin of the coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resultant {
    /// \[force\]
    pub force: [f64; 2],
    /// Counter-clockwise \[force length\].
    pub moment: f64,
}

impl Resultant {
    /// Of forces \[force\] at places \[length\].
    pub fn of(forces: impl IntoIterator<Item = ([f64; 2], [f64; 2])>) -> Self {
        forces.into_iter().fold(Self::default(), |sum, ([x, y], [fx, fy])| Self {
            force: [sum.force[0] + fx, sum.force[1] + fy],
            moment: sum.moment + x * fy - y * fx,
        })
    }
}

impl Profile {
    fn at(&self, p: [f64; 2]) -> f64 {
        let along = [0, 1].map(|k| self.to[k] - self.from[k]);
        let off = [0, 1].map(|k| p[k] - self.from[k]);
        let share = (off[0] * along[0] + off[1] * along[1]) / (along[0] * along[0] + along[1] * along[1]);
        self.factors[0] + share * (self.factors[1] - self.factors[0])
    }
}

impl OutlineLoad {
    /// The traction at a point \[length\] of the outline with this outward normal \[force / length\].
    pub fn at(&self, point: [f64; 2], normal: [f64; 2]) -> [f64; 2] {
        let factor = self.profile.map_or(1.0, |profile| profile.at(point));
        match self.push {
            Push::Traction(traction) => traction.map(|t| factor * t),
            Push::Pressure(pressure) => normal.map(|n| -factor * pressure * n),
        }
    }

    /// Whether it acts on less than this length \[length\], and not on whole pieces of the outline: under a load from corner to corner
    /// stress does not change so soon.
    pub(super) fn is_narrow(&self, outline: &Outline, least: f64) -> bool {
        let length = |at: &Portion| (at.t[1] - at.t[0]).abs() * outline.piece(at.ring, at.piece).length();
        /// Of a piece, to rounding \[1\].
        const END: f64 = 1e-9;
        let is_part = self.portions.iter().any(|at| at.t[0] > END || at.t[1] < 1.0 - END);
        is_part && self.portions.iter().map(length).sum::<f64>() < least
    }

    /// Forces \[force\] at places \[length\] that stand for the load: Gauss points of stretches that end at `breaks`
    /// and are no longer than `grain` \[length\].
    fn forces(&self, outline: &Outline, breaks: &[Place], grain: f64) -> Vec<([f64; 2], [f64; 2])> {
        let mut forces = Vec::new();
        for &Portion { ring, piece, t: [from, to] } in &self.portions {
            let on = outline.piece(ring, piece);
            let here = breaks.iter().filter(|b| (b.ring, b.piece) == (ring, piece) && b.t > from && b.t < to);
            let mut ends: Vec<f64> = here.map(|b| b.t).chain([from, to]).collect();
            ends.sort_by(f64::total_cmp);
            for pair in ends.windows(2) {
                let (begin, share) = (pair[0], pair[1] - pair[0]);
                let angle = on.arc.map_or(0.0, |arc| arc.sweep.abs() * share);
                let count = (share * on.length() / grain).ceil().max((angle / MOST_ANGLE).ceil()).max(1.0);
                for k in 0..count as usize {
                    for (at, weight) in GAUSS {
                        let t = begin + share * (k as f64 + at) / count;
                        let (point, normal) = (on.point(t), on.normal(t));
                        let length = weight * share * on.length() / count;
                        forces.push((point, self.at(point, normal).map(|f| f * length)));
                    }
                }
            }
        }
        forces
    }
}

/// Arcs are integrated in stretches of at most this angle \[rad\]: to 13 digits.
const MOST_ANGLE: f64 = 0.1;

/// Gauss points of the unit interval, of degree 5: places and weights.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Puts loads on the particles of a body.
#[derive(Debug)]
pub struct Loader<'a> {
    cells: &'a Cells,
    body: &'a Body,
    /// The outline of the body's shape; only loads on it need one.
    outline: Option<&'a Outline>,
    boundary: &'a Boundary,
    /// The boxes of its sides.
    sides: BoxTree,
}

impl<'a> Loader<'a> {
    /// `outline` is that of the body's shape, and `boundary` that of its cells, of the whole body where this is a part of one; only
    /// loads along the outline need them.
    pub fn new(
        cells: &'a Cells,
        body: &'a Body,
        (outline, boundary): (Option<&'a Outline>, &'a Boundary),
    ) -> Self {
        let sides = BoxTree::new(boundary.places.iter().map(|&ends| bounds(ends)));
        Self { cells, body, outline, boundary, sides }
    }

    /// Adds the forces of a load to those on the particles \[force\], shape \[count\].
    ///
    /// # Errors
    /// A load that acts on nothing, or is not finite.
    pub fn add(&self, load: &Load, forces: &mut Vectors) -> Result<(), LoadError> {
        match load {
            Load::Outline(load) => self.add_along_outline(load, forces)?,
            Load::Particles { particles, force } => {
                let incidence = self.cells.incidence(self.body.count());
                for &i in particles {
                    if incidence.of(i as usize).is_empty() {
                        return Err(LoadError::NoCell { particle: self.body.id(i as usize) });
                    }
                    push(forces, i, *force);
                }
            }
            Load::Body(force) => {
                let shares: Vec<Vec<f64>> =
                    (0..self.cells.shapes.len()).map(|kind| self.cells.load_shares(kind)).collect();
                for (cell, &kind) in self.cells.iter().zip(&self.cells.kind) {
                    for (&particle, share) in cell.iter().zip(&shares[kind as usize]) {
                        push(forces, particle, force.map(|b| b * share));
                    }
                }
            }
        }
        let is_finite = forces.iter().flatten().all(f64::is_finite);
        if is_finite { Ok(()) } else { Err(LoadError::NotFinite) }
    }

    fn add_along_outline(&self, load: &OutlineLoad, forces: &mut Vectors) -> Result<(), LoadError> {
        let Some(outline) = self.outline else { return Err(LoadError::NoBoundary) };
        let spacing = self.body.lattice.spacing();
        let (breaks, grain): (Vec<Place>, f64) = match &self.body.outline {
            Some(known) => (known.places.iter().flatten().copied().collect(), f64::INFINITY),
            None => (Vec::new(), 0.25 * spacing),
        };
        for (point, force) in load.forces(outline, &breaks, grain) {
            let apart = |side: usize| {
                let [from, to] = self.boundary.places[side];
                segment_distance(point, from, to)
            };
            let (side, _) = self.sides.nearest(point, apart).ok_or(LoadError::NoBoundary)?;
            self.attach(point, force, side, forces);
        }
        Ok(())
    }

    /// Replaces a force at a point \[length\] by forces on the ends of a side: shares of it where the point's foot is on
    /// the side, and a couple across the side for what that leaves of the moment. Of a part, those that it has as in the whole.
    fn attach(&self, point: [f64; 2], force: [f64; 2], side: usize, forces: &mut Vectors) {
        let Boundary { ends, places } = self.boundary;
        let ([a, b], [from, to]) = (ends[side], places[side]);
        let mut push = |index: usize, force: [f64; 2]| {
            if let Some(particle) = self.body.exact_particle(index) {
                push(forces, particle as u32, force);
            }
        };
        let along = [0, 1].map(|k| to[k] - from[k]);
        let square = along[0] * along[0] + along[1] * along[1];
        let off = [0, 1].map(|k| point[k] - from[k]);
        let t = ((off[0] * along[0] + off[1] * along[1]) / square).clamp(0.0, 1.0);
        let arm = [0, 1].map(|k| off[k] - t * along[k]);
        let moment = arm[0] * force[1] - arm[1] * force[0];
        // A force c across the side at its end and -c at its beginning have the moment |c| times the length.
        let couple = [-along[1], along[0]].map(|n| n * moment / square);
        push(a, [0, 1].map(|k| (1.0 - t) * force[k] - couple[k]));
        push(b, [0, 1].map(|k| t * force[k] + couple[k]));
    }
}

/// The sum of several loads' forces on the particles; `None` of none.
pub fn sum(by_load: &[Vectors]) -> Option<Vectors> {
    let (first, others) = by_load.split_first()?;
    let add = |mut sum: Vectors, next: &Vectors| {
        sum.x.iter_mut().zip(&next.x).for_each(|(sum, f)| *sum += f);
        sum.y.iter_mut().zip(&next.y).for_each(|(sum, f)| *sum += f);
        sum
    };
    Some(others.iter().fold(first.clone(), add))
}

fn push(forces: &mut Vectors, particle: u32, [x, y]: [f64; 2]) {
    forces.x[particle as usize] += x;
    forces.y[particle as usize] += y;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::Cut;
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::flock::outlay::Outlay;
    use crate::geometry::point::area;
    use crate::geometry::portion::{Area, Selection};
    use crate::geometry::shape::Shape;
    use crate::material::cells::{neighbourhood, templates};
    use crate::material::fit::fit;

    fn shape() -> Shape {
        Shape::WithHoles {
            body: Box::new(Shape::Polygon {
                vertices: vec![[0.0, 0.0], [9.0, 1.0], [8.0, 7.0], [2.0, 8.0], [-1.0, 4.0]],
            }),
            holes: vec![Shape::Disc { centre: [4.0, 4.0], radius: 1.7 }],
        }
    }

    /// The body of a shape, fitted or of whole cells.
    fn body(kind: LatticeKind, fitted: bool) -> (Body, Cells, Outline) {
        let lattice = Lattice::new(kind, [0.2, 0.1], 0.7);
        let outline = Outline::of_shape(&shape()).expect("an outline");
        if fitted {
            let fitted = fit(&lattice, &outline).expect("fits");
            return (fitted.body, fitted.cells, outline);
        }
        let (lattice, cut, near) = (&lattice, &Cut::Shape(shape()), &neighbourhood(&lattice));
        let outlay = Outlay { lattice, cut, neighbourhood: near, frame: None, cells: templates(lattice) };
        let (body, _) = outlay.lay_out(None).expect("builds");
        let cells = Cells::of_body(&body);
        (body, cells, outline)
    }

    fn resultant(forces: &Vectors, body: &Body) -> Resultant {
        Resultant::of(body.reference.iter().zip(forces.iter()))
    }

    #[test]
    fn loads_on_the_outline_keep_resultant_and_moment_on_every_lattice_fitted_or_not() {
        for kind in LatticeKind::SAMPLES {
            for fitted in [true, false] {
                let (body, cells, outline) = body(kind, fitted);
                let boundary = Boundary::of(&cells, &body.reference);
                let loader = Loader::new(&cells, &body, (Some(&outline), &boundary));
                let add = |selection: Selection, push: Push, profile: Option<Profile>| {
                    let portions = outline.portions(&selection, 1e-9);
                    let mut forces = Vectors::zeros(body.count());
                    let load = Load::Outline(OutlineLoad { portions, push, profile });
                    loader.add(&load, &mut forces).expect("fits");
                    resultant(&forces, &body)
                };
                let label = format!("{kind:?} fitted {fitted}");
                // The edge from (9, 1) to (8, 7), whole and its part between two heights.
                let edge = || Selection::Pieces { ring: 0, pieces: vec![1], angles: None };
                let found = add(edge(), Push::Traction([2.0, -3.0]), None);
                let length = 37f64.sqrt();
                let expected = [2.0 * length, -3.0 * length, -3.0 * length * 8.5 - 2.0 * length * 4.0];
                let off = [found.force[0], found.force[1], found.moment];
                assert!((0..3).all(|k| (off[k] - expected[k]).abs() < 1e-11 * 300.0), "{label}: {found:?}");
                let part = Selection::In(Area::Box { min: [1.0, 2.5], max: [20.0, 5.5] });
                let found = add(part, Push::Traction([1.0, 0.0]), None);
                // Both the edge and the hole lie in the box.
                let hole = 2.0 * (1.5f64 / 1.7).asin() * 2.0 * 1.7;
                assert!((found.force[0] - length / 2.0 - hole).abs() < 1e-11, "{label}: {found:?}");
                let heights = (5.5f64.powi(2) - 2.5f64.powi(2)) / 2.0 * length / 6.0;
                assert!((found.moment + heights + 4.0 * hole).abs() < 1e-10, "{label}: {found:?}");
                // A pressure in a hole has no resultant; one that grows with y pushes as it lifts a swimmer.
                let rim = || Selection::Pieces { ring: 1, pieces: vec![], angles: None };
                let found = add(rim(), Push::Pressure(5.0), None);
                assert!(found.force.iter().all(|f| f.abs() < 1e-10) && found.moment.abs() < 1e-10, "{label}");
                let depth = Profile { from: [0.0, 0.0], to: [0.0, 1.0], factors: [0.0, 1.0] };
                let found = add(rim(), Push::Pressure(1.0), Some(depth));
                let disc = std::f64::consts::PI * 1.7 * 1.7;
                assert!((found.force[1] - disc).abs() < 1e-10 && found.force[0].abs() < 1e-10, "{label}");
                assert!((found.moment - 4.0 * disc).abs() < 1e-9, "{label}: {found:?}");
                let all = add(Selection::All, Push::Pressure(1.0), None);
                assert!(all.force.iter().all(|f| f.abs() < 1e-10) && all.moment.abs() < 1e-9, "{label}");
            }
        }
    }

    #[test]
    fn a_body_force_adds_up_to_force_per_area_times_area() {
        for kind in LatticeKind::SAMPLES {
            for fitted in [true, false] {
                let (body, cells, outline) = body(kind, fitted);
                let total: f64 = cells.kind.iter().map(|&k| area(&cells.shapes[k as usize])).sum();
                let mut forces = Vectors::zeros(body.count());
                let boundary = Boundary::of(&cells, &body.reference);
                let loader = Loader::new(&cells, &body, (Some(&outline), &boundary));
                loader.add(&Load::Body([0.0, -3.0]), &mut forces).expect("fits");
                let found = resultant(&forces, &body);
                assert!((found.force[1] + 3.0 * total).abs() < 1e-11 * total, "{kind:?}");
                assert_eq!(found.force[0], 0.0);
            }
        }
    }

    #[test]
    fn loads_on_what_is_not_there_are_refused() {
        let (body, mut cells, outline) = body(LatticeKind::Square { spacing: 1.0 }, true);
        let add = |cells: &Cells, load: &Load| {
            let boundary = Boundary::of(cells, &body.reference);
            Loader::new(cells, &body, (Some(&outline), &boundary))
                .add(load, &mut Vectors::zeros(body.count()))
        };
        let push = |force: f64| Load::Particles { particles: vec![0], force: [force, 0.0] };
        assert_eq!(add(&cells, &push(f64::NAN)), Err(LoadError::NotFinite));
        assert_eq!(add(&cells, &push(1.0)), Ok(()));
        cells = Cells::of_kinds(Vec::new());
        assert_eq!(add(&cells, &push(1.0)), Err(LoadError::NoCell { particle: 1 }));
        let portions = outline.portions(&Selection::All, 1e-9);
        let around = Load::Outline(OutlineLoad { portions, push: Push::Pressure(1.0), profile: None });
        assert_eq!(add(&cells, &around), Err(LoadError::NoBoundary));
    }
}
