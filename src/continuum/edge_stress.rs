//! Stress of the particles along a fitted outline, from the cells near them and the tractions that are known there.
//!
//! A field of the recovery ([`crate::material::recovery`]) goes on in one material and without body force alone. So each
//! particle is given the cells of its own material that no other one hides from it, with the tractions on their sides;
//! and of a body force that part of the stress is taken off which balances it, `-b_x (x - x_0)` and `-b_y (y - y_0)`
//! about the particle: linear, hence compatible in every material, and zero where the result is wanted.

use std::collections::{HashMap, HashSet};

use nalgebra::{Matrix2, SymmetricEigen};
use rayon::prelude::*;

use crate::engine::Engine;
use crate::flock::body::Body;
use crate::flock::rules::Rotation;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::area;
use crate::material::cells::{Cells, Incidence};
use crate::material::elastic::Elastic;
use crate::material::free_edge::Edge;
use crate::material::recovery::{CellStress, FEWEST_CELLS, Fields, KnownTraction, REACH, stress_at};
use crate::material::stress::{self, StressState};

/// Steps of a line of sight \[spacings\].
const SIGHT: f64 = 0.25;

/// Spread of the middles of cells around their mean, in the direction in which it is least, below which they lie in one
/// row \[spacings\]: two rows have a half, one row of triangles has a seventh.
const ONE_ROW: f64 = 0.2;

/// Cells and sides of one material around a particle.
struct Patch {
    region: u32,
    cells: Vec<u32>,
    /// Numbers of known tractions.
    tractions: Vec<u32>,
    is_one_row: bool,
}

/// Why a particle's stress is the mean of its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LeftOut {
    /// Cells of several materials meet there, and stress has no single value.
    Interface,
    /// Too few cells near it.
    Few,
}

/// Finds the cells and tractions near a particle.
struct Patches<'a> {
    edge: &'a Edge,
    reference: &'a Vectors,
    cells: &'a Cells,
    incidence: Incidence,
    spacing: f64,
    /// Middle of each cell \[length\]; of those near the outline alone.
    centroids: HashMap<u32, [f64; 2]>,
    cells_in: HashMap<[i64; 2], Vec<u32>>,
    tractions_in: HashMap<[i64; 2], Vec<u32>>,
}

impl<'a> Patches<'a> {
    fn new(edge: &'a Edge, body: &'a Body, cells: &'a Cells) -> Self {
        let (lattice, reference) = (&body.lattice, &*body.reference);
        // The sites of a honeycomb are nearer to each other than its cells are wide.
        let spacing = lattice.spacing().max((lattice.cell_area() * lattice.sublattices() as f64).sqrt());
        let mut patches = Self {
            edge,
            reference,
            cells,
            incidence: cells.incidence(body.count()),
            spacing,
            centroids: HashMap::new(),
            cells_in: HashMap::new(),
            tractions_in: HashMap::new(),
        };
        let near_edge: HashSet<[i64; 2]> =
            edge.particles.iter().flat_map(|&i| around(patches.bucket(reference.get(i)))).collect();
        for (cell, centroid) in (0..).zip(cells.centroids(reference)) {
            let bucket = patches.bucket(centroid);
            if near_edge.contains(&bucket) {
                patches.cells_in.entry(bucket).or_default().push(cell);
                patches.centroids.insert(cell, centroid);
            }
        }
        for (n, known) in (0..).zip(&edge.tractions) {
            patches.tractions_in.entry(patches.bucket(known.point)).or_default().push(n);
        }
        patches
    }

    fn bucket(&self, point: [f64; 2]) -> [i64; 2] {
        point.map(|v| (v / (REACH * self.spacing)).floor() as i64)
    }

    fn of(&self, particle: usize) -> Result<Patch, LeftOut> {
        let point = self.reference.get(particle);
        let mut own = self.incidence.of(particle).iter().map(|&cell| self.cells.region_of(cell as usize));
        let region = own.next().ok_or(LeftOut::Few)?;
        if own.any(|other| other != region) {
            return Err(LeftOut::Interface);
        }
        let near = |p: [f64; 2]| distance(p, point) < REACH * self.spacing;
        let buckets = || around(self.bucket(point));
        let all: Vec<u32> = buckets()
            .filter_map(|b| self.cells_in.get(&b))
            .flatten()
            .copied()
            .filter(|cell| near(self.centroids[cell]))
            .collect();
        let of_region = |cell: u32| self.cells.region_of(cell as usize) == region;
        let is_mixed = !all.iter().all(|&cell| of_region(cell));
        let is_seen = |cell: u32| !is_mixed || (of_region(cell) && self.sees(point, cell, &all));
        let cells: Vec<u32> = all.iter().copied().filter(|&cell| is_seen(cell)).collect();
        if cells.len() < FEWEST_CELLS {
            return Err(LeftOut::Few);
        }
        let acts_here = |&n: &u32| {
            let (known, cell) = (&self.edge.tractions[n as usize], self.edge.cells[n as usize]);
            near(known.point) && (!is_mixed || cells.contains(&cell))
        };
        let tractions = buckets()
            .filter_map(|b| self.tractions_in.get(&b))
            .flatten()
            .copied()
            .filter(acts_here)
            .collect();
        let is_one_row = self.least_spread(&cells) < ONE_ROW * self.spacing;
        Ok(Patch { region, cells, tractions, is_one_row })
    }

    /// Whether the line from a point to the middle of a cell stays in the cell's material, by the cell whose middle is
    /// nearest to each point of it.
    fn sees(&self, from: [f64; 2], cell: u32, among: &[u32]) -> bool {
        let (to, region) = (self.centroids[&cell], self.cells.region_of(cell as usize));
        let steps = (distance(from, to) / (SIGHT * self.spacing)).ceil().max(1.0);
        (1..steps as usize).all(|k| {
            let part = k as f64 / steps;
            let at = [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
            let apart = |cell: u32| distance(self.centroids[&cell], at);
            let nearest = among.iter().copied().min_by(|&a, &b| apart(a).total_cmp(&apart(b)));
            nearest.is_none_or(|nearest| self.cells.region_of(nearest as usize) == region)
        })
    }

    /// Standard deviation of the middles of cells in the direction in which it is least \[length\].
    fn least_spread(&self, cells: &[u32]) -> f64 {
        let centres: Vectors = cells.iter().map(|cell| self.centroids[cell]).collect();
        let [x, y] = centres.middle();
        let mut sum = Matrix2::zeros();
        for [a, b] in centres.iter().map(|p| [p[0] - x, p[1] - y]) {
            sum += Matrix2::new(a * a, a * b, a * b, b * b);
        }
        let least = SymmetricEigen::new(sum / cells.len() as f64).eigenvalues.min();
        least.max(0.0).sqrt()
    }
}

/// A bucket and those around it.
fn around([x, y]: [i64; 2]) -> impl Iterator<Item = [i64; 2]> {
    (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| [x, y]))
}

/// The particles whose stress is recovered from that of the cells, and it. Of a body that turns all of it is taken in axes
/// that turn with it, in which a stress is in equilibrium but for terms of the size of the strain.
pub(super) fn recovered(
    engine: &Engine,
    elastic: &Elastic,
    of_cells: &[StressState],
    (displacement, rotation): (&Vectors, Rotation),
) -> Vec<(usize, StressState)> {
    let (Some(edge), Some(cells)) = (engine.free_edge(), engine.cells()) else { return Vec::new() };
    let patches = Patches::new(edge, engine.body(), cells);
    // A body that has not moved yet bears nothing.
    let factor = if engine.has_moved() { engine.load_factor() } else { 0.0 };
    let turns: Option<Vec<f64>> = (rotation == Rotation::Corotated)
        .then(|| stress::turns(cells, 0..cells.count(), displacement).collect());
    let turn = |cell: u32| turns.as_ref().map_or(0.0, |turns| turns[cell as usize]);
    let fields: Vec<Fields> = std::iter::once(elastic).chain(&cells.inclusions).map(Fields::of).collect();
    let recover = |&i: &usize| {
        let patch = patches.of(i).ok()?;
        let point = engine.body().reference.get(i);
        let turned = patch.cells.iter().map(|&cell| turn(cell)).sum::<f64>() / patch.cells.len() as f64;
        let balancing = Balancing { point, force: turned_back(edge.body_force.map(|f| factor * f), turned) };
        let cells_here: Vec<CellStress> = patch
            .cells
            .iter()
            .map(|&cell| {
                let (centroid, stress) = (patches.centroids[&cell], of_cells[cell as usize].components);
                let off = balancing.at(centroid);
                let stress = std::array::from_fn(|c| stress[c] - off[c]);
                CellStress { centroid, area: area(cells.shape(cell as usize)), stress }
            })
            .collect();
        let tractions: Vec<KnownTraction> = patch
            .tractions
            .iter()
            .map(|&n| {
                let known = &edge.tractions[n as usize];
                let direction = turned_back(known.direction, turn(edge.cells[n as usize]));
                let [off_x, off_y, _] = balancing.at(known.point);
                let off = direction[0] * known.normal[0] * off_x + direction[1] * known.normal[1] * off_y;
                KnownTraction { value: factor * known.value - off, direction, ..*known }
            })
            .collect();
        let fields = &fields[patch.region as usize];
        let stress = stress_at((point, patches.spacing), fields, &cells_here, &tractions)?;
        Some((i, StressState::of_stress(stress, cells.material_of_region(patch.region, elastic))))
    };
    edge.particles.par_iter().filter_map(recover).collect()
}

/// A direction in axes that are turned by so much \[rad\].
fn turned_back([x, y]: [f64; 2], turn: f64) -> [f64; 2] {
    let (sin, cos) = turn.sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}

/// The stress that balances a body force \[force / length^3\] and is zero at a point \[length\].
struct Balancing {
    point: [f64; 2],
    force: [f64; 2],
}

impl Balancing {
    /// (xx, yy, xy) \[force / length^2\].
    fn at(&self, place: [f64; 2]) -> [f64; 3] {
        let [xx, yy] = [0, 1].map(|k| -self.force[k] * (place[k] - self.point[k]));
        [xx, yy, 0.0]
    }
}

/// Warnings about the stress at the outline of a body: where it is no more than the mean of its cells, and where the cells
/// cannot bend. `edge` is absent where the outline has no known tractions; `count` makes of numbers of this part of the body those
/// of the whole.
pub(super) fn cautions(
    edge: Option<&Edge>,
    (body, cells): (&Body, &Cells),
    count: impl Fn(usize) -> usize,
) -> Vec<String> {
    let Some(edge) = edge else {
        let outlined = body.outline.is_some();
        return Vec::from_iter(outlined.then(|| {
            "the outline has too many sides and pieces for stress to be recovered along it: there it is the mean of a \
             particle's cells, half a cell within the body"
                .to_owned()
        }));
    };
    let patches = Patches::new(edge, body, cells);
    let owned = body.owned();
    let own = edge.particles.par_iter().filter(|i| owned.contains(i));
    let found: Vec<Result<Patch, LeftOut>> = own.map(|&i| patches.of(i)).collect();
    let left_out =
        |why: LeftOut| count(found.iter().filter(|patch| patch.as_ref().is_err_and(|e| *e == why)).count());
    let one_row = found.iter().filter(|patch| patch.as_ref().is_ok_and(|patch| patch.is_one_row)).count();
    let one_row = count(one_row);
    let (interface, few) = (left_out(LeftOut::Interface), left_out(LeftOut::Few));
    let mut cautions = Vec::new();
    if interface > 0 {
        cautions.push(format!(
            "stress is not recovered at {interface} particles of the outline where materials meet: it has no single value \
             there, and what is given is the mean of the cells on the side where von Mises stress is larger"
        ));
    }
    if few > 0 {
        cautions.push(format!(
            "stress is not recovered at {few} particles of the outline, which see fewer than {FEWEST_CELLS} cells of their \
             own material: there it is the mean of a particle's cells, half a cell within the body; use a smaller spacing"
        ));
    }
    if one_row > 0 {
        cautions.push(format!(
            "the body, or one of its materials, is one cell thick at {one_row} particles of its outline: a cell has one \
             stress, so that of bending across the thickness does not show; use a smaller spacing (four cells and more)"
        ));
    }
    cautions
}
