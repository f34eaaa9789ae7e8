//! Regions pick particles of a body, by where they are in the reference configuration.

use super::body::Body;
use super::neighbourhood::Neighbours;
use crate::geometry::portion::Area;

/// Which particles; the frame is never picked.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// The whole body.
    All,
    /// The particles within `depth` \[length\] of the body's outermost coordinate on that side.
    Edge {
        /// Which side of the body's bounds.
        side: Side,
        /// How far from that side into the body.
        depth: f64,
    },
    /// The particles in this box or disc.
    In(Area),
    /// The particles with these ids.
    Ids(Vec<usize>),
    /// Every particle that lacks a neighbour: the outline of the body, holes included.
    Boundary,
}

/// A side of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Lowest x.
    Left,
    /// Highest x.
    Right,
    /// Lowest y.
    Bottom,
    /// Highest y.
    Top,
}

impl Region {
    /// Indices of the particles of `body` in the region, ascending. `complete` says how many neighbours a particle inside a
    /// body has, by sublattice; where it is empty, the particle with the most has them all.
    pub fn pick(&self, body: &Body, neighbours: &Neighbours, complete: &[usize]) -> Vec<usize> {
        let tolerance = 1e-9 * body.lattice.spacing();
        let matter = body.body_particles();
        let place = |i: usize| body.reference.get(i);
        match self {
            Region::All => matter.collect(),
            Region::Edge { side, depth } => {
                let (low, high) = body.bounds();
                let depth = depth + tolerance;
                matter
                    .filter(|&i| match side {
                        Side::Left => place(i)[0] - low[0] <= depth,
                        Side::Right => high[0] - place(i)[0] <= depth,
                        Side::Bottom => place(i)[1] - low[1] <= depth,
                        Side::Top => high[1] - place(i)[1] <= depth,
                    })
                    .collect()
            }
            Region::In(area) => matter.filter(|&i| area.contains(place(i), tolerance)).collect(),
            Region::Ids(ids) => matter.filter(|&i| ids.contains(&body.id(i))).collect(),
            Region::Boundary if body.outline.is_some() => {
                let known = body.outline.iter().flat_map(|outline| outline.places.iter().enumerate());
                known.filter_map(|(i, place)| place.map(|_| i)).collect()
            }
            Region::Boundary => {
                let most = || matter.clone().map(|i| neighbours.of(i).len()).max().unwrap_or(0);
                let most = || body.part.as_ref().map_or_else(most, |part| part.whole.neighbours);
                let most = complete.is_empty().then(most);
                let of_site = |i: usize| complete[body.lattice.sublattice(body.sites[i])];
                let complete = |i: usize| most.unwrap_or_else(|| of_site(i));
                let lacks = |i: usize| {
                    let seen = neighbours.of(i);
                    seen.len() < complete(i) || seen.iter().any(|&k| body.is_frame[k as usize])
                };
                matter.filter(|&i| lacks(i)).collect()
            }
        }
    }
}
