//! Any polygon with a hole, on any lattice in any direction: areas, resultants, uniform strains, quality.

use flockform::flock::body::{Body, Cut};
use flockform::flock::lattice::{Lattice, LatticeKind};
use flockform::flock::law::{Flock, Weights};
use flockform::flock::neighbourhood::Neighbours;
use flockform::flock::outlay::Outlay;
use flockform::flock::rules::{Mean, Rotation, Rule};
use flockform::flock::vectors::Vectors;
use flockform::geometry::outline::Outline;
use flockform::geometry::point::area;
use flockform::geometry::portion::Selection;
use flockform::geometry::shape::Shape;
use flockform::material::boundary::Boundary;
use flockform::material::cells::{Cells, neighbourhood, templates};
use flockform::material::elastic::{Constants, Elastic, Plane};
use flockform::material::fit::{Fitted, LEAST_AREA, LEAST_SIDE, LEAST_WIDTH, fit};
use flockform::material::outline_loads::{Load, Loader, OutlineLoad, Push, Resultant};
use flockform::material::weights::assemble;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Uniform numbers from 0 to 1, the same ones every time.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn star(&mut self, centre: [f64; 2], [least, most]: [f64; 2], corners: usize) -> Vec<[f64; 2]> {
        let corner = |k: usize| {
            let angle = std::f64::consts::TAU * (k as f64 + 0.6 * self.next()) / corners as f64;
            let radius = least + (most - least) * self.next();
            [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
        };
        (0..corners).map(corner).collect()
    }

    fn polygon_with_hole(&mut self) -> Outline {
        let centre = [3.0 * self.next(), 3.0 * self.next()];
        let (outer, inner) = (5 + (5.0 * self.next()) as usize, 3 + (4.0 * self.next()) as usize);
        let polygons = [self.star(centre, [4.5, 8.0], outer), self.star(centre, [1.2, 2.2], inner)];
        Outline::of_polygons(&polygons).expect("an outline")
    }

    fn fitted(&mut self, kind: LatticeKind) -> (Outline, Fitted) {
        let outline = self.polygon_with_hole();
        let lattice = Lattice::new(kind, [self.next(), self.next()], 3.0 * self.next());
        let fitted = fit(&lattice, &outline).expect("fits");
        (outline, fitted)
    }
}

pub const KINDS: [LatticeKind; 6] = [
    LatticeKind::Square { spacing: 1.0 },
    LatticeKind::Rectangular { a: 1.0, b: 0.8 },
    LatticeKind::CentredRectangular { a: 1.0, b: 1.0 },
    LatticeKind::Hexagonal { spacing: 1.0 },
    LatticeKind::Oblique { a: 1.0, b: 1.0, angle: 1.22 },
    LatticeKind::Honeycomb { spacing: 0.577_350_269_189_625_8 },
];

#[test]
fn five_hundred_polygons_with_holes_pass_the_patch_test_on_each_lattice_with_exact_areas_and_resultants() {
    KINDS.into_par_iter().enumerate().for_each(|(k, kind)| {
        let mut noise = Noise(2021 + k as u64);
        let worst = (0..500).map(|round| left_of_uniform_stress(&mut noise, kind, round)).fold(0.0, f64::max);
        println!("{kind:?}: at most {worst:.1e} of stress times spacing is left");
    });
}

/// A body as its particles feel its material.
pub fn felt(body: &Body, cells: &Cells, neighbours: Neighbours, elastic: &Elastic) -> Flock {
    let weights = assemble(cells, body, &neighbours, elastic, Rotation::Small).expect("holds together");
    let rule = Rule { mean: Mean::Material { rotation: Rotation::Small }, ..Rule::BARYCENTRE };
    Flock::new(rule, body.reference.clone(), neighbours, Weights::Matrix(weights))
}

/// The largest force that a uniform stress leaves on a particle of a random polygon with a hole, in stress times spacing
/// times thickness: the force that the stress puts on the side of a cell, of which a particle's forces are the sum.
fn left_of_uniform_stress(noise: &mut Noise, kind: LatticeKind, round: usize) -> f64 {
    let steel = Constants::Isotropic { young: 1000.0, poisson: 0.3, plane: Plane::Stress };
    let elastic = Elastic::new(steel, 1.0).expect("admissible");
    let affine = |[x, y]: [f64; 2]| [2e-3 * x - 1e-3 * y, 0.5e-3 * x + 3e-3 * y];
    let [xx, yy, xy] = elastic.stress([2e-3, 3e-3, -0.5e-3]);
    let largest =
        elastic.stress([2e-3, 3e-3, -0.5e-3]).into_iter().fold(0.0, |most: f64, s| most.max(s.abs()));
    let (outline, Fitted { body, cells }) = noise.fitted(kind);
    let label = format!("round {round}, {kind:?}");
    let total: f64 = cells.kind.iter().map(|&k| area(&cells.shapes[k as usize])).sum();
    assert!((total / outline.area() - 1.0).abs() < 1e-12, "{label}: area");
    let quality = Fitted { body: body.clone(), cells: cells.clone() }.quality();
    assert!(quality.area >= LEAST_AREA - 1e-9 && quality.side >= LEAST_SIDE - 1e-9, "{label}: {quality:?}");
    assert!(quality.width > LEAST_WIDTH - 1e-9, "{label}: {quality:?}");

    // The tractions of a uniform stress on every piece balance the stiffness of the uniform strain everywhere.
    let boundary = Boundary::of(&cells, &body.reference);
    let loader = Loader::new(&cells, &body, (Some(&outline), &boundary));
    let mut loads = Vectors::<f64>::zeros(body.count());
    for (ring, pieces) in outline.rings().iter().enumerate() {
        for piece in pieces {
            let [nx, ny] = piece.normal(0.5);
            let traction = [xx * nx + xy * ny, xy * nx + yy * ny];
            let only = Selection::Pieces { ring, pieces: vec![piece.number], angles: None };
            let portions = outline.portions(&only, 1e-9);
            let load = OutlineLoad { portions, push: Push::Traction(traction), profile: None };
            let mut forces = Vectors::zeros(body.count());
            loader.add(&Load::Outline(load), &mut forces).expect("fits");
            let Resultant { force, moment } = Resultant::of(body.reference.iter().zip(forces.iter()));
            let (length, middle) = (piece.length(), piece.point(0.5));
            let exact = middle[0] * traction[1] - middle[1] * traction[0];
            let off = (0..2).map(|k| (force[k] - length * traction[k]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-12 * length * 10.0 && (moment - length * exact).abs() < 1e-10, "{label}");
            for i in 0..body.count() {
                let (sum, more) = (loads.get(i), forces.get(i));
                loads.set(i, [sum[0] + more[0], sum[1] + more[1]]);
            }
        }
    }
    let near = cells.cell_neighbours(body.count());
    let felt = felt(&body, &cells, near, &elastic);
    let moved: Vectors = body.reference.iter().map(affine).collect();
    let left = |i: usize| {
        let (pull, load) = (felt.force_under(i, &moved), loads.get(i));
        (pull[0] + load[0]).hypot(pull[1] + load[1])
    };
    let worst = (0..body.count()).map(left).fold(0.0, f64::max) / (largest * body.lattice.spacing());
    assert!(worst < 1e-12, "{label}: {worst:e} is left");
    worst
}

/// Condition number of a body's stiffness without its rigid motions, and the square of its highest frequency with the
/// masses lumped at the particles \[1\].
fn spectrum(cells: &Cells, count: usize, elastic: &Elastic) -> [f64; 2] {
    let (mut k, mut mass) = (DMatrix::<f64>::zeros(2 * count, 2 * count), vec![0.0; count]);
    for (cell, &kind) in cells.iter().zip(&cells.kind) {
        let element = cells.element(kind as usize, elastic).expect("a cell");
        let share = area(&cells.shapes[kind as usize]) / cell.len() as f64;
        for (a, &i) in cell.iter().enumerate() {
            mass[i as usize] += share;
            for (b, &j) in cell.iter().enumerate() {
                for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    k[(2 * i as usize + p, 2 * j as usize + q)] += element[(2 * a + p, 2 * b + q)];
                }
            }
        }
    }
    let mut values: Vec<f64> = k.clone().symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    let scaled =
        DMatrix::from_fn(2 * count, 2 * count, |a, b| k[(a, b)] / (mass[a / 2] * mass[b / 2]).sqrt());
    [values[2 * count - 1] / values[3], scaled.symmetric_eigenvalues().max()]
}

#[test]
fn cut_cells_cost_at_most_three_times_the_condition_and_eight_times_the_highest_frequency_squared() {
    let mut noise = Noise(99);
    let steel = Constants::Isotropic { young: 1.0, poisson: 0.3, plane: Plane::Stress };
    let elastic = Elastic::new(steel, 1.0).expect("admissible");
    let mut worst = [0.0f64; 2];
    for round in 0..24 {
        let kind = KINDS[round % 6];
        let (outline, fitted) = noise.fitted(kind);
        let corners = |ring: usize| outline.rings()[ring].iter().map(|piece| piece.from).collect::<Vec<_>>();
        let shape = Shape::WithHoles {
            body: Box::new(Shape::Polygon { vertices: corners(0) }),
            holes: vec![Shape::Polygon { vertices: corners(1) }],
        };
        let lattice = fitted.body.lattice.clone();
        let (lattice, cut, near) = (&lattice, &Cut::Shape(shape), &neighbourhood(&lattice));
        let outlay = Outlay { lattice, cut, neighbourhood: near, frame: None, cells: templates(lattice) };
        let (whole, _) = outlay.lay_out(None).expect("builds");
        let whole_cells = Cells::of_body(&whole);
        let fitted = spectrum(&fitted.cells, fitted.body.count(), &elastic);
        let whole = spectrum(&whole_cells, whole.count(), &elastic);
        let ratio = [fitted[0] / whole[0], fitted[1] / whole[1]];
        assert!(ratio[0] < 3.0 && ratio[1] < 8.0, "round {round}, {kind:?}: {ratio:?}");
        worst = [worst[0].max(ratio[0]), worst[1].max(ratio[1])];
    }
    println!(
        "at most {:.2} times the condition, {:.2} times the highest frequency squared",
        worst[0], worst[1]
    );
}
