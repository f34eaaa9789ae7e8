use std::collections::HashMap;

use super::*;
use crate::flock::lattice::LatticeKind;
use crate::geometry::piece::Piece;
use crate::geometry::shape::Shape;

/// Uniform numbers from 0 to 1, the same ones every time.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn star(&mut self, centre: [f64; 2], [least, most]: [f64; 2], corners: usize) -> Vec<[f64; 2]> {
        let at = |k: usize, noise: &mut Self| {
            let angle = std::f64::consts::TAU * (k as f64 + 0.6 * noise.next()) / corners as f64;
            let radius = least + (most - least) * noise.next();
            [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
        };
        (0..corners).map(|k| at(k, self)).collect()
    }

    /// A star with a hole, about 14 across.
    pub fn polygon_with_hole(&mut self) -> Vec<Vec<[f64; 2]>> {
        let centre = [3.0 * self.next(), 3.0 * self.next()];
        let (outer, inner) = (5 + (5.0 * self.next()) as usize, 3 + (4.0 * self.next()) as usize);
        vec![self.star(centre, [4.5, 8.0], outer), self.star(centre, [1.2, 2.2], inner)]
    }
}

/// The six lattices as the prototype has them.
pub const KINDS: [LatticeKind; 6] = [
    LatticeKind::Square { spacing: 1.0 },
    LatticeKind::Rectangular { a: 1.0, b: 0.8 },
    LatticeKind::CentredRectangular { a: 1.2, b: 1.0 },
    LatticeKind::Hexagonal { spacing: 1.0 },
    LatticeKind::Oblique { a: 1.0, b: 1.0, angle: 1.22 },
    LatticeKind::Honeycomb { spacing: 0.577_350_269_189_625_8 },
];

fn total_area(fitted: &Fitted) -> f64 {
    fitted.cells.kind.iter().map(|&kind| area(&fitted.cells.shapes[kind as usize])).sum()
}

/// Every side is shared by two cells that have it the other way round, or lies on the outline.
fn require_closed(fitted: &Fitted, label: &str) {
    let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
    for cell in 0..fitted.cells.count() {
        for side in fitted.cells.sides(cell) {
            *sides.entry(side).or_default() += 1;
        }
    }
    let places = &fitted.body.outline.as_ref().expect("fitted").places;
    for (&[a, b], &count) in &sides {
        assert_eq!(count, 1, "{label}: side {a}-{b} twice the same way");
        if !sides.contains_key(&[b, a]) {
            for end in [a, b] {
                assert!(places[end as usize].is_some(), "{label}: particle {end} of a free side is inside");
            }
        }
    }
    let lone = fitted.cells.incidence(fitted.body.count());
    assert!((0..fitted.body.count()).all(|i| !lone.of(i).is_empty()), "{label}: a particle in no cell");
}

#[test]
fn polygons_with_holes_are_kept_exactly_on_every_lattice_in_any_direction() {
    let mut noise = Noise(7);
    let (mut least, mut fits, mut refused) = (Quality { area: 9.0, side: 9.0, width: 9.0 }, 0, Vec::new());
    for round in 0..36 {
        let kind = KINDS[round % 6];
        let polygons = noise.polygon_with_hole();
        let lattice = Lattice::new(kind, [noise.next(), noise.next()], 3.0 * noise.next());
        let outline = Outline::of_polygons(&polygons).expect("an outline");
        let label = format!("round {round}, {kind:?}");
        let fitted = match fit(&lattice, &outline) {
            Ok(fitted) => fitted,
            Err(error) => {
                refused.push(format!("{label}: {error}"));
                continue;
            }
        };
        fits += 1;
        require_closed(&fitted, &label);
        let off = (total_area(&fitted) / outline.area() - 1.0).abs();
        assert!(off < 1e-13, "{label}: area off by {off:e}");
        let quality = fitted.quality();
        least = Quality {
            area: least.area.min(quality.area),
            side: least.side.min(quality.side),
            width: least.width.min(quality.width),
        };
        assert!(quality.area > 0.39, "{label}: {quality:?}");
    }
    assert_eq!(fits, 36, "{refused:#?}");
}

#[test]
fn a_rectangle_of_whole_cells_is_the_lattice_itself() {
    let lattice = Lattice::new(LatticeKind::Square { spacing: 0.1 }, [0.3, 0.1], 0.0);
    let shape = Shape::Rectangle { min: [0.3, 0.1], max: [1.3, 0.7] };
    let fitted = fit(&lattice, &Outline::of_shape(&shape).expect("an outline")).expect("fits");
    assert_eq!(fitted.body.count(), 11 * 7);
    assert_eq!(fitted.body.outline.expect("fitted").regular, 77);
    assert_eq!(fitted.cells.shapes.len(), 1);
}

#[test]
fn a_disc_with_a_hole_is_kept_to_the_sagitta_of_its_chords() {
    for kind in KINDS {
        let lattice = Lattice::new(kind, [0.1, 0.2], 0.4);
        let shape = Shape::WithHoles {
            body: Box::new(Shape::Disc { centre: [0.0; 2], radius: 9.0 }),
            holes: vec![Shape::Disc { centre: [2.0, 1.0], radius: 2.0 }],
        };
        let outline = Outline::of_shape(&shape).expect("an outline");
        let fitted = fit(&lattice, &outline).expect("fits");
        require_closed(&fitted, &format!("{kind:?}"));
        let off = total_area(&fitted) / outline.area() - 1.0;
        assert!(off.abs() < 0.005, "{kind:?} {off}");
        assert!(fitted.quality().area > 0.39, "{kind:?} {:?}", fitted.quality());
    }
}

#[test]
fn a_row_of_small_parts_does_not_end_in_one_cell() {
    let lattice = Lattice::new(LatticeKind::Honeycomb { spacing: 0.1 / 3f64.sqrt() }, [2.0, -1.0], 0.0);
    let shape = Shape::Rectangle { min: [2.0, -1.0], max: [6.0, 3.0] };
    let fitted = fit(&lattice, &Outline::of_shape(&shape).expect("an outline")).expect("fits");
    // Two hexagons that share a side have ten corners; an outline may add some.
    assert!(fitted.cells.most_corners() <= 12, "{}", fitted.cells.most_corners());
    assert!(fitted.quality().area > 0.39);
}

#[test]
fn a_curve_drawn_with_finer_edges_than_the_lattice_has_is_a_curve() {
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / 20_000.0;
        let radius = 9.0 * (1.0 + 0.05 * (10.0 * angle).sin());
        [radius * angle.cos(), radius * angle.sin()]
    };
    let outline = Outline::of_polygons(&[(0..20_000).map(corner).collect()]).expect("an outline");
    for kind in KINDS {
        let fitted = fit(&Lattice::new(kind, [0.1, 0.2], 0.4), &outline).expect("fits");
        require_closed(&fitted, &format!("{kind:?}"));
        assert!(fitted.cells.most_corners() < 16, "{kind:?}: {}", fitted.cells.most_corners());
        assert!(
            fitted.quality().area > 0.39 && (total_area(&fitted) / outline.area() - 1.0).abs() < 0.01,
            "{kind:?}"
        );
    }
}

/// Sides that are cut into several pieces, or begin elsewhere, are the same sides.
#[test]
fn how_an_outline_is_cut_into_pieces_makes_no_shape_narrow() {
    let fits = |outline: Outline, spacing: f64| {
        fit(&Lattice::new(LatticeKind::Square { spacing }, [0.0; 2], 0.0), &outline)
            .map(|fitted| total_area(&fitted))
    };
    let polygon = |corners: &[[f64; 2]]| Outline::of_polygons(&[corners.to_vec()]).expect("an outline");
    let wedge = [[0.0, 0.0], [10.0, 0.0], [10.0, 3.64]];
    let more = |extra: &[[f64; 2]]| polygon(&[&wedge, extra].concat());
    for spacing in [0.25, 0.5] {
        for outline in [more(&[]), more(&[[1.0, 0.364]]), more(&[[7.0, 2.548], [1.0, 0.364], [0.1, 0.0364]])]
        {
            let area = fits(outline, spacing).unwrap_or_else(|error| panic!("{spacing}: {error}"));
            assert!((area - 18.2).abs() < 1e-9, "{spacing}: {area}");
        }
    }
    // A segment of a circle, its arc in one and in three pieces.
    let high = 75.0_f64.sqrt();
    let segment = |angles: &[f64]| {
        let at = |degrees: f64| [10.0 * degrees.to_radians().cos(), 10.0 * degrees.to_radians().sin() - high];
        let arcs =
            angles.windows(2).map(|two| Piece::arc_between(at(two[0]), at(two[1]), [0.0, -high], false));
        let chord = Piece::edge(at(120.0), at(60.0));
        Outline::of_shape(&Shape::Path { pieces: std::iter::once(chord).chain(arcs).collect() })
            .expect("an outline")
    };
    for angles in [&[60.0, 120.0][..], &[60.0, 62.0, 118.0, 120.0], &[60.0, 61.0, 90.0, 120.0]] {
        fits(segment(angles), 0.5).unwrap_or_else(|error| panic!("{angles:?}: {error}"));
    }
    // What is narrow between sides that do not meet is so however they are cut.
    let neck = |cut: &[[f64; 2]]| {
        let left = [
            [4.0, 2.2],
            [0.0, 4.0],
            [0.0, 0.0],
            [4.0, 1.8],
            [6.0, 1.8],
            [10.0, 0.0],
            [10.0, 4.0],
            [6.0, 2.2],
        ];
        polygon(&[&left[..], cut].concat())
    };
    for cut in [&[][..], &[[5.0, 2.2]], &[[5.5, 2.2], [4.5, 2.2]]] {
        assert!(matches!(fits(neck(cut), 0.5), Err(FitError::Narrow { .. })), "{cut:?}");
    }
}
