//! The faces of a lattice: triangles, quadrilaterals or hexagons between first neighbours.

use std::collections::HashSet;

use crate::flock::body::Body;
use crate::flock::lattice::Site;

/// Faces whose corners are all marked in `included` and no two of whose corners are a broken pair;
/// indices of particles, anticlockwise in the reference configuration.
pub fn faces(body: &Body, included: &[bool], broken: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let around: Vec<Vec<Site>> = (0..body.lattice.sublattices()).map(|s| by_angle(body, s)).collect();
    let broken: HashSet<[u32; 2]> = broken.iter().copied().collect();
    let is_whole = |face: &[u32]| {
        broken.is_empty()
            || face
                .iter()
                .enumerate()
                .all(|(n, &a)| face[n + 1..].iter().all(|&b| !broken.contains(&[a.min(b), a.max(b)])))
    };
    let mut found = Vec::new();
    for &site in &body.sites {
        for &direction in &around[body.lattice.sublattice(site)] {
            if let Some(face) = face_left_of(body, &around, site, direction)
                && face.iter().all(|&corner| included[corner as usize])
                && is_whole(&face)
            {
                found.push(face);
            }
        }
    }
    found
}

/// First neighbours of a sublattice, anticlockwise.
fn by_angle(body: &Body, sublattice: usize) -> Vec<Site> {
    let angle = |offset: &Site| {
        let [x, y] = body.lattice.vector(*offset);
        y.atan2(x)
    };
    let mut offsets = body.lattice.first_neighbours(sublattice);
    offsets.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    offsets
}

/// Walks around the face to the left of the edge that leaves `first` in `direction`; `None` if a
/// corner is missing or comes before `first`, from where the same face is found too.
fn face_left_of(body: &Body, around: &[Vec<Site>], first: Site, direction: Site) -> Option<Vec<u32>> {
    let mut face = Vec::with_capacity(6);
    let (mut site, mut direction) = (first, direction);
    loop {
        // Sites are numbered in their own order.
        face.push(body.sites.binary_search(&site).ok()? as u32);
        site = [site[0] + direction[0], site[1] + direction[1]];
        if site == first {
            return Some(face);
        }
        if site < first {
            return None;
        }
        let leaving = &around[body.lattice.sublattice(site)];
        let back = leaving.iter().position(|&offset| offset == [-direction[0], -direction[1]])?;
        direction = leaving[(back + leaving.len() - 1) % leaving.len()];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::Cut;
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::flock::neighbourhood::Neighbourhood;

    fn block(kind: LatticeKind, neighbourhood: Neighbourhood) -> Body {
        let lattice = Lattice::new(kind, [0.0; 2], 0.4);
        Body::build(lattice, &Cut::Count { columns: 7, rows: 7 }, &neighbourhood, None).expect("a body").0
    }

    fn area(body: &Body, face: &[u32]) -> f64 {
        let at = |n: usize| body.reference.get(face[n % face.len()] as usize);
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        (0..face.len()).map(|n| cross(at(n), at(n + 1)) / 2.0).sum()
    }

    #[test]
    fn every_lattice_is_tiled_by_its_faces() {
        for (kind, corners) in [
            (LatticeKind::Square { spacing: 1.0 }, 4),
            (LatticeKind::Rectangular { a: 1.0, b: 1.5 }, 4),
            (LatticeKind::CentredRectangular { a: 1.0, b: 1.4 }, 3),
            (LatticeKind::Hexagonal { spacing: 1.0 }, 3),
            (LatticeKind::Oblique { a: 1.0, b: 1.2, angle: 1.2 }, 3),
            (LatticeKind::Honeycomb { spacing: 1.0 }, 6),
        ] {
            let body = block(kind, Neighbourhood::First { keep: None });
            let found = faces(&body, &vec![true; body.count()], &[]);
            // A face has the area of the particles that it stands for.
            let share = match corners {
                3 => 0.5,
                4 => 1.0,
                _ => 2.0,
            };
            assert!(found.len() > 4, "{kind:?}");
            for face in found {
                assert_eq!(face.len(), corners, "{kind:?}");
                assert!((area(&body, &face) - share * body.lattice.cell_area()).abs() < 1e-9, "{kind:?}");
            }
        }
    }

    #[test]
    fn each_face_is_found_once_and_left_out_when_broken_or_incomplete() {
        let body = block(LatticeKind::Square { spacing: 1.0 }, Neighbourhood::First { keep: None });
        let mut included = vec![true; 49];
        assert_eq!(faces(&body, &included, &[]).len(), 36);
        assert_eq!(faces(&body, &included, &[[8, 9]]).len(), 34);
        included[0] = false;
        assert_eq!(faces(&body, &included, &[]).len(), 35);
    }
}
