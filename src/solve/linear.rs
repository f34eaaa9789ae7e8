//! A linear rule as an operator on displacements.
//!
//! Where a rule is linear in its neighbours' positions, a follower rests at `u_i = S_i sum_j W_ij u_j + c_i`.
//! Multiplied by what its neighbours' weights add up to, `D_i`, that is a row of `K u = f`: of a scalar rule
//! (Eq. 1) the graph Laplacian, of a material its stiffness. Frame points are no unknowns: a particle
//! that sees one sees the particles whose displacement it copies.

use super::equilibrium::System;
use super::operator::{Operator, OperatorError, Row};
use super::order::Order;
use crate::flock::block::{Block, IDENTITY, apply, plus, product};
use crate::flock::body::Body;
use crate::flock::lattice::Site;
use crate::flock::law::{Flock, Weights};
use crate::flock::rules::{Axis, Feedback, FeedbackReference, Rule};
use crate::flock::vectors::Vectors;

/// Why a rule has no operator.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotLinear {
    /// The mean weighs neighbours by where they are, or turns with them.
    #[error("{rule} is not linear in the neighbours' positions")]
    Rule {
        /// Name of the mean.
        rule: String,
    },
    /// A bond is broken.
    #[error("broken bonds make the rule depend on present positions")]
    Broken,
    /// The rows make no operator.
    #[error(transparent)]
    Operator(#[from] OperatorError),
}

/// A component of a particle that is held while the particle follows along the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldComponent {
    /// Index of the particle.
    pub particle: usize,
    /// The component that is held.
    pub axis: Axis,
    /// \[length\]
    pub displacement: f64,
}

/// The equilibrium that the rule asks for, with the held particles (those that do not follow) displaced
/// by `held` \[length\], shape \[count\]; what it holds for followers and frame points is not looked at; `components` are held of followers.
pub fn system(
    flock: &Flock,
    body: &Body,
    follows: Vec<bool>,
    mut held: Vectors,
    components: &[HeldComponent],
) -> Result<System, NotLinear> {
    require_linear(flock)?;
    let lattice = &body.lattice;
    let grid = [lattice.vector([1, 0]), lattice.vector([0, 1])];
    let linear = Linear { flock, body, served: served_by_frame(body) };
    let forces = (0..body.count()).map(|i| if follows[i] { linear.force(i) } else { [0.0; 2] }).collect();
    let mut held_axes = vec![[false; 2]; if components.is_empty() { 0 } else { body.count() }];
    for component in components.iter().filter(|component| follows[component.particle]) {
        let axis = component.axis as usize;
        held_axes[component.particle][axis] = true;
        let mut place = held.get(component.particle);
        place[axis] = component.displacement;
        held.set(component.particle, place);
    }
    let order = Order::new(body);
    let (sites, outliers) = order.sites();
    let (sites, follows) = ((&sites[..], outliers), order.by_place(follows));
    let operator = match &flock.weights {
        // The classes of a plain material are those of its rows.
        Weights::Matrix(weights) if linear.is_plain() => {
            let mut rows = vec![Row::default(); weights.compliance.len()];
            let mut known = vec![false; rows.len()];
            let class = order.by_place(weights.class.clone());
            for (place, &class) in class.iter().enumerate().filter(|(place, _)| follows[*place]) {
                if !std::mem::replace(&mut known[class as usize], true) {
                    rows[class as usize] = linear.row(order.particle(place));
                }
            }
            Operator::along_outline(sites, grid, class, rows, follows)
        }
        _ => {
            let row = |place: usize| linear.row(order.particle(place));
            Operator::from_rows_along_outline(sites, grid, follows, row)
        }
    };
    let operator = operator.map_err(|error| order.error(error))?;
    Ok(order.system(operator.with_held_axes(order.by_place(held_axes)), [forces, held]))
}

fn require_linear(flock: &Flock) -> Result<(), NotLinear> {
    let mean = flock.rule.mean;
    if !mean.is_affine() {
        return Err(NotLinear::Rule { rule: format!("the rule \"{mean}\"") });
    }
    let broken = flock.bonds.as_ref().is_some_and(|bonds| bonds.any_broken());
    if broken { Err(NotLinear::Broken) } else { Ok(()) }
}

/// The particles that each particle copies if it is a frame point, shape \[count\]; empty without a frame.
fn served_by_frame(body: &Body) -> Vec<Vec<u32>> {
    let Some(frame) = &body.frame else { return Vec::new() };
    let mut served = vec![Vec::new(); body.count()];
    for (k, &point) in frame.points.iter().enumerate() {
        served[point as usize] = frame.served_by(k).to_vec();
    }
    served
}

struct Linear<'a> {
    flock: &'a Flock,
    body: &'a Body,
    served: Vec<Vec<u32>>,
}

impl Linear<'_> {
    /// Whether rows are those of the weights alone.
    fn is_plain(&self) -> bool {
        let rule = &self.flock.rule;
        self.served.is_empty() && rule.poisson.is_none() && overshoot(rule) == 1.0
    }

    /// `K_ij` of bond number `k` of a particle.
    fn stiffness(&self, particle: usize, k: usize) -> Block {
        let scaled = |by: f64| IDENTITY.map(|row| row.map(|entry| by * entry));
        match &self.flock.weights {
            Weights::Equal => IDENTITY,
            Weights::Scalar(weights) => scaled(weights[self.flock.neighbours.bonds(particle).start + k]),
            Weights::Matrix(weights) => weights.stiffness_of(particle)[k],
        }
    }

    /// `D_i`.
    fn diagonal(&self, particle: usize) -> Block {
        let bonds = 0..self.flock.neighbours.of(particle).len();
        bonds.fold(Block::default(), |sum, k| plus(&sum, &self.stiffness(particle, k)))
    }

    fn row(&self, particle: usize) -> Row {
        let terms = self.terms(particle);
        let mut row = Row { diagonal: self.diagonal(particle), entries: Vec::new() };
        for (k, &j) in self.flock.neighbours.of(particle).iter().enumerate() {
            let block = product(&terms, &self.stiffness(particle, k));
            if self.body.is_frame[j as usize] {
                let served = &self.served[j as usize];
                let part = block.map(|row| row.map(|entry| entry / served.len() as f64));
                served.iter().for_each(|&s| self.pull(&mut row, particle, s as usize, &part));
            } else {
                self.pull(&mut row, particle, j as usize, &block);
            }
        }
        row
    }

    /// Adds what `other` pulls `particle` along with.
    fn pull(&self, row: &mut Row, particle: usize, other: usize, block: &Block) {
        if *block == Block::default() {
            return;
        }
        if other == particle {
            let less = block.map(|row| row.map(|entry| -entry));
            row.diagonal = plus(&row.diagonal, &less);
            return;
        }
        let (here, there) = (self.body.sites[particle], self.body.sites[other]);
        let offset: Site = [there[0] - here[0], there[1] - here[1]];
        match row.entries.iter_mut().find(|(known, _)| *known == offset) {
            Some((_, sum)) => *sum = plus(sum, block),
            None => row.entries.push((offset, *block)),
        }
    }

    /// The matrix by which the terms added to the mean multiply it: feedback on the initial position (Eq. 4) and the
    /// Poisson term (Eq. 2).
    fn terms(&self, particle: usize) -> Block {
        let rule = &self.flock.rule;
        let mut terms = IDENTITY;
        if let Some(poisson) = &rule.poisson {
            let response = poisson.k * poisson.distance_from_axis(self.body.reference.get(particle));
            match poisson.axis {
                Axis::X => terms[1][0] = response,
                Axis::Y => terms[0][1] = response,
            }
        }
        terms.map(|row| row.map(|entry| overshoot(rule) * entry))
    }

    /// `f_i`: the load, and what pulls where the reference is not at rest.
    fn force(&self, particle: usize) -> [f64; 2] {
        if let (Some(forces), true) = (&self.flock.forces, self.is_plain()) {
            return forces.get(particle);
        }
        let reference = &self.body.reference;
        // Over-relaxation does not move the place of rest.
        let target = if overshoot(&self.flock.rule) == 1.0 && self.flock.rule.feedback.is_some() {
            let rule = Rule { feedback: None, ..self.flock.rule };
            self.flock.target_by(&rule, particle, reference)
        } else {
            self.flock.target(particle, reference)
        };
        let here = reference.get(particle);
        apply(&self.diagonal(particle), [target[0] - here[0], target[1] - here[1]])
    }
}

/// Factor by which feedback stretches displacements from the initial position.
pub(crate) fn overshoot(rule: &Rule) -> f64 {
    match rule.feedback {
        Some(Feedback { factor, reference: FeedbackReference::Initial }) => 1.0 + factor,
        _ => 1.0,
    }
}
