//! The faces of a lattice: triangles, quadrilaterals or hexagons between first neighbours.

use std::collections::HashSet;

use crate::flock::body::Body;
use crate::flock::lattice::LatticeKind;
use crate::material::cells::{Cells, templates, triangles};

/// Faces whose corners are all marked in `included` and no two of whose corners are a broken pair;
/// indices of particles, anticlockwise in the reference configuration.
pub fn faces(body: &Body, included: &[bool], broken: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let templates = match body.lattice.kind() {
        // Rhombs and parallelograms would leave notches at edges that zigzag.
        LatticeKind::CentredRectangular { .. } | LatticeKind::Oblique { .. } => {
            triangles(&body.lattice).to_vec()
        }
        _ => templates(&body.lattice),
    };
    let faces = Cells::of_sites(&body.lattice, &templates, &body.sites, |i| included[i]);
    let broken: HashSet<[u32; 2]> = broken.iter().copied().collect();
    let is_whole = |face: &&[u32]| {
        broken.is_empty()
            || face
                .iter()
                .enumerate()
                .all(|(n, &a)| face[n + 1..].iter().all(|&b| !broken.contains(&[a.min(b), a.max(b)])))
    };
    faces.iter().filter(is_whole).map(<[u32]>::to_vec).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::body::Cut;
    use crate::flock::lattice::{Lattice, LatticeKind};
    use crate::flock::neighbourhood::Neighbourhood;
    use crate::geometry::point::area;

    fn block(kind: LatticeKind, neighbourhood: Neighbourhood) -> Body {
        let lattice = Lattice::new(kind, [0.0; 2], 0.4);
        Body::build(lattice, &Cut::Count { columns: 7, rows: 7 }, &neighbourhood, None).expect("a body").0
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
                let corners: Vec<_> =
                    face.iter().map(|&corner| body.reference.get(corner as usize)).collect();
                assert!((area(&corners) - share * body.lattice.cell_area()).abs() < 1e-9, "{kind:?}");
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
