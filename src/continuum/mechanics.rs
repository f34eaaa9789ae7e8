//! The readings of a testing machine on a body: reactions, load, strain energy, stress.

use serde::{Deserialize, Serialize};

use super::edge_stress::{self, recovered};
use super::pieces::CellNumbers;
use super::run::growth;
use crate::engine::Engine;
use crate::engine::actions::Stressed;
use crate::engine::forces::{Forces, LoadResultant, Reaction};
use crate::engine::path::{Path, Work};
use crate::flock::body::Body;
use crate::flock::rules::{Mean, Rotation};
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::elastic::Elastic;
use crate::material::stress::{self, AroundParticles, Over, StressState};

/// Part of the strain energy by which the work done on the way may differ from it.
const MISSED_WORK: f64 = 0.05;
/// Part of the loads that may be left on the followers of a body that is at rest \[1\].
const UNBALANCED: f64 = 0.01;
/// Strain of a body that has been unloaded again, but for rounding \[1\].
const UNSTRAINED: f64 = 1e-7;
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
    /// At a step that has been taken, under these displacements \[length\], these pairs of particles being parted; `None`
    /// without a material.
    pub fn of(engine: &Engine, step: usize, displacement: &Vectors, broken: &[[u32; 2]]) -> Option<Self> {
        Self::by(engine, &engine.stressed_at(step)?, displacement, broken)
    }

    fn by(engine: &Engine, by: &Stressed<'_>, displacement: &Vectors, broken: &[[u32; 2]]) -> Option<Self> {
        let of_cells = of_whole_cells(by, displacement, broken);
        let around = AroundParticles::new(by.cells, by.elastic, &of_cells, displacement.len());
        let mut particles = around.all_larger();
        let recovered = match broken {
            [] => recovered(engine.body(), by, &of_cells, displacement),
            _ => Vec::new(),
        };
        for &(i, stress) in &recovered {
            particles[i] = Some(stress);
        }
        let recovered = recovered.into_iter().map(|(i, _)| i).collect();
        Some(Self { cells: of_cells, particles, recovered })
    }

    /// Those of the cells alone, under the same; empty without a material.
    pub fn in_cells(
        engine: &Engine,
        step: usize,
        displacement: &Vectors,
        broken: &[[u32; 2]],
    ) -> Vec<StressState> {
        engine.stressed_at(step).map_or_else(Vec::new, |by| of_whole_cells(&by, displacement, broken))
    }

    /// At the engine's present places; of a scene without a material nothing is laid out to find that it has none.
    pub fn at_present(engine: &Engine) -> Option<Self> {
        engine.cells()?;
        Self::of(engine, engine.step(), &engine.displacements(), &parted(engine))
    }

    /// At present, under a part of displacements and loads alike.
    pub fn under_part(engine: &Engine, part: f64) -> Option<Self> {
        let by = engine.stressed_at(engine.step())?;
        let mut displacement = engine.displacements();
        displacement.x.iter_mut().chain(&mut displacement.y).for_each(|u| *u *= part);
        Self::by(engine, &Stressed { load: part * by.load, ..by }, &displacement, &parted(engine))
    }

    /// The von Mises stress around each particle at present \[force / length^2\], shape \[count\]: that of
    /// [`Stresses::particles`] where none is recovered, for a fraction of the time. NaN where there is none, empty without a
    /// material.
    pub fn von_mises_of_cells(engine: &Engine) -> Vec<f64> {
        let (Some(cells), Some(elastic)) = (engine.cells(), engine.elastic()) else { return Vec::new() };
        let displacement = engine.displacements();
        let of_cells = Self::in_cells(engine, engine.step(), &displacement, &parted(engine));
        AroundParticles::new(cells, elastic, &of_cells, displacement.len()).von_mises()
    }

    /// Of the whole body, if each part knows its own.
    fn peak(&self, engine: &Engine, cells: &Cells) -> Option<Peak> {
        let body = engine.body();
        let numbers = CellNumbers::of(body, cells, engine.parted());
        let cell = self.highest_cell(engine).map(|(cell, von_mises)| {
            let corners = cells.of(cell);
            let places: Vectors = corners.iter().map(|&i| body.reference.get(i as usize)).collect();
            let particles = corners.iter().map(|&i| body.id(i as usize)).collect();
            Peak { von_mises, cell: Some(numbers.number(cell) + 1), place: places.middle(), particles }
        });
        let edge = self.highest_recovered(body).map(|(particle, von_mises)| {
            let place = body.reference.get(particle);
            Peak { von_mises, cell: None, place, particles: vec![body.id(particle)] }
        });
        let [cell, edge] = [cell, edge].map(|own| highest_of_parts(engine, own));
        // Where no cell has a stress nothing is recovered.
        let cell = cell?;
        Some(edge.filter(|edge| edge.von_mises > cell.von_mises).unwrap_or(cell))
    }

    /// The first of several.
    fn highest_cell(&self, engine: &Engine) -> Option<(usize, f64)> {
        let own = engine.owned_cells().map(|cell| (cell, self.cells[cell].von_mises));
        let finite = own.filter(|(_, von_mises)| von_mises.is_finite());
        finite.reduce(|best, next| if next.1 > best.1 { next } else { best })
    }

    /// The same of particles.
    fn highest_recovered(&self, body: &Body) -> Option<(usize, f64)> {
        let owned = body.owned();
        let own = self.recovered.iter().filter(|i| owned.contains(i));
        let known = own.filter_map(|&i| Some((i, self.particles[i]?.von_mises)));
        let is_first = |a: usize, b: usize| body.index(a) < body.index(b);
        known.reduce(|best, next| {
            let is_higher = next.1 > best.1 || (next.1 == best.1 && is_first(next.0, best.0));
            if is_higher { next } else { best }
        })
    }
}

/// The highest of the peaks of all parts, if there is one: of several the first cell, or particle.
fn highest_of_parts(engine: &Engine, own: Option<Peak>) -> Option<Peak> {
    let Some(team) = engine.parted() else { return own };
    let is_first = |a: &Peak, b: &Peak| (a.cell, &a.particles) < (b.cell, &b.particles);
    team.gather_all(own.as_slice()).into_iter().reduce(|best, next| {
        let is_higher =
            next.von_mises > best.von_mises || (next.von_mises == best.von_mises && is_first(&next, &best));
        if is_higher { next } else { best }
    })
}

/// Pairs of particles of this part that are parted at present.
fn parted(engine: &Engine) -> Vec<[u32; 2]> {
    here(engine.body(), engine.breaks().iter().map(|one| one.pair))
}

/// Those of some pairs of particles of the whole body that this part has, by their numbers here.
pub(crate) fn here(body: &Body, pairs: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
    let here = |index: u32| Some(body.exact_particle(index as usize)? as u32);
    pairs.filter_map(|[one, other]| Some([here(one)?, here(other)?])).collect()
}

/// The stress of each cell, NaN in those that are torn.
fn of_whole_cells(by: &Stressed<'_>, displacement: &Vectors, broken: &[[u32; 2]]) -> Vec<StressState> {
    let torn = torn(by.cells, displacement.len(), broken);
    let mut of_cells = stress::of_cells(by.cells, by.elastic, displacement, by.rotation);
    for (stress, _) in of_cells.iter_mut().zip(torn).filter(|(_, torn)| *torn) {
        let components = [f64::NAN; 3];
        *stress = StressState { strain: components, components, across: f64::NAN, von_mises: f64::NAN };
    }
    of_cells
}

impl Mechanics {
    /// At the engine's present places; `None` without a material.
    pub fn of(engine: &Engine) -> Option<Self> {
        Self::under(&Stresses::at_present(engine)?, engine)
    }

    /// Where the stresses at the engine's present places are known already.
    pub fn under(stresses: &Stresses, engine: &Engine) -> Option<Self> {
        let (cells, elastic) = (engine.cells()?, engine.elastic()?);
        let forces = Forces::of(engine);
        let u = engine.displacements();
        let own = engine.owned_cells();
        let finite = |values: &mut dyn Iterator<Item = f64>| {
            let [largest] = engine.largest_of_parts([values.filter(|v| v.is_finite()).fold(0.0, f64::max)]);
            largest
        };
        Some(Self {
            loads: forces.as_ref().map_or_else(Vec::new, |forces| forces.each_load(engine)),
            load: forces.as_ref().and_then(|forces| forces.load(engine)),
            reactions: forces.as_ref().map_or_else(Vec::new, |forces| forces.reactions(engine)),
            strain_energy: strain_energy(engine, elastic, forces.as_ref(), &u),
            work: forces.as_ref().map(|forces| Work {
                loads: forces.work_of(&forces.loads, engine),
                supports: forces.work_of(&forces.supports(engine), engine),
            }),
            work_done: engine.path().map(Path::done),
            unbalanced: forces.as_ref().map(|forces| forces.largest_left(engine)),
            largest_von_mises: stresses.peak(engine, cells),
            largest_strain: finite(&mut own.clone().map(|cell| stresses.cells[cell].largest_strain())),
            largest_turn: finite(&mut stress::turns(cells, own, &u).map(f64::abs)),
        })
    }

    /// Warnings about the result.
    pub fn cautions(&self, engine: &Engine) -> Vec<String> {
        let mut cautions = Vec::new();
        let is_material = matches!(engine.flock().rule.mean, Mean::Material { .. });
        let is_strained = self.largest_strain > SMALL_STRAIN;
        match (growing(engine, self.largest_strain), rotation(engine)) {
            (Some(growing), _) => cautions.push(growing),
            (None, Rotation::Small) if is_material && (is_strained || self.largest_turn > SMALL_TURN) => {
                cautions.push(format!(
                    "strains of up to {} and turns of up to {:.0} degrees under rotation = \"small\", which is right \
                     for small ones (10 %, 10 degrees): displacements and forces are proportional to the load, as they are \
                     no more in a body that is bent so far; rotation = \"corotated\" follows the turns",
                    percent(self.largest_strain),
                    self.largest_turn.to_degrees()
                ));
            }
            (None, Rotation::Corotated) if is_material && is_strained => cautions.push(format!(
                "strains of up to {} under rotation = \"corotated\", which follows turns of any size but is right for \
                 small strains (10 %): stress stays proportional to strain, and forces act on undeformed lengths",
                percent(self.largest_strain)
            )),
            _ => {}
        }
        cautions.extend(self.missed_work(engine));
        if let Some((cells, elastic)) = engine.cells().zip(engine.elastic()).filter(|_| is_material) {
            cautions.extend(edge_stress::cautions(
                engine.free_edge(),
                (engine.body(), cells, elastic),
                |own| engine.count_of_parts(own),
            ));
        }
        cautions
    }

    /// The part of the loads, or without loads of the reactions, that the followers are not in balance with \[1\], if it is
    /// too much for a body at rest.
    pub fn short_of_rest(&self, engine: &Engine) -> Option<f64> {
        let forces = Forces::of(engine).filter(|_| self.largest_strain > UNSTRAINED)?;
        Some(forces.share_left(engine)).filter(|&left| left > UNBALANCED)
    }

    /// The trapezoid rule misses work where forces are not linear between two equilibria.
    fn missed_work(&self, engine: &Engine) -> Option<String> {
        let done = self.work_done.map(|work| work.loads + work.supports)?;
        let is_loaded = self.largest_strain > UNSTRAINED;
        let path = engine.path()?;
        // One that was only carried about has borne nothing but rounding.
        let unstrained =
            UNSTRAINED * engine.elastic()?.stiffness().diagonal().min() * engine.body().lattice.spacing();
        if !is_loaded && path.largest_force() <= unstrained {
            return None;
        }
        let of = if is_loaded { self.strain_energy } else { path.most() };
        // What solvers leave out of balance is no matter of the parts.
        let difference = (done - self.strain_energy).abs();
        let (missed, by_parts) = (difference / of, (difference - path.unbalanced()) / of);
        (by_parts > MISSED_WORK && by_parts.is_finite()).then(|| {
            let missed = percent(missed);
            let off = match is_loaded {
                true => format!("differs by {missed} from the strain energy, which holds"),
                false => format!("comes to {missed} of the most on it, and to zero in a body that gives it back"),
            };
            format!(
                "the work done on the way, summed up by the trapezoid rule from one equilibrium to the next, {off}: \
                 smaller parts (load_steps.increments or load_steps.schedule) mend it, unless the body snaps from one to another"
            )
        })
    }
}

/// A share in percent, which may be beyond all bounds.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 1e4 { format!("{percent:.0} %") } else { format!("{percent:.1e} %") }
}

/// By the rule's own forces under small rotations, else from the cells.
fn strain_energy(engine: &Engine, elastic: &Elastic, forces: Option<&Forces>, u: &Vectors) -> f64 {
    if let (Some(forces), Rotation::Small) = (forces, rotation(engine)) {
        // Without the sign of a zero.
        return 0.0 - 0.5 * forces.work_of(&forces.internal, engine);
    }
    let Some(cells) = engine.cells() else { return f64::NAN };
    let (body, whole) = (engine.body(), cells.count_whole());
    let sum = |own: &mut dyn Iterator<Item = (usize, f64)>| {
        engine.sum_over([-0.0], own.map(|(particle, own)| (particle, [own])))[0]
    };
    let sum_of_cells = |own: &mut dyn Iterator<Item = (usize, f64)>| {
        engine.sum_of_parts([-0.0], own.map(|(cell, own)| (body.cell_after_all(cell, whole), [own])))[0]
    };
    let over =
        Over { cells: cells.owned(body), particles: body.owned(), sum_of_cells: &sum_of_cells, sum: &sum };
    stress::strain_energy_over(cells, elastic, (u, rotation(engine)), &over).unwrap_or(f64::NAN)
}

/// The warning about a strained body whose sweep grows from step to step, if it does; found by all ranks together.
pub(crate) fn growing(engine: &Engine, strain: f64) -> Option<String> {
    let cause = (strain > SMALL_STRAIN).then(|| growth(engine)).flatten()?;
    Some(format!("strains of up to {}, and the sweep grows from step to step: {cause}", percent(strain)))
}

/// Which turns of a cell are no strain.
fn rotation(engine: &Engine) -> Rotation {
    engine.flock().rule.mean.rotation()
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
