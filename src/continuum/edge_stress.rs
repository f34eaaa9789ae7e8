//! Stress of the particles along a fitted outline, from the cells near them and the tractions that are known there.
//!
//! A field of the recovery ([`crate::material::recovery`]) goes on in one material and without body force alone. So each
//! particle is given the cells of its own material that hang together with its own, as across no slot and no line of forces, and that no other
//! material hides from it, with the tractions on their sides;
//! and of a body force that part of the stress is taken off which balances it, `-b_x (x - x_0)` and `-b_y (y - y_0)`
//! about the particle: linear, hence compatible in every material, and zero where the result is wanted.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::report::THIN;
use crate::engine::actions::Stressed;
use crate::flock::body::Body;
use crate::flock::rules::Rotation;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::{area, dot};
use crate::geometry::shape::is_in_polygon;
use crate::material::cells::{Cells, Incidence};
use crate::material::elastic::Elastic;
use crate::material::free_edge::{Edge, FEWEST_LOADED};
use crate::material::recovery::{CellStress, FEWEST_CELLS, Fields, KnownTraction, REACH, stress_at};
use crate::material::stress::{self, StressState};
use crate::scene::text::counted;

/// Steps of a line of sight \[spacings\].
const SIGHT: f64 = 0.25;

/// Cosine of the angle between the outward normals of two sides of a thin body: at least 135 degrees.
const OPPOSITE: f64 = -0.7;

/// The same where the sides meet at a corner: a needle of 18 degrees is thin, a corner of 30 has an end at any spacing.
const NEEDLE: f64 = -0.95;

/// Radius of a hollow from which on the fields follow its stress \[spacings\], and a bit less; measured, it grows with the square of
/// the material's steepness.
const HOLLOW: f64 = 7.5;

/// Steepness ([`Elastic::steepness`]) from which on a material counts as one with fibres \[1\].
const STEEP: f64 = 1.2;

/// Cells and sides of one material around a particle.
struct Patch {
    region: u32,
    cells: Vec<u32>,
    /// Numbers of known tractions.
    tractions: Vec<u32>,
}

/// Why a particle's stress is the mean of its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LeftOut {
    /// Cells of several materials meet there, and stress has no single value.
    Interface,
    /// A line of forces ends there, at which stress jumps.
    Line,
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
        // Along rows, middles of sides stand at just this distance: rounding is not to say which count.
        let near = |p: [f64; 2]| distance(p, point) < REACH * self.spacing * (1.0 - 1e-9);
        let buckets = || around(self.bucket(point));
        let all: Vec<u32> = buckets()
            .filter_map(|b| self.cells_in.get(&b))
            .flatten()
            .copied()
            .filter(|cell| near(self.centroids[cell]))
            .collect();
        let of_region = |cell: u32| self.cells.region_of(cell as usize) == region;
        let is_mixed = !all.iter().all(|&cell| of_region(cell));
        let reached = self.reached(particle, &all);
        if self.incidence.of(particle).iter().any(|cell| !reached.contains(cell)) {
            return Err(LeftOut::Line);
        }
        let is_seen = |cell: u32| !is_mixed || (of_region(cell) && self.sees(point, cell, &all));
        let is_apart = reached.len() < all.len();
        let cells: Vec<u32> = all
            .iter()
            .copied()
            .filter(|cell| is_seen(*cell) && (!is_apart || reached.contains(cell)))
            .collect();
        if cells.len() < FEWEST_CELLS {
            return Err(LeftOut::Few);
        }
        let acts_here = |&n: &u32| {
            let (known, cell) = (&self.edge.tractions[n as usize], self.edge.cells[n as usize]);
            near(known.point) && (!(is_mixed || is_apart) || cells.contains(&cell))
        };
        let tractions = buckets()
            .filter_map(|b| self.tractions_in.get(&b))
            .flatten()
            .copied()
            .filter(acts_here)
            .collect();
        Ok(Patch { region, cells, tractions })
    }

    /// Those of the cells that hang together with the first of the particle's own, from corner to corner: stress goes through no slot, and jumps
    /// where particles in line are pushed.
    fn reached(&self, particle: usize, all: &[u32]) -> Vec<u32> {
        let first = self.incidence.of(particle).first();
        let (mut reached, mut left): (Vec<u32>, Vec<u32>) = all.iter().partition(|&cell| Some(cell) == first);
        let mut next = 0;
        while next < reached.len() && !left.is_empty() {
            let corners = self.cells.of(reached[next] as usize);
            let is_pushed = |i: &u32| self.edge.pushed[*i as usize];
            let is_among_pushed = corners.iter().all(is_pushed);
            let touches = |cell: &u32| {
                let others = self.cells.of(*cell as usize);
                // Those within pushed ones are on no line.
                let passes = is_among_pushed || others.iter().all(is_pushed);
                others.iter().any(|i| corners.contains(i) && (passes || !is_pushed(i)))
            };
            reached.extend(left.extract_if(.., |cell| touches(cell)));
            next += 1;
        }
        reached
    }

    /// Whether the body, or its material, ends again within two cells behind its edge at a particle, and not at a corner.
    fn is_thin(&self, particle: usize, patch: &Patch) -> bool {
        let point = self.reference.get(particle);
        let Some(here) = self.nearest_traction(patch, point) else { return false };
        let normal = self.edge.tractions[here].normal;
        let is_within = |at: [f64; 2]| patch.cells.iter().any(|&cell| self.is_in(cell, at));
        let steps = (THIN / SIGHT).ceil() as usize;
        let behind = |k: usize| {
            let far = THIN * self.spacing * k as f64 / steps as f64;
            [0, 1].map(|axis| point[axis] - far * normal[axis])
        };
        // The first steps may pass beside the particle's own cells, where the outline is bent.
        let Some(end) = (2..=steps).map(behind).find(|&at| !is_within(at)) else { return false };
        let mut near = around(self.bucket(end)).filter_map(|b| self.cells_in.get(&b)).flatten();
        let is_in_another = near.any(|&cell| self.is_in(cell, end));
        let is_there = |n: &usize| distance(self.edge.tractions[*n].point, end) < self.spacing;
        let beyond = self.nearest_traction(patch, end).filter(is_there);
        is_in_another || beyond.is_some_and(|beyond| self.are_opposite(here, beyond))
    }

    /// Whether the outline at two known tractions has a thin body between, and no mere corner.
    fn are_opposite(&self, a: usize, b: usize) -> bool {
        let cosine = dot(self.edge.tractions[a].normal, self.edge.tractions[b].normal);
        let meet = match [a, b].map(|n| self.edge.straights[n]) {
            [Some(a), Some(b)] => a[0] == b[1] || a[1] == b[0],
            _ => false,
        };
        cosine < if meet { NEEDLE } else { OPPOSITE }
    }

    fn is_in(&self, cell: u32, at: [f64; 2]) -> bool {
        let corners = self.cells.of(cell as usize).iter().map(|&i| self.reference.get(i as usize));
        is_in_polygon(&corners.collect::<Vec<_>>(), at)
    }

    /// Number of the known traction of a patch that is nearest to a point.
    fn nearest_traction(&self, patch: &Patch, point: [f64; 2]) -> Option<usize> {
        let apart = |n: usize| distance(self.edge.tractions[n].point, point);
        let known = patch.tractions.iter().map(|&n| n as usize);
        known.min_by(|&a, &b| apart(a).total_cmp(&apart(b)))
    }

    /// Whether the edge at a particle is bent as by a hole of a radius below so many spacings; a sharp corner, where stress has no
    /// largest value at any spacing, is none.
    fn is_in_hollow(&self, particle: usize, patch: &Patch, radius: f64) -> bool {
        let here = self.nearest_traction(patch, self.reference.get(particle));
        here.is_some_and(|here| self.edge.hollows[here] * radius * self.spacing > 1.0)
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
}

/// A bucket and those around it.
fn around([x, y]: [i64; 2]) -> impl Iterator<Item = [i64; 2]> {
    (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| [x, y]))
}

/// The particles whose stress is recovered from that of the cells, and it. Of a body that turns all of it is taken in axes
/// that turn with it, in which a stress is in equilibrium but for terms of the size of the strain.
pub(super) fn recovered(
    body: &Body,
    &Stressed { cells, elastic, rotation, edge, load }: &Stressed<'_>,
    of_cells: &[StressState],
    displacement: &Vectors,
) -> Vec<(usize, StressState)> {
    let Some(edge) = edge else { return Vec::new() };
    let patches = Patches::new(edge, body, cells);
    let turns: Option<Vec<f64>> = (rotation == Rotation::Corotated)
        .then(|| stress::turns(cells, 0..cells.count(), displacement).collect());
    let turn = |cell: u32| turns.as_ref().map_or(0.0, |turns| turns[cell as usize]);
    let fields: Vec<Fields> = std::iter::once(elastic).chain(&cells.inclusions).map(Fields::of).collect();
    let recover = |&i: &usize| {
        let patch = patches.of(i).ok()?;
        let point = body.reference.get(i);
        let turned = patch.cells.iter().map(|&cell| turn(cell)).sum::<f64>() / patch.cells.len() as f64;
        let balancing = Balancing { point, force: turned_back(edge.body_force.map(|f| load * f), turned) };
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
                KnownTraction { value: load * known.value - off, direction, ..*known }
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
    (body, cells, elastic): (&Body, &Cells, &Elastic),
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
    let found: Vec<(usize, Result<Patch, LeftOut>)> = own.map(|&i| (i, patches.of(i))).collect();
    let left_out = |why: LeftOut| {
        count(found.iter().filter(|(_, patch)| patch.as_ref().is_err_and(|e| *e == why)).count())
    };
    let known = || found.iter().filter_map(|(i, patch)| Some((*i, patch.as_ref().ok()?)));
    let thin = count(known().filter(|(i, patch)| patches.is_thin(*i, patch)).count());
    let steepness = |region: u32| cells.material_of_region(region, elastic).steepness();
    let in_hollows = |is_steep: bool| {
        let is_one = |(i, patch): &(usize, &Patch)| {
            let steepness = steepness(patch.region);
            let radius = HOLLOW * if is_steep { steepness * steepness } else { 1.0 };
            (steepness > STEEP) == is_steep && patches.is_in_hollow(*i, patch, radius)
        };
        count(known().filter(is_one).count())
    };
    let [hollow, steep] = [false, true].map(in_hollows);
    let [interface, line, few] = [LeftOut::Interface, LeftOut::Line, LeftOut::Few].map(left_out);
    let mut cautions = Vec::new();
    if edge.narrow > 0 {
        cautions.push(format!(
            "{} on less than {FEWEST_LOADED:.0} spacings of an edge: stress is much too low there, as under a wider one; use a \
             smaller spacing",
            counted(edge.narrow, "load")
        ));
    }
    if interface > 0 {
        cautions.push(format!(
            "stress is not recovered at {interface} particles of the outline where materials meet: it has no single value \
             there, and what is given is the mean of the cells on the side where von Mises stress is larger"
        ));
    }
    if line > 0 {
        cautions.push(format!(
            "stress is not recovered at {line} particles of the outline where lines of forces end: it jumps there, and what is \
             given is the mean of the cells on both sides"
        ));
    }
    if few > 0 {
        cautions.push(format!(
            "stress is not recovered at {few} particles of the outline, which see fewer than {FEWEST_CELLS} cells of their \
             own material: there it is the mean of a particle's cells, half a cell within the body; use a smaller spacing"
        ));
    }
    if thin > 0 {
        cautions.push(format!(
            "the body, or one of its materials, is one or two cells thick at {thin} particles of its outline: a cell has one \
             stress, so that of bending across the thickness does not show; use a smaller spacing (four cells and more)"
        ));
    }
    if hollow > 0 {
        cautions.push(format!(
            "stress is too low at {hollow} particles along hollows that are narrow for the spacing, holes above all; use a \
             spacing of at most an eighth of their radius, on a honeycomb a thirteenth"
        ));
    }
    if steep > 0 {
        let steepest = (0..=cells.inclusions.len() as u32).map(steepness).fold(1.0, f64::max);
        cautions.push(format!(
            "stress is off by a tenth or more, either way, at {steep} particles along hollows of a material with fibres, where it \
             changes up to {steepest:.1} times as fast as without them; use a spacing of at most 1/{:.0} of their radius",
            8.0 * steepest * steepest
        ));
    }
    cautions
}
