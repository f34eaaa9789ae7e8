//! Whether two plans, or two files, are the same.

use std::collections::BTreeMap;
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
    hash.hash
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
    let Plan { setup, stop, probes, .. } = plan;
    let Setup { body, flock, update, present_radius, roles, changes, cuts, actions, ramp, .. } = setup;
    let owned = body.owned();
    // Goes through the particles of these numbers that belong to this rank, and through the ranks in their order; through those that
    // come after all others in the whole body at last.
    let each =
        |digest: &mut Fnv, numbers: Range<usize>, particle: &dyn Fn(usize) -> usize, work: Work<'_>| {
            let own = |n: &usize| owned.contains(&particle(*n));
            let place = |n: usize| body.index_after_all(particle(n));
            let Some(team) = team else { return numbers.for_each(|n| work(digest, n)) };
            [digest.hash] = team.chain([digest.hash], |[hash]| {
                let mut part = Fnv { hash, kept: None };
                numbers.clone().filter(own).filter(|&n| place(n).is_none()).for_each(|n| work(&mut part, n));
                [part.hash]
            });
            if !body.has_some_after_all() {
                return;
            }
            let mut later: Vec<u8> = Vec::new();
            for (n, place) in numbers.filter(own).filter_map(|n| Some((n, place(n)?))) {
                let mut kept = Fnv { kept: Some(Vec::new()), ..Fnv::default() };
                work(&mut kept, n);
                let kept = kept.kept.unwrap_or_default();
                later.extend([place as u64, kept.len() as u64].into_iter().flat_map(u64::to_le_bytes));
                later.extend(kept);
            }
            let all = team.each_bytes(&later);
            let mut sorted: BTreeMap<u64, &[u8]> = BTreeMap::new();
            for mut rest in all.iter().map(Vec::as_slice) {
                while let Some((head, after)) = rest.split_first_chunk::<16>() {
                    let [place, size] =
                        [0, 8].map(|k| u64::from_le_bytes(std::array::from_fn(|n| head[k + n])));
                    let (kept, after) = after.split_at(size as usize);
                    sorted.insert(place, kept);
                    rest = after;
                }
            }
            sorted.into_values().for_each(|kept| digest.bytes(kept));
        };
    let of_body = |digest: &mut Fnv, work: Work<'_>| each(digest, owned.clone(), &|i| i, work);
    of_body(&mut digest, &|digest, i| digest.numbers(&[body.reference.x[i]]));
    of_body(&mut digest, &|digest, i| digest.numbers(&[body.reference.y[i]]));
    digest.text(&format!("{update:?} {present_radius:?} {stop:?} {:?} {cuts:?}", flock.rule));
    of_body(&mut digest, &|digest, i| digest.text(roles[i].name()));
    digest.bytes(&0u32.to_le_bytes());
    let ends = bonds_until(setup, team);
    of_body(&mut digest, &|digest, i| digest.bytes(&(ends[i - owned.start] as u32).to_le_bytes()));
    drop(ends);
    let neighbours = &flock.neighbours;
    of_body(&mut digest, &|digest, i| {
        let seen = neighbours.of(i).iter().map(|&k| body.index(k as usize) as u32);
        seen.for_each(|index| digest.bytes(&index.to_le_bytes()));
    });
    let weights = |digest: &mut Fnv, weights: &Weights| match weights {
        Weights::Equal => {}
        Weights::Scalar(weights) => {
            of_body(digest, &|digest, i| digest.numbers(&weights[neighbours.bonds(i)]));
        }
        Weights::Matrix(weights) => {
            let classes = classes(weights);
            of_body(digest, &|digest, i| digest.bytes(&classes[weights.class[i] as usize].to_le_bytes()));
        }
    };
    weights(&mut digest, &flock.weights);
    let vectors = |digest: &mut Fnv, of: [&Option<Vectors>; 2]| {
        for component in of.into_iter().flatten().flat_map(|points| [&points.x, &points.y]) {
            of_body(digest, &|digest, i| digest.numbers(&[component[i]]));
        }
    };
    vectors(&mut digest, [&flock.forces, &flock.rest]);
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
        each(&mut digest, 0..particles.len(), &|which| particles[which], &|digest, which| {
            digest.bytes(&(body.index(particles[which]) as u64).to_le_bytes());
            digest.numbers(rows.get(which).map_or(&[][..], |row| &row[..]));
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
                vectors(&mut digest, [forces, rest]);
            }
        }
    }
    probes.iter().for_each(|&probe| digest.bytes(&(probe as u64).to_le_bytes()));
    if body.numbering.is_some() {
        // The files written so far have these ids, in this order.
        body.rows().for_each(|i| digest.bytes(&(body.id(i) as u64).to_le_bytes()));
    }
    digest.hash
}

/// What is added of a particle.
type Work<'a> = &'a dyn Fn(&mut Fnv, usize);

/// How many bonds the particles of the whole body have up to each of this rank's own, in the order of the whole.
fn bonds_until(setup: &Setup, team: Option<&Team>) -> Vec<u64> {
    let (body, neighbours) = (&setup.body, &setup.flock.neighbours);
    let bonds = |i: usize| neighbours.of(i).len() as u64;
    let is_later = |i: &usize| body.index_after_all(*i).is_some();
    let own: u64 = body.owned().filter(|i| !is_later(i)).map(bonds).sum();
    let counts = team.map_or_else(|| Vec::from([[own]]), |team| team.each([own]));
    let mut sum: u64 = counts.iter().take(team.map_or(0, Team::rank)).map(|[bonds]| bonds).sum();
    let later: Vec<_> = body.owned().filter(is_later).map(|i| (body.index(i), bonds(i))).collect();
    let later = team.map_or_else(Vec::new, |team| team.gather_all(&later));
    let mut later: BTreeMap<usize, u64> = later.into_iter().collect();
    let mut all: u64 = counts.iter().map(|[bonds]| bonds).sum();
    for until in later.values_mut() {
        all += *until;
        *until = all;
    }
    let until = |i: usize| match body.index_after_all(i) {
        Some(index) => later[&index],
        None => {
            sum += bonds(i);
            sum
        }
    };
    body.owned().map(until).collect()
}

/// A hash of what each class has: parts of a body number the classes each in its own way.
fn classes(weights: &MatrixWeights) -> Vec<u64> {
    let hash = |ends: &[u32]| {
        let mut row = Fnv::default();
        let blocks = &weights.blocks[ends[0] as usize..ends[1] as usize];
        blocks.iter().flatten().for_each(|numbers| row.numbers(numbers));
        row.hash
    };
    weights.starts.windows(2).map(hash).collect()
}

struct Fnv {
    hash: u64,
    /// The bytes instead, where they are to be added later.
    kept: Option<Vec<u8>>,
}

impl Default for Fnv {
    fn default() -> Self {
        Self { hash: 0xcbf2_9ce4_8422_2325, kept: None }
    }
}

impl Fnv {
    fn bytes(&mut self, bytes: &[u8]) {
        if let Some(kept) = &mut self.kept {
            kept.extend(bytes);
            return;
        }
        for &byte in bytes {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
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
