//! The system to be solved, from which every solver starts.

use super::multigrid::transfer::Transfer;
use super::{SolveError, Solver, steps, windows};
use crate::flock::block::{apply, inverse};
use crate::flock::vectors::Vectors;
use crate::ranks::Team;
use crate::solve::operator::{HELD, Matrix, Operator, RowCoefficients, power_of_two};
use crate::solve::shared::{SystemPart, moved, of_each};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// A body's operator, the forces on it and where its held particles are.
#[derive(Clone, Debug)]
pub struct System {
    /// `K` over all particles, with the rows of the followers.
    pub operator: Operator,
    /// Force on each particle \[force\]; those on held ones change nothing. Shape \[count\].
    pub forces: Vectors,
    /// Displacement of each held particle \[length\]; that of followers is not looked at. Shape \[count\].
    pub held: Vectors,
    /// Whether its material hardly changes its volume: iterations are many then.
    pub is_nearly_incompressible: bool,
    asymmetric_pair: OnceLock<Option<[usize; 2]>>,
    /// The part of this rank, where each has some particles of the system.
    pub(crate) part: Option<SystemPart>,
    /// Particles that follow, of all ranks.
    followers: usize,
    /// Index in the body of each particle, where that has them in another order than a system, in which those along an outline come
    /// with their columns; shape \[count\].
    numbers: Option<Vec<u32>>,
}

impl System {
    /// `forces` \[force\] and `held` displacements \[length\] of shape \[count\] each.
    pub fn new(operator: Operator, forces: Vectors, held: Vectors) -> Self {
        let followers = operator.followers();
        let asymmetric_pair = OnceLock::new();
        Self {
            operator,
            forces,
            held,
            is_nearly_incompressible: false,
            asymmetric_pair,
            part: None,
            followers,
            numbers: None,
        }
    }

    /// The same of particles that have these indices in their body, all of it or a part.
    pub(crate) fn numbered(self, numbers: Option<Vec<u32>>) -> Self {
        Self { numbers, ..self }
    }

    /// The same as a part of a system of which the other ranks have the others; for all of them together. A particle that is there
    /// for those that this rank speaks for has the row that it has in the whole, if these lead to it.
    pub(crate) fn of_part(mut self, part: SystemPart) -> Self {
        let team = &part.team;
        let [largest] = team.largest([self.operator.largest_stiffness(part.owned.clone())]);
        self.operator = self.operator.scaled_to(largest).with_all_outliers(team, &part.owned);
        let own = self.operator.follows()[part.owned.clone()].iter().filter(|&&follows| follows).count();
        self.followers = team.sum([own as u64])[0] as usize;
        self.part = Some(part);
        self
    }

    /// Particles that follow.
    pub fn followers(&self) -> usize {
        self.followers
    }

    /// The particles that this rank speaks for; all of a whole system.
    pub(super) fn owned(&self) -> Range<usize> {
        self.part.as_ref().map_or(0..self.operator.count(), |part| part.owned.clone())
    }

    /// The index of a particle in the whole body.
    fn number(&self, particle: usize) -> usize {
        let first = self.part.as_ref().map_or(0, |part| part.first);
        self.numbers.as_ref().map_or(first + particle, |numbers| numbers[particle] as usize)
    }

    /// The first of what ranks find in their parts: particles by their number in the whole, and something more.
    pub(super) fn first_found(&self, own: Option<[usize; 2]>) -> Option<[usize; 2]> {
        let own = own.map(|[particle, more]| [self.number(particle), more]);
        self.part.as_ref().map_or(own, |part| part.first_found(own))
    }

    /// See [`Operator::asymmetric_pair`]; looked for once.
    pub fn asymmetric_pair(&self) -> Option<[usize; 2]> {
        let find = || {
            let own = self.operator.asymmetric_pair(self.owned());
            self.first_found(own.map(|[i, other]| [i, self.number(other)]))
        };
        *self.asymmetric_pair.get_or_init(find)
    }

    pub(super) fn check(&self) -> Result<(), SolveError> {
        let (forces, held, particles) = (self.forces.len(), self.held.len(), self.operator.count());
        if forces != particles || held != particles {
            return Err(SolveError::Shapes { forces, held, particles });
        }
        let given = [(&self.held, "displacement"), (&self.forces, "force")];
        let is_wrong = |i: usize| {
            let follows = usize::from(self.operator.follows()[i]);
            let is_finite = given[follows].0.get(i).iter().all(|value| value.is_finite());
            (!is_finite).then_some([i, follows])
        };
        match self.first_found(self.owned().find_map(is_wrong)) {
            Some([i, follows]) => Err(SolveError::NotFinite { what: given[follows].1, particle: i + 1 }),
            None => Ok(()),
        }
    }

    /// Displacements in the order that the body has its particles in; those of a part are in that.
    pub(super) fn in_body(&self, displacement: Vectors) -> Vectors {
        let Some(numbers) = self.numbers.as_ref().filter(|_| self.part.is_none()) else {
            return displacement;
        };
        let mut of_body = Vectors::zeros(displacement.len());
        numbers.iter().zip(displacement.iter()).for_each(|(&number, u)| of_body.set(number as usize, u));
        of_body
    }

    /// The same under other forces, in the order of the body \[force\], with held particles that stay.
    pub(crate) fn under(self, forces: &Vectors) -> Self {
        let by_place =
            |numbers: &Vec<u32>| numbers.iter().map(|&number| forces.get(number as usize)).collect();
        let numbers = self.numbers.as_ref().filter(|_| self.part.is_none());
        let forces = numbers.map_or_else(|| forces.clone(), by_place);
        Self { held: Vectors::zeros(forces.len()), forces, ..self }
    }

    /// The followers' displacements with those of the held particles.
    pub(super) fn with_held(&self, found: Vectors<f64>) -> Vectors {
        let mut displacement = Vectors { x: found.x, y: found.y };
        for i in 0..displacement.len() {
            let held = self.held.get(i);
            if !self.operator.follows()[i] {
                displacement.set(i, held);
                continue;
            }
            match self.operator.held_axes(i) {
                [false, false] => {}
                [x, y] => {
                    let found = displacement.get(i);
                    displacement
                        .set(i, [if x { held[0] } else { found[0] }, if y { held[1] } else { found[1] }]);
                }
            }
        }
        displacement
    }

    /// The known part of a particle's displacement \[length\]: zero in unknown components, `None` where all
    /// are unknown.
    fn held_part(&self, particle: usize) -> Option<[f64; 2]> {
        let held = self.held.get(particle);
        match (self.operator.follows()[particle], self.operator.held_axes(particle)) {
            (false, _) => Some(held),
            (true, [false, false]) => None,
            (true, [x, y]) => Some([if x { held[0] } else { 0.0 }, if y { held[1] } else { 0.0 }]),
        }
    }

    /// `f + K_FL u_L` for the followers, zero for the others and in held components.
    fn right_side(&self, matrix: &Matrix) -> Vectors<f64> {
        let operator = &self.operator;
        let mut right = Vectors { x: self.forces.x.clone(), y: self.forces.y.clone() };
        for (column, segment) in matrix.columns.iter() {
            for k in 0..segment.len as usize {
                let i = segment.start as usize + k;
                let class = operator.class[i];
                // Only rows that owe something to a held particle were given another class.
                if matrix.class[i] == class {
                    continue;
                }
                let row = operator.scaled_row(i);
                let site = [column, segment.row + matrix.columns.step() * k as i32];
                for (offset, block) in row.entries {
                    let Some(held) = self.held_part(operator.index_of(site, *offset)) else { continue };
                    let [x, y] = apply(block, held).map(|pull| pull * operator.stiffness);
                    right.x[i] += x;
                    right.y[i] += y;
                }
                let [x, y] = operator.held_axes(i);
                let Some(held) = self.held_part(i).filter(|_| x || y) else { continue };
                let [fx, fy] = apply(row.diagonal, held).map(|pull| pull * operator.stiffness);
                right.x[i] = if x { 0.0 } else { right.x[i] - fx };
                right.y[i] = if y { 0.0 } else { right.y[i] - fy };
            }
        }
        for (i, _) in matrix.class.iter().enumerate().filter(|(_, class)| **class == HELD) {
            (right.x[i], right.y[i]) = (0.0, 0.0);
        }
        right
    }
}

/// A system over its followers, its stiffness and its right-hand side each divided by a power of two that
/// brings them near 1: no square of a force or stiffness then over- or underflows, and no bit changes.
pub(super) struct Prepared {
    pub matrix: Matrix,
    /// Coarser grids that ranks share, where each of them has a window of all that is here.
    pub coarser: Vec<(Transfer, Arc<Matrix>)>,
    stencils: OnceLock<RowCoefficients<f64>>,
    /// Right-hand side \[1\], shape \[count\].
    pub right: Vectors<f64>,
    /// The same again, where it takes other ranks to find it anew.
    kept_right: Option<Vectors<f64>>,
    /// `|right|` \[1\].
    pub size: f64,
    /// The powers of two that a displacement has to be multiplied by, one after the other.
    pub scales: [f64; 2],
    /// Vectors from a site to that of the next column and of the next row, the longer about 1 \[1\].
    pub grid: [[f64; 2]; 2],
    /// Whether any two neighbours feel each other alike.
    pub symmetric: bool,
    /// The ranks that solve it together.
    pub team: Option<Team>,
}

impl Prepared {
    /// For a solver; what the ranks of a `team` share of it, each has a part of.
    pub fn new(system: &System, team: Option<&Team>, solver: Solver) -> Result<Self, SolveError> {
        let operator = &system.operator;
        if system.followers() == 0 {
            return Err(SolveError::NothingFollows);
        }
        let matrix = Matrix::of_followers(operator);
        if let Some([i, _]) = adrift(system, &matrix) {
            return Err(SolveError::Adrift { particle: i + 1 });
        }
        if let Some([i, _]) = system.first_found(loose(&matrix, system.owned()).map(|i| [i, 0])) {
            return Err(SolveError::Loose { particle: i + 1 });
        }
        let mut right = system.right_side(&matrix);
        let is_finite = |i: usize| right.get(i).iter().all(|f| f.is_finite());
        if let Some([i, _]) = system.first_found(system.owned().find(|&i| !is_finite(i)).map(|i| [i, 0])) {
            return Err(SolveError::NotFinite { what: "pull on the held neighbours", particle: i + 1 });
        }
        let owned = right.view().range(system.owned());
        let most = owned.x.iter().chain(owned.y).fold(0.0, |most: f64, f| most.max(f.abs()));
        let most = system.part.as_ref().map_or(most, |part| part.team.largest([most])[0]);
        let force = power_of_two([most].into_iter());
        right.x.iter_mut().chain(&mut right.y).for_each(|f| *f /= force);
        let symmetric = system.asymmetric_pair().is_none();
        let scales = [1.0 / operator.stiffness, force];
        let length = power_of_two(operator.grid.as_flattened().iter().copied());
        let grid = operator.grid.map(|vector| vector.map(|v| v / length));
        let team = team.cloned();
        let (coarser, stencils, kept_right) = (Vec::new(), OnceLock::new(), None);
        let mut prepared =
            Self { matrix, coarser, stencils, right, kept_right, size: 0.0, scales, grid, symmetric, team };
        prepared.share(system, solver);
        prepared.size = prepared.matrix.square(&prepared.right).sqrt();
        Ok(prepared)
    }

    /// Gives each rank what it needs of the system for a solver: a window, or of one that is not shared all.
    fn share(&mut self, system: &System, solver: Solver) {
        let is_shared = solver.is_shared();
        let of_whole = |team: &Team| SystemPart::of_whole(team, &self.matrix.columns);
        let of_whole = self.team.as_ref().filter(|_| is_shared).map(of_whole);
        let Some(part) = system.part.clone().or(of_whole) else { return };
        let matrix = std::mem::replace(&mut self.matrix, Matrix::nothing());
        (self.matrix, self.coarser) = match is_shared {
            true => windows::of_part(&part, matrix, (solver == Solver::Multigrid, self.grid)),
            false => (windows::whole_of_part(&part, matrix), Vec::new()),
        };
        let first = self.matrix.first();
        let wanted = of_each(&part.team, first..first + self.matrix.count());
        let owned = part.of_each(part.owned.clone());
        self.right = moved(&part.team, (&owned, &wanted), (&self.right, part.first));
        self.kept_right = Some(self.right.clone());
        self.team = Some(part.team);
    }

    /// The displacements of the particles that stand here in the system.
    pub fn in_system(&self, system: &System, found: Vectors<f64>) -> Vectors<f64> {
        let first = system.part.as_ref().map_or(0, |part| part.first);
        let here = first..first + system.operator.count();
        let (Some(team), Some(window)) = (&self.team, &self.matrix.window) else {
            let Some(_) = system.part else { return found };
            return Vectors { x: found.x[here.clone()].to_vec(), y: found.y[here].to_vec() };
        };
        let cuts = &self.matrix.part.as_ref().expect("a window is a part").cuts;
        let owned: Vec<_> = (0..team.count()).map(|rank| cuts.particles_of(rank)).collect();
        moved(team, (&owned, &of_each(team, here)), (&found, window.first))
    }

    /// The rows as the passes of an iteration read them.
    pub fn stencils(&self) -> &RowCoefficients<f64> {
        self.stencils.get_or_init(|| RowCoefficients::new(&self.matrix, 1.0))
    }

    /// `|f - K u| / |f|` of these displacements, which is not what an iteration that never looks back takes
    /// it for.
    pub fn residual(&self, system: &System, found: &Vectors<f64>) -> f64 {
        let right = self.scaled_right(system);
        let mut r = Vectors::zeros(right.len());
        steps::residual(&self.matrix, self.stencils(), (found, &right), &mut r).sqrt() / self.size
    }

    /// The right-hand side anew, for solvers use it up \[1\].
    pub fn scaled_right(&self, system: &System) -> Vectors<f64> {
        if let Some(right) = &self.kept_right {
            return right.clone();
        }
        let mut right = system.right_side(&self.matrix);
        right.x.iter_mut().chain(&mut right.y).for_each(|f| *f /= self.scales[1]);
        right
    }

    /// Displacements \[length\] from those of the scaled system.
    pub fn unscaled(&self, mut found: Vectors<f64>) -> Vectors<f64> {
        let [first, second] = self.scales;
        found.x.iter_mut().chain(&mut found.y).for_each(|u| *u = *u * first * second);
        found
    }
}

/// See [`Operator::adrift`].
fn adrift(system: &System, matrix: &Matrix) -> Option<[usize; 2]> {
    let operator = &system.operator;
    let found = match &system.part {
        None => operator.adrift(matrix),
        Some(part) => operator.adrift_of_part(matrix, part),
    };
    system.first_found(found.map(|i| [i, 0]))
}

/// The first of these particles, counted from 0, that its own row does not hold back.
fn loose(matrix: &Matrix, mut of: Range<usize>) -> Option<usize> {
    let loose: Vec<bool> = matrix.rows.iter().map(|row| inverse(row.diagonal).is_none()).collect();
    // A class whose every particle has a held neighbour was replaced by others, and has no particles left.
    let any = loose.contains(&true);
    let is_loose = |i: &usize| matrix.class[*i] != HELD && loose[matrix.class[*i] as usize];
    if any { of.find(is_loose) } else { None }
}
