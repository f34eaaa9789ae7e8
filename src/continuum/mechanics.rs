//! The readings of a testing machine on a body: reactions, load, strain energy, stress.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::engine::Engine;
use crate::engine::forces::{Forces, LoadResultant, Reaction};
use crate::engine::path::{Path, Work};
use crate::flock::rules::{Mean, Rotation};
use crate::flock::vectors::{Vectors, distance};
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::material::recovery::{CellStress, Fields, KnownTraction, REACH, stress_at};
use crate::material::stiffness::area;
use crate::material::stress::{self, StressState};

/// Strain beyond which small rotations and strains are a caution \[1\].
const SMALL_STRAIN: f64 = 0.1;
/// Turn of a cell beyond which they are \[rad\]: 10 degrees, whose cosine is off by 1.5 %.
const SMALL_TURN: f64 = std::f64::consts::PI / 18.0;

/// Forces, energy and stress of a body with a material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mechanics {
    /// Of each entry of `loads`; empty where the rule has no stiffness.
    pub loads: Vec<LoadResultant>,
    /// Of all loads together.
    pub load: Option<LoadResultant>,
    /// Of each entry of `roles` that holds particles; empty where the rule has no stiffness.
    pub reactions: Vec<Reaction>,
    /// \[force length\]
    pub strain_energy: f64,
    /// Absent where the rule has no stiffness.
    pub work: Option<Work>,
    /// Work done on the way, summed up from equilibrium to equilibrium ([`crate::engine::path`]): in a body that stores
    /// all of it the strain energy. Absent where there were none.
    pub work_done: Option<Work>,
    /// The largest force left on a follower \[force\]: how far the body is from rest.
    pub unbalanced: Option<f64>,
    /// Over the cells and the particles on free edges; none where no cell has a finite stress.
    pub largest_von_mises: Option<Peak>,
    /// The principal strain largest in size of any cell, as the rule measures strain \[1\].
    pub largest_strain: f64,
    /// The largest turn of a cell \[rad\].
    pub largest_turn: f64,
}

/// Where the largest von Mises stress is: in a cell, or at a particle on a free edge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// \[force / length^2\]
    pub von_mises: f64,
    /// Number of the cell, counted from 1; none for a particle.
    pub cell: Option<usize>,
    /// Middle of the cell, or the particle, in the reference configuration \[length\].
    pub place: [f64; 2],
    /// Ids of the particles at its corners, or of the particle.
    pub particles: Vec<usize>,
}

/// Stress of a body, cell by cell and around each particle.
#[derive(Clone, Debug)]
pub struct Stresses {
    /// NaN in cells across which a bond is broken, shape \[cells\].
    pub cells: Vec<StressState>,
    /// `None` for a particle in no whole cell, shape \[count\].
    pub particles: Vec<Option<StressState>>,
    /// Particles along a fitted outline whose stress is recovered from cells and known tractions
    /// ([`crate::material::recovery`]); that of the others is the mean of their cells.
    pub recovered: Vec<usize>,
}

impl Stresses {
    /// Under these displacements \[length\], these pairs of particles being parted; `None` without cells.
    pub fn of(
        engine: &Engine,
        elastic: &Elastic,
        displacement: &Vectors,
        broken: &[[u32; 2]],
    ) -> Option<Self> {
        let cells = engine.cells()?;
        let torn = torn(cells, displacement.len(), broken);
        let of_cells = of_whole_cells(engine, (cells, &torn), elastic, displacement);
        let mut particles =
            stress::at_particles(cells, elastic, &of_cells, displacement.len(), |cell| !torn[cell]);
        let recovered = match broken {
            [] => recovered(engine, elastic, &of_cells, displacement),
            _ => Vec::new(),
        };
        for &(i, stress) in &recovered {
            particles[i] = Some(stress);
        }
        let recovered = recovered.into_iter().map(|(i, _)| i).collect();
        Some(Self { cells: of_cells, particles, recovered })
    }

    /// Those of the cells alone, under the same; empty without cells.
    pub fn in_cells(
        engine: &Engine,
        elastic: &Elastic,
        displacement: &Vectors,
        broken: &[[u32; 2]],
    ) -> Vec<StressState> {
        let of = |cells| {
            let torn = torn(cells, displacement.len(), broken);
            of_whole_cells(engine, (cells, &torn), elastic, displacement)
        };
        engine.cells().map_or_else(Vec::new, of)
    }

    /// At the engine's present places.
    pub fn at_present(engine: &Engine, elastic: &Elastic) -> Option<Self> {
        let broken: Vec<[u32; 2]> = engine.breaks().iter().map(|one| one.pair).collect();
        Self::of(engine, elastic, &engine.displacements(), &broken)
    }

    fn peak(&self, engine: &Engine, cells: &Cells) -> Option<Peak> {
        let finite = self.cells.iter().enumerate().filter(|(_, stress)| stress.von_mises.is_finite());
        // The first of several.
        let higher = |best: Option<(usize, f64)>, (cell, stress): (usize, &StressState)| match best {
            Some((_, most)) if most >= stress.von_mises => best,
            _ => Some((cell, stress.von_mises)),
        };
        let (cell, von_mises) = finite.fold(None, higher)?;
        let known = self.recovered.iter().filter_map(|&i| Some((i, self.particles[i]?.von_mises)));
        let at_edge = known.reduce(|best, next| if next.1 > best.1 { next } else { best });
        if let Some((particle, von_mises)) = at_edge.filter(|(_, at_edge)| *at_edge > von_mises) {
            let place = engine.body().reference.get(particle);
            return Some(Peak { von_mises, cell: None, place, particles: vec![engine.body().id(particle)] });
        }
        let corners = cells.of(cell);
        let places: Vectors = corners.iter().map(|&i| engine.body().reference.get(i as usize)).collect();
        let particles = corners.iter().map(|&i| engine.body().id(i as usize)).collect();
        Some(Peak { von_mises, cell: Some(cell + 1), place: places.middle(), particles })
    }
}

/// The stress of each cell, NaN in those that are torn.
fn of_whole_cells(
    engine: &Engine,
    (cells, torn): (&Cells, &[bool]),
    elastic: &Elastic,
    displacement: &Vectors,
) -> Vec<StressState> {
    let mut of_cells = stress::of_cells(cells, elastic, displacement, rotation(engine));
    for (stress, _) in of_cells.iter_mut().zip(torn).filter(|(_, torn)| **torn) {
        *stress = StressState { strain: [f64::NAN; 3], components: [f64::NAN; 3], von_mises: f64::NAN };
    }
    of_cells
}

impl Mechanics {
    /// At the engine's present places; `None` without a material.
    pub fn of(engine: &Engine, elastic: &Elastic) -> Option<Self> {
        Self::under(&Stresses::at_present(engine, elastic)?, engine, elastic)
    }

    /// Where the stresses at the engine's present places are known already.
    pub fn under(stresses: &Stresses, engine: &Engine, elastic: &Elastic) -> Option<Self> {
        let cells = engine.cells()?;
        let forces = Forces::of(engine);
        let u = engine.displacements();
        let finite =
            |values: &mut dyn Iterator<Item = f64>| values.filter(|v| v.is_finite()).fold(0.0, f64::max);
        Some(Self {
            loads: forces.as_ref().map_or_else(Vec::new, |forces| forces.each_load(engine)),
            load: forces.as_ref().and_then(|forces| forces.load(engine)),
            reactions: forces.as_ref().map_or_else(Vec::new, |forces| forces.reactions(engine)),
            strain_energy: strain_energy(engine, elastic, forces.as_ref(), &u),
            work: forces.as_ref().map(|forces| Work {
                loads: forces.work_of_loads(),
                supports: forces.work_of_supports(engine),
            }),
            work_done: engine.path().map(Path::done),
            unbalanced: forces.as_ref().map(|forces| forces.largest_left(engine)),
            largest_von_mises: stresses.peak(engine, cells),
            largest_strain: finite(&mut stresses.cells.iter().map(StressState::largest_strain)),
            largest_turn: finite(&mut stress::turns(cells, &u).map(f64::abs)),
        })
    }

    /// Warnings about the result.
    pub fn cautions(&self, engine: &Engine) -> Vec<String> {
        let is_small = matches!(engine.flock().rule.mean, Mean::Material { rotation: Rotation::Small });
        let is_beyond = self.largest_strain > SMALL_STRAIN || self.largest_turn > SMALL_TURN;
        if !(is_small && is_beyond) {
            return Vec::new();
        }
        vec![format!(
            "strains of up to {:.0} % and turns of up to {:.0} degrees under rotation = \"small\", which is right for \
             small ones (10 %, 10 degrees): displacements and forces are proportional to the load, as they are no more \
             in a body that is bent so far; rotation = \"corotated\" follows the turns",
            100.0 * self.largest_strain,
            self.largest_turn.to_degrees()
        )]
    }
}

/// By the rule's own forces under small rotations, else from the cells.
fn strain_energy(engine: &Engine, elastic: &Elastic, forces: Option<&Forces>, u: &Vectors) -> f64 {
    if let (Some(forces), Rotation::Small) = (forces, rotation(engine)) {
        let work = forces.internal.iter().zip(u.iter()).map(|(f, u)| f[0] * u[0] + f[1] * u[1]);
        // Without the sign of a zero.
        return 0.0 - 0.5 * work.sum::<f64>();
    }
    let of_cells = engine.cells().map(|cells| stress::strain_energy(cells, elastic, u, rotation(engine)));
    of_cells.and_then(Result::ok).unwrap_or(f64::NAN)
}

/// Stress of the particles along a fitted outline, from the cells near them and the tractions that are known there.
/// Of a body that turns all of them are taken in axes that turn with it, in which a stress is in equilibrium but for terms of
/// the size of the strain.
fn recovered(
    engine: &Engine,
    elastic: &Elastic,
    of_cells: &[StressState],
    displacement: &Vectors,
) -> Vec<(usize, StressState)> {
    let (Some(edge), Some(cells)) = (engine.free_edge(), engine.cells()) else { return Vec::new() };
    let (body, factor) = (engine.body(), engine.load_factor());
    let lattice = &body.lattice;
    // The sites of a honeycomb are nearer to each other than its cells are wide.
    let spacing = lattice.spacing().max((lattice.cell_area() * lattice.sublattices() as f64).sqrt());
    let bucket = |p: [f64; 2]| p.map(|v| (v / (REACH * spacing)).floor() as i64);
    let mut cells_in: HashMap<[i64; 2], Vec<(u32, CellStress)>> = HashMap::new();
    let around = |[x, y]: [i64; 2]| (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| [x, y]));
    let near_edge: HashSet<[i64; 2]> =
        edge.particles.iter().flat_map(|&i| around(bucket(body.reference.get(i)))).collect();
    let centres = cells.centroids(&body.reference).enumerate();
    for (cell, centroid) in centres.filter(|&(_, centroid)| near_edge.contains(&bucket(centroid))) {
        let (area, stress) = (area(cells.shape(cell)), of_cells[cell].components);
        let region = cells.region_of(cell);
        cells_in.entry(bucket(centroid)).or_default().push((region, CellStress { centroid, area, stress }));
    }
    let mut tractions_in: HashMap<[i64; 2], Vec<KnownTraction>> = HashMap::new();
    let turns: Option<Vec<f64>> =
        (rotation(engine) == Rotation::Corotated).then(|| stress::turns(cells, displacement).collect());
    for (known, &cell) in edge.tractions.iter().zip(&edge.cells) {
        let (sin, cos) = turns.as_ref().map_or(0.0, |turns| turns[cell as usize]).sin_cos();
        let [x, y] = known.direction;
        let direction = [cos * x + sin * y, cos * y - sin * x];
        let known = KnownTraction { value: factor * known.value, direction, ..*known };
        tractions_in.entry(bucket(known.point)).or_default().push(known);
    }
    let fields: Vec<Fields> = std::iter::once(elastic).chain(&cells.inclusions).map(Fields::of).collect();
    let recover = |&i: &usize| {
        let point = body.reference.get(i);
        let near = |p: [f64; 2]| distance(p, point) < REACH * spacing;
        let around_here = around(bucket(point)).filter_map(|b| cells_in.get(&b)).flatten();
        let (regions, cells_here): (Vec<u32>, Vec<CellStress>) =
            around_here.filter(|(_, cell)| near(cell.centroid)).copied().unzip();
        // Across an interface no one field goes on.
        let region = *regions.first()?;
        if regions.iter().any(|&other| other != region) {
            return None;
        }
        let elastic = cells.material_of_region(region, elastic);
        let tractions: Vec<KnownTraction> = around(bucket(point))
            .filter_map(|b| tractions_in.get(&b))
            .flatten()
            .filter(|t| near(t.point))
            .copied()
            .collect();
        let stress = stress_at((point, spacing), &fields[region as usize], &cells_here, &tractions)?;
        Some((i, StressState::of_stress(stress, elastic)))
    };
    edge.particles.par_iter().filter_map(recover).collect()
}

/// Which turns of a cell are no strain.
fn rotation(engine: &Engine) -> Rotation {
    match engine.flock().rule.mean {
        Mean::Material { rotation } => rotation,
        _ => Rotation::Small,
    }
}

/// Whether two corners of each cell are parted.
fn torn(cells: &Cells, particles: usize, broken: &[[u32; 2]]) -> Vec<bool> {
    let mut torn = vec![false; cells.count()];
    if broken.is_empty() {
        return torn;
    }
    let incidence = cells.incidence(particles);
    for &[a, b] in broken {
        for &cell in incidence.of(a as usize).iter().filter(|&&cell| cells.of(cell as usize).contains(&b)) {
            torn[cell as usize] = true;
        }
    }
    torn
}
