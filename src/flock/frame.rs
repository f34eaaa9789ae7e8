//! The frame: a shell of points around the body that gives edge particles their full
//! neighbourhood (the paper's Choice 4).
//!
//! A frame point copies the displacement of the particles it serves; where they are several it
//! takes their average. The rules differ in which particles it serves and when it copies:
//! `Lagged` and `Immediate` serve the nearest particles of the body, before and after the sweep;
//! `Mirror` continues the body beyond its edge by serving the particle opposite across that
//! nearest one, so that the edge sees what an interior particle would.

use super::lattice::{Lattice, Site};
use super::real::Real;
use super::vectors::Vectors;

named! {
    /// Which particles a frame point serves, and when it copies.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum FrameRule {
        /// The nearest particles' displacement before the sweep: the edge follows with a delay, which
        /// is the convexity of the paper's figure 1.
        Lagged => "lagged",
        /// The nearest particles' displacement after the sweep.
        Immediate => "immediate",
        /// The displacement, after the sweep, of the particle opposite across the nearest one.
        Mirror => "mirror",
    }
}

impl FrameRule {
    /// Whether the displacements copied are those from before the sweep.
    pub(crate) fn looks_before_the_sweep(self) -> bool {
        self == FrameRule::Lagged
    }
}

/// Frame points and the particles each serves, in compressed rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Which particles a frame point copies, and when.
    pub rule: FrameRule,
    /// Particle index of each frame point, ascending, shape \[points\].
    pub points: Vec<u32>,
    starts: Vec<u32>,
    served: Vec<u32>,
}

impl Frame {
    /// Finds the particles that each frame point serves; `index` looks a particle up by its site.
    pub fn build(
        rule: FrameRule,
        lattice: &Lattice,
        sites: &[Site],
        is_frame: &[bool],
        index: impl Fn(Site) -> Option<u32>,
    ) -> Self {
        let body = |site: Site| index(site).filter(|&i| !is_frame[i as usize]);
        let mut frame = Self { rule, points: Vec::new(), starts: vec![0], served: Vec::new() };
        let mut around = Around::new(lattice);
        for (point, &site) in sites.iter().enumerate().filter(|&(point, _)| is_frame[point]) {
            frame.points.push(point as u32);
            for near in around.nearest(site, &body) {
                let opposite = [2 * near[0] - site[0], 2 * near[1] - site[1]];
                let served =
                    if rule == FrameRule::Mirror { body(opposite).or(body(near)) } else { body(near) };
                frame.served.extend(served);
            }
            frame.starts.push(frame.served.len() as u32);
        }
        frame
    }

    /// Number of frame points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no frame point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The particles that the frame point number `k` serves.
    pub fn served_by(&self, k: usize) -> &[u32] {
        &self.served[self.starts[k] as usize..self.starts[k + 1] as usize]
    }

    /// Mean of a number that belongs to each particle which frame point number `k` serves.
    pub(crate) fn mean_of_served<T: Real>(&self, k: usize, of: impl Fn(usize) -> T) -> T {
        let served = self.served_by(k);
        let mut sum = T::default();
        served.iter().for_each(|&s| sum += of(s as usize));
        sum / T::of(served.len().max(1) as f64)
    }

    /// Displacement of frame point number `k` when the body stands at `seen` \[length\].
    pub fn displacement(&self, k: usize, reference: &Vectors, seen: &Vectors) -> [f64; 2] {
        let along = |seen: &[f64], reference: &[f64]| self.mean_of_served(k, |s| seen[s] - reference[s]);
        [along(&seen.x, &reference.x), along(&seen.y, &reference.y)]
    }

    /// How many places away the farthest particle is that a frame point serves.
    pub fn reach(&self) -> usize {
        let farthest = |k: usize| {
            self.served_by(k).iter().map(|&s| s.abs_diff(self.points[k]) as usize).max().unwrap_or(0)
        };
        (0..self.len()).map(farthest).max().unwrap_or(0)
    }

    /// Moves every frame point of `next` by the displacements seen in `before`, the positions before
    /// the sweep; where the rule does not look there, by those in `next` itself.
    pub fn follow(&self, reference: &Vectors, before: &Vectors, next: &mut Vectors) {
        for (k, &point) in self.points.iter().enumerate() {
            let seen = if self.rule.looks_before_the_sweep() { before } else { &*next };
            let [dx, dy] = self.displacement(k, reference, seen);
            let point = point as usize;
            next.set(point, [reference.x[point] + dx, reference.y[point] + dy]);
        }
    }
}

/// Offsets from sites to those around them, by sublattice: listed once for all frame sites, as far as one of them had to look.
struct Around<'a> {
    lattice: &'a Lattice,
    /// How far the offsets reach \[length\], and they, nearest first; of each sublattice.
    offsets: Vec<(f64, Vec<Site>)>,
}

impl<'a> Around<'a> {
    fn new(lattice: &'a Lattice) -> Self {
        Self { lattice, offsets: Vec::new() }
    }

    fn within(&mut self, sublattice: usize, radius: f64) -> &[Site] {
        let known = self.offsets.len().max(sublattice + 1);
        self.offsets.resize_with(known, Default::default);
        let of = &mut self.offsets[sublattice];
        if of.0 < radius {
            *of = (radius, self.lattice.offsets_within(sublattice, radius));
        }
        &of.1
    }

    /// The body sites nearest to a frame site; several where they are equally near, as at a corner.
    fn nearest(&mut self, site: Site, body: &impl Fn(Site) -> Option<u32>) -> Vec<Site> {
        let lattice = self.lattice;
        let place = |offset: &Site| [site[0] + offset[0], site[1] + offset[1]];
        let is_body = |offset: &&Site| body(place(offset)).is_some();
        let far = |offset: &Site| {
            let [x, y] = lattice.vector(*offset);
            x.hypot(y)
        };
        let mut radius = lattice.spacing();
        // The frame reaches as far as the neighbourhood does, so a few doublings always find the body.
        for _ in 0..16 {
            let offsets = self.within(lattice.sublattice(site), radius);
            if let Some(first) = offsets.iter().position(|offset| is_body(&offset)) {
                // Equally near but for rounding, by which they are sorted among each other too.
                let as_near = far(&offsets[first]) * (1.0 + 2e-9);
                let alike = offsets[first..].iter().take_while(|offset| far(offset) <= as_near);
                return alike.filter(is_body).map(place).collect();
            }
            radius *= 2.0;
        }
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::{Body, Cut};
    use super::super::lattice::LatticeKind;
    use super::super::neighbourhood::Neighbourhood;
    use super::super::vectors::distance;
    use super::*;
    use crate::geometry::shape::Shape;

    fn framed(
        kind: LatticeKind,
        shape: Shape,
        neighbourhood: Neighbourhood,
        rule: FrameRule,
    ) -> (Body, Vec<usize>) {
        let lattice = Lattice::new(kind, [0.0; 2], 0.0);
        let (body, neighbours) =
            Body::build(lattice, &Cut::Shape(shape), &neighbourhood, Some(rule)).expect("a body");
        let counts =
            (0..body.count()).filter(|&i| !body.is_frame[i]).map(|i| neighbours.of(i).len()).collect();
        (body, counts)
    }

    /// An L: two arms of width 2 around an empty corner.
    fn corner() -> Shape {
        Shape::Polygon {
            vertices: vec![[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [2.0, 2.0], [2.0, 6.0], [0.0, 6.0]],
        }
    }

    /// The sites that the frame point at `site` serves.
    fn served(body: &Body, site: Site) -> Vec<Site> {
        let frame = body.frame.as_ref().expect("framed");
        let k = frame.points.iter().position(|&p| body.sites[p as usize] == site).expect("a frame point");
        frame.served_by(k).iter().map(|&i| body.sites[i as usize]).collect()
    }

    #[test]
    fn every_particle_of_a_framed_body_has_all_its_neighbours_on_every_lattice() {
        for kind in LatticeKind::SAMPLES {
            for neighbourhood in [Neighbourhood::First { keep: None }, Neighbourhood::Second] {
                for shape in [Shape::Disc { centre: [0.0; 2], radius: 4.0 }, corner()] {
                    let (body, counts) = framed(kind, shape, neighbourhood.clone(), FrameRule::Lagged);
                    let all = neighbourhood.offsets(&body.lattice).expect("fits")[0].len();
                    assert!(counts.iter().all(|&count| count == all), "{kind:?} {neighbourhood:?}");
                    let frame = body.frame.as_ref().expect("framed");
                    assert!((0..frame.len()).all(|k| !frame.served_by(k).is_empty()), "{kind:?}");
                }
            }
        }
    }

    #[test]
    fn a_frame_point_serves_its_nearest_particles_and_a_corner_averages_them() {
        let square = LatticeKind::Square { spacing: 1.0 };
        let first = Neighbourhood::First { keep: None };
        let (body, _) = framed(square, corner(), first, FrameRule::Lagged);
        assert_eq!(served(&body, [3, -1]), [[3, 0]]);
        assert_eq!(served(&body, [-1, -1]), [[0, 0]]);
        // Beside both arms of the L: as near to one as to the other.
        let mut both = served(&body, [3, 3]);
        both.sort_unstable();
        assert_eq!(both, [[2, 3], [3, 2]]);
        let frame = body.frame.as_ref().expect("framed");
        let k = frame.points.iter().position(|&p| body.sites[p as usize] == [3, 3]).expect("a frame point");
        let mut seen = Vectors::clone(&body.reference);
        let at = |site: Site| body.sites.iter().position(|&s| s == site).expect("a particle");
        seen.set(at([2, 3]), [2.0 + 0.4, 3.0]);
        seen.set(at([3, 2]), [3.0, 2.0 - 0.2]);
        let [dx, dy] = frame.displacement(k, &body.reference, &seen);
        assert!((dx - 0.2).abs() < 1e-15 && (dy + 0.1).abs() < 1e-15, "{dx} {dy}");
    }

    #[test]
    fn a_wide_frame_serves_the_particles_that_none_is_nearer_than() {
        for kind in LatticeKind::SAMPLES {
            let wide = Neighbourhood::Within { radius: 4.5 * Lattice::new(kind, [0.0; 2], 0.0).spacing() };
            let (body, _) = framed(kind, corner(), wide, FrameRule::Lagged);
            let frame = body.frame.as_ref().expect("framed");
            for (k, &point) in frame.points.iter().enumerate() {
                let far = |i: usize| distance(body.reference.get(i), body.reference.get(point as usize));
                let particles = (0..body.count()).filter(|&i| !body.is_frame[i]);
                let least = particles.clone().map(far).fold(f64::INFINITY, f64::min);
                let mut served = frame.served_by(k).to_vec();
                served.sort_unstable();
                let nearest: Vec<u32> =
                    particles.filter(|&i| far(i) < least + 1e-6).map(|i| i as u32).collect();
                assert_eq!(served, nearest, "{kind:?}");
            }
        }
    }

    #[test]
    fn the_mirror_shows_the_particle_opposite_across_the_edge() {
        let square = LatticeKind::Square { spacing: 1.0 };
        let shape = Shape::Rectangle { min: [0.0; 2], max: [5.0, 5.0] };
        let (body, _) = framed(square, shape.clone(), Neighbourhood::Second, FrameRule::Mirror);
        assert_eq!(served(&body, [3, -1]), [[3, 1]]);
        assert_eq!(served(&body, [3, -2]), [[3, 2]]);
        assert_eq!(served(&body, [-1, -1]), [[1, 1]]);
        // A body one row deep has no particle opposite: the point shows the edge itself.
        let row = Shape::Rectangle { min: [0.0; 2], max: [5.0, 0.0] };
        let (body, _) = framed(square, row, Neighbourhood::First { keep: None }, FrameRule::Mirror);
        assert_eq!(served(&body, [3, -1]), [[3, 0]]);
    }

    #[test]
    fn a_lagging_frame_looks_before_the_sweep_and_the_others_after_it() {
        let square = LatticeKind::Square { spacing: 1.0 };
        let shape = Shape::Rectangle { min: [0.0; 2], max: [4.0, 4.0] };
        for (rule, expected) in
            [(FrameRule::Lagged, 1.0), (FrameRule::Immediate, 3.0), (FrameRule::Mirror, 3.0)]
        {
            let (body, _) = framed(square, shape.clone(), Neighbourhood::First { keep: None }, rule);
            let frame = body.frame.as_ref().expect("framed");
            let shifted = |by: f64| -> Vectors { body.reference.iter().map(|[x, y]| [x + by, y]).collect() };
            let mut next = shifted(3.0);
            frame.follow(&body.reference, &shifted(1.0), &mut next);
            for &point in &frame.points {
                assert_eq!(next.x[point as usize] - body.reference.x[point as usize], expected, "{rule:?}");
            }
        }
    }
}
