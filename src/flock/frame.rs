//! The frame: a shell of points around the body that gives edge particles their full
//! neighbourhood (the paper's Choice 4).
//!
//! A frame point copies the displacement of the particles it serves; where they are several it
//! takes their average. The rules differ in whom it serves and when it looks:
//! `Lagged` and `Immediate` serve the nearest particles of the body, before and after the sweep;
//! `Mirror` continues the body beyond its edge by serving the particle opposite across that
//! nearest one, so that the edge sees what an interior particle would.

use super::lattice::{Lattice, Site};
use super::points::Points;

/// Whom a frame point serves, and when it looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameRule {
    /// The nearest particles' displacement before the sweep: the edge follows with a delay, which
    /// is the convexity of the paper's figure 1.
    Lagged,
    /// The nearest particles' displacement after the sweep.
    Immediate,
    /// The displacement, after the sweep, of the particle opposite across the nearest one.
    Mirror,
}

impl FrameRule {
    pub fn name(self) -> &'static str {
        match self {
            FrameRule::Lagged => "lagged",
            FrameRule::Immediate => "immediate",
            FrameRule::Mirror => "mirror",
        }
    }

    /// Whether the displacements copied are those from before the sweep.
    pub fn looks_before_the_sweep(self) -> bool {
        self == FrameRule::Lagged
    }
}

/// Frame points and the particles each serves, in compressed rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub rule: FrameRule,
    /// Particle index of each frame point, shape \[points\].
    pub points: Vec<u32>,
    starts: Vec<u32>,
    served: Vec<u32>,
}

impl Frame {
    /// Finds whom each frame point serves; `index` looks a particle up by its site.
    pub fn build(
        rule: FrameRule,
        lattice: &Lattice,
        sites: &[Site],
        is_frame: &[bool],
        index: impl Fn(Site) -> Option<u32>,
    ) -> Self {
        let body = |site: Site| index(site).filter(|&i| !is_frame[i as usize]);
        let mut frame = Self { rule, points: Vec::new(), starts: vec![0], served: Vec::new() };
        for (point, &site) in sites.iter().enumerate().filter(|&(point, _)| is_frame[point]) {
            frame.points.push(point as u32);
            for near in nearest(lattice, site, &body) {
                let opposite = [2 * near[0] - site[0], 2 * near[1] - site[1]];
                let served =
                    if rule == FrameRule::Mirror { body(opposite).or(body(near)) } else { body(near) };
                frame.served.extend(served);
            }
            frame.starts.push(frame.served.len() as u32);
        }
        frame
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The particles that the frame point number `k` serves.
    pub fn served_by(&self, k: usize) -> &[u32] {
        &self.served[self.starts[k] as usize..self.starts[k + 1] as usize]
    }

    /// Displacement of frame point number `k` when the body stands at `seen` \[length\].
    pub fn displacement(&self, k: usize, reference: &Points, seen: &Points) -> [f64; 2] {
        let served = self.served_by(k);
        let (mut x, mut y) = (0.0, 0.0);
        for &s in served {
            let s = s as usize;
            x += seen.x[s] - reference.x[s];
            y += seen.y[s] - reference.y[s];
        }
        let count = served.len().max(1) as f64;
        [x / count, y / count]
    }

    /// Moves every frame point of `next` by the displacements seen in `before`, the positions before
    /// the sweep; where the rule does not look there, by those in `next` itself.
    pub fn follow(&self, reference: &Points, before: &Points, next: &mut Points) {
        for (k, &point) in self.points.iter().enumerate() {
            let seen = if self.rule.looks_before_the_sweep() { before } else { &*next };
            let [dx, dy] = self.displacement(k, reference, seen);
            let point = point as usize;
            next.set(point, [reference.x[point] + dx, reference.y[point] + dy]);
        }
    }
}

/// The body sites nearest to a frame site; several where they are equally near, as at a corner.
fn nearest(lattice: &Lattice, site: Site, body: &impl Fn(Site) -> Option<u32>) -> Vec<Site> {
    let place = |offset: &Site| [site[0] + offset[0], site[1] + offset[1]];
    let mut radius = lattice.spacing();
    // The frame reaches as far as the neighbourhood does, so a few doublings always find the body.
    for _ in 0..16 {
        let offsets = lattice.offsets_within(lattice.sublattice(site), radius);
        if let Some(first) = offsets.iter().find(|offset| body(place(offset)).is_some()) {
            let [x, y] = lattice.vector(*first);
            let as_near = x.hypot(y) * (1.0 + 1e-9);
            let found = lattice.offsets_within(lattice.sublattice(site), as_near);
            return found.iter().map(place).filter(|&there| body(there).is_some()).collect();
        }
        radius *= 2.0;
    }
    Vec::new()
}
