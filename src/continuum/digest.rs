//! Whether two plans, or two files, are the same.

use std::ops::Range;

use super::plan::Plan;
use crate::engine::setup::{Conduct, RoleChange, Setup};
use crate::flock::action::ActionKind;
use crate::flock::law::{MatrixWeights, Weights};
use crate::flock::motion::Motion;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;

/// FNV-1a hash of bytes (G. Fowler, L. C. Noll, K.-P. Vo): 64 bits, the same in every build, not secure against
/// forgery. The hashes of the standard library differ from version to version.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    let mut hash = Fnv::default();
    hash.bytes(bytes);
    hash.0
}

/// A fingerprint of everything in a plan that its run depends on, to distinguish plans: an FNV-1a hash, see [`fnv1a`].
pub fn digest(plan: &Plan) -> u64 {
    digest_of(plan, None)
}

/// The fingerprint of a plan of which each rank has a part, found by all of them together: that of the whole.
pub fn digest_of_parts(plan: &Plan, team: &Team) -> u64 {
    digest_of(plan, Some(team))
}

fn digest_of(plan: &Plan, team: Option<&Team>) -> u64 {
    let mut digest = Fnv::default();
    // Goes through the ranks in their order, as the particles do.
    let each = |digest: &mut Fnv, work: &dyn Fn(&mut Fnv)| match team {
        None => work(digest),
        Some(team) => {
            let add = |[hash]: [u64; 1]| {
                let mut part = Fnv(hash);
                work(&mut part);
                [part.0]
            };
            [digest.0] = team.chain([digest.0], add);
        }
    };
    let Plan { setup, stop, probes, .. } = plan;
    let Setup { body, flock, update, present_radius, roles, changes, cuts, actions, ramp, .. } = setup;
    let (owned, first) = (body.owned(), body.first());
    let starts = &flock.neighbours.starts;
    let bonds = starts[owned.start] as usize..starts[owned.end] as usize;
    each(&mut digest, &|digest| digest.numbers(&body.reference.x[owned.clone()]));
    each(&mut digest, &|digest| digest.numbers(&body.reference.y[owned.clone()]));
    digest.text(&format!("{update:?} {present_radius:?} {stop:?} {:?} {cuts:?}", flock.rule));
    each(&mut digest, &|digest| roles[owned.clone()].iter().for_each(|role| digest.text(role.name())));
    digest.bytes(&0u32.to_le_bytes());
    let own = bonds.len() as u64;
    let before = team.map_or(0, |team| team.each([own]).iter().take(team.rank()).map(|[bonds]| bonds).sum());
    let start = |start: u32| (u64::from(start) - bonds.start as u64 + before) as u32;
    let ends = &starts[owned.start + 1..owned.end + 1];
    each(&mut digest, &|digest| ends.iter().for_each(|&end| digest.bytes(&start(end).to_le_bytes())));
    let seen = |index: u32| (first + index as usize) as u32;
    let index = &flock.neighbours.index[bonds.clone()];
    each(&mut digest, &|digest| index.iter().for_each(|&index| digest.bytes(&seen(index).to_le_bytes())));
    let weights = |digest: &mut Fnv, weights: &Weights| match weights {
        Weights::Equal => {}
        Weights::Scalar(weights) => each(digest, &|digest| digest.numbers(&weights[bonds.clone()])),
        Weights::Matrix(weights) => each(digest, &|digest| digest.matrices(weights, owned.clone())),
    };
    weights(&mut digest, &flock.weights);
    for component in flock.forces.iter().chain(&flock.rest).flat_map(|points| [&points.x, &points.y]) {
        each(&mut digest, &|digest| digest.numbers(&component[owned.clone()]));
    }
    if let Some(ramp) = ramp {
        digest.text(&format!("ramp {ramp}"));
    }
    if let Some(bonds) = &flock.bonds {
        digest.text(&format!("{:?} {:?}", bonds.threshold, bonds.ghosts));
    }
    for change in changes {
        let RoleChange { particles, role, from, when, motion, .. } = change;
        let (rows, motion) = match motion {
            Some(Motion::Table { displacements, steps }) => (&displacements[..], format!("table {steps}")),
            motion => (&[][..], format!("{motion:?}")),
        };
        digest.text(&format!("{role:?} {from} {when:?} {motion}"));
        let is_own = |which: &usize| owned.contains(&particles[*which]);
        let own = (0..particles.len()).filter(is_own);
        each(&mut digest, &|digest| {
            for which in own.clone() {
                digest.bytes(&((first + particles[which]) as u64).to_le_bytes());
                digest.numbers(rows.get(which).map_or(&[][..], |row| &row[..]));
            }
        });
    }
    for action in actions {
        digest.text(&format!("action {}", action.at));
        match &action.what {
            ActionKind::Cut(cut) => digest.text(&format!("{cut:?}")),
            // Two bodies with other keys differ in what these make of the rule.
            ActionKind::Follow(conduct) => {
                let Conduct { rule, fracture, update, forces, rest, .. } = &**conduct;
                digest.text(&format!("{rule:?} {fracture:?} {update:?}"));
                weights(&mut digest, &conduct.weights);
                forces.iter().chain(rest).for_each(|points| digest.points(points));
            }
        }
    }
    probes.iter().for_each(|&probe| digest.bytes(&(probe as u64).to_le_bytes()));
    if body.numbering.is_some() {
        // The files written so far have these ids, in this order.
        body.rows().for_each(|i| digest.bytes(&(body.id(i) as u64).to_le_bytes()));
    }
    digest.0
}

struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    /// Of each of these particles what its class has: parts of a body number the classes each in its own way.
    fn matrices(&mut self, weights: &MatrixWeights, of: Range<usize>) {
        let hash = |ends: &[u32]| {
            let mut row = Fnv::default();
            let blocks = &weights.blocks[ends[0] as usize..ends[1] as usize];
            blocks.iter().flatten().for_each(|numbers| row.numbers(numbers));
            row.0
        };
        let classes: Vec<u64> = weights.starts.windows(2).map(hash).collect();
        weights.class[of].iter().for_each(|&class| self.bytes(&classes[class as usize].to_le_bytes()));
    }

    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// With its length, so that two texts are not one.
    fn text(&mut self, text: &str) {
        self.bytes(&(text.len() as u64).to_le_bytes());
        self.bytes(text.as_bytes());
    }

    fn numbers(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.bytes(&number.to_bits().to_le_bytes()));
    }

    fn points(&mut self, points: &Vectors) {
        self.numbers(&points.x);
        self.numbers(&points.y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_its_authors() {
        // Test vectors of draft-eastlake-fnv.
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
