//! The bodies that are swept, and the ways to do it.

use super::super::grid::stirred;
use super::super::machine::seconds_each;
use crate::flock::block::Block;
use crate::flock::fracture::{Bonds, Ghosts, Threshold};
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::law::{Flock, MatrixWeights, Weights};
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::numbering::order_in_columns;
use crate::flock::role::Role;
use crate::flock::rules::Rule;
use crate::flock::vectors::Vectors;
use crate::sweep::{Activity, Led, MOST_STEPS, Sweep, Update};

pub const LOOP: &str = "a plain compiled loop";
pub const PLAIN: &str = "barycentre, 4 neighbours";
pub const EIGHT: &str = "barycentre, 8 neighbours";
pub const MATERIAL: &str = "material, 8 neighbours";
pub const INTACT: &str = "fracture on, intact";
pub const CRACKED: &str = "fracture on, cracked";
const SPATIAL: &str = "lists of a hexagonal lattice";
const RANDOM: &str = "the same in random order";
const RENUMBERED: &str = "the same renumbered in columns";

/// Bytes that one update moves when no cache holds the body: `x` and `y`, each read, written and
/// fetched for writing.
const BYTES_PER_UPDATE: f64 = 48.0;

/// Bytes of the lists of one particle with six neighbours: where they begin, and six indices.
const BYTES_PER_LIST: f64 = 28.0;

/// Of the bonds of the cracked body, the share that is broken.
const CRACKS_EVERY: usize = 12;

/// A body and a way to sweep it.
pub struct Subject {
    pub name: &'static str,
    pub side: usize,
    pub steps_together: usize,
    pub followers: usize,
    pub bonds_watched: usize,
    pub bytes_per_update: f64,
    /// Whether more threads than one are worth measuring.
    pub is_shared: bool,
    /// Takes so many steps.
    step: Box<dyn FnMut(usize) + Send>,
}

impl Subject {
    /// A plain body of one step at a time, by one thread, with so many followers.
    fn new(
        name: &'static str,
        side: usize,
        followers: usize,
        step: impl FnMut(usize) + Send + 'static,
    ) -> Self {
        Self {
            name,
            side,
            steps_together: 1,
            followers,
            bonds_watched: 0,
            bytes_per_update: BYTES_PER_UPDATE,
            is_shared: false,
            step: Box::new(step),
        }
    }

    /// A small body's step is too short for the clock: as many as fill the time.
    pub fn steps_in(&mut self, seconds: f64) -> usize {
        self.time(self.steps_together);
        let steps = (seconds / self.time(2 * self.steps_together)).clamp(1.0, 1e7) as usize;
        steps.next_multiple_of(self.steps_together)
    }

    /// Seconds per step over some steps.
    pub fn time(&mut self, steps: usize) -> f64 {
        seconds_each(steps, || (self.step)(steps))
    }
}

type Make = Box<dyn FnOnce() -> Subject>;

/// All subjects, each made when its turn comes: the large ones do not fit into memory together.
pub fn all(sides: &[usize], other: usize) -> Vec<Make> {
    let mut all: Vec<Make> = Vec::new();
    for &side in sides {
        all.push(Box::new(move || plain_loop(side)));
        all.push(Box::new(move || square(side, 1)));
        all.push(Box::new(move || square(side, MOST_STEPS)));
    }
    all.push(Box::new(move || {
        let body = Body::square(other, &Neighbourhood::Chebyshev { radius: 1 });
        body.subject(EIGHT, BYTES_PER_UPDATE, 1)
    }));
    all.push(Box::new(move || material(other)));
    all.push(Box::new(move || fracture(other, false)));
    all.push(Box::new(move || fracture(other, true)));
    for order in [SPATIAL, RANDOM, RENUMBERED] {
        all.push(Box::new(move || lists(other, order)));
    }
    all
}

struct Body {
    side: usize,
    flock: Flock,
    roles: Vec<Role>,
    present: Vectors,
}

impl Body {
    /// A square body whose outermost particles are held, in the numbering and with the neighbours' order that a scene
    /// would give; only the lists are made directly, a body of this many sites being slow to cut.
    fn square(side: usize, neighbourhood: &Neighbourhood) -> Self {
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let offsets = neighbourhood.offsets(&lattice).expect("the square lattice has these");
        let sites = || (0..side).flat_map(|column| (0..side).map(move |row| (column, row)));
        let inner = 1..side - 1;
        let follows = |(column, row)| inner.contains(&column) && inner.contains(&row);
        let offsets = offsets[0].iter().map(|&[i, j]| i as isize * side as isize + j as isize);
        let neighbours = Neighbours::from_lists(sites().enumerate().map(|(particle, site)| {
            let seen = if follows(site) { usize::MAX } else { 0 };
            offsets.clone().take(seen).map(move |offset| particle.wrapping_add_signed(offset) as u32)
        }));
        let roles = sites().map(|site| if follows(site) { Role::Follower } else { Role::Clamped }).collect();
        let reference: Vectors = sites().map(|(i, j)| lattice.position([i as i32, j as i32])).collect();
        Self::new(side, reference, neighbours, roles)
    }

    fn new(side: usize, reference: Vectors, neighbours: Neighbours, roles: Vec<Role>) -> Self {
        let present = stirred(&reference).collect();
        let (rule, weights, reference) = (Rule::BARYCENTRE, Weights::Equal, reference.into());
        let flock = Flock::new(rule, reference, neighbours, weights);
        Self { side, flock, roles, present }
    }

    fn sweep(&self, update: Update) -> Sweep {
        Sweep::compile(update, &self.flock, &self.roles)
    }

    fn subject(self, name: &'static str, bytes_per_update: f64, steps_together: usize) -> Subject {
        let sweep = self.sweep(Update::default());
        let followers = sweep.followers();
        let Self { side, flock, mut present, .. } = self;
        let mut next = present.clone();
        let step = move |steps: usize| {
            let mut to_go = steps;
            while to_go > 0 {
                if steps_together == 1 {
                    sweep.step(&flock, None, &present, &mut next);
                    std::mem::swap(&mut present, &mut next);
                    to_go -= 1;
                } else {
                    let count = to_go.min(steps_together);
                    let whole = &mut Activity::default();
                    sweep.steps(&flock, None, (&mut present, &mut next), (count, Led::NONE, None), whole);
                    to_go -= count;
                }
            }
        };
        let subject = Subject::new(name, side, followers, step);
        Subject { steps_together, bytes_per_update, is_shared: true, ..subject }
    }
}

const FIRST: Neighbourhood = Neighbourhood::First { keep: None };

fn square(side: usize, steps_together: usize) -> Subject {
    Body::square(side, &FIRST).subject(PLAIN, BYTES_PER_UPDATE, steps_together)
}

/// The plain loop, written without regard to caches: for each column, for each row.
fn plain_loop(side: usize) -> Subject {
    let Vectors { x, y } = Body::square(side, &FIRST).present;
    let mut present = [x, y];
    let mut next = present.clone();
    let step = move |steps: usize| {
        for _ in 0..steps {
            for (present, next) in present.iter().zip(&mut next) {
                for column in 1..side - 1 {
                    let begin = column * side;
                    for i in begin + 1..begin + side - 1 {
                        let sum = present[i - side] + present[i - 1] + present[i + 1] + present[i + side];
                        next[i] = 0.25 * sum;
                    }
                }
            }
            std::mem::swap(&mut present, &mut next);
        }
    };
    Subject::new(LOOP, side, (side - 2).pow(2), step)
}

/// Matrices that take every place to the barycentre's, but have to be multiplied out.
fn material(side: usize) -> Subject {
    let mut body = Body::square(side, &Neighbourhood::Chebyshev { radius: 1 });
    let blocks: Vec<Block> =
        (0..8).map(|k| f64::from(k % 2) - 0.5).map(|s| [[0.125, 0.01 * s], [0.01 * s, 0.125]]).collect();
    body.flock.rule = Rule::MATERIAL;
    body.flock.weights = Weights::Matrix(MatrixWeights {
        class: body.roles.iter().map(|&role| u32::from(role == Role::Follower)).collect(),
        starts: vec![0, 0, 8],
        stiffness: blocks.clone(),
        blocks,
        compliance: vec![[[1.0, 0.0], [0.0, 1.0]]; 2],
        cells: None,
    });
    body.subject(MATERIAL, BYTES_PER_UPDATE, 1)
}

/// Bonds are looked at in every step; none breaks, and if `cracked`, many are broken.
fn fracture(side: usize, cracked: bool) -> Subject {
    let mut body = Body::square(side, &FIRST);
    let (neighbours, reference) = (&body.flock.neighbours, &body.flock.reference);
    let threshold = Threshold::Stretch(3.0);
    let mut bonds = Bonds::new(Some(threshold), Ghosts::Lattice, neighbours);
    if cracked {
        // Cuts along columns, as many as tear one bond in so many.
        let far = 2.0 * side as f64;
        for column in (3..side - 3).step_by(CRACKS_EVERY / 2) {
            let at = column as f64 + 0.5;
            bonds.cut(([at, -far], [at, far]), neighbours, reference, &mut Vec::new());
        }
    }
    body.flock.bonds = Some(bonds);
    let (roles, bonds_watched) = (body.roles.clone(), body.flock.neighbours.index.len() / 2);
    let sweep = body.sweep(Update::default());
    let Body { mut flock, mut present, .. } = body;
    let (mut next, followers) = (present.clone(), sweep.followers());
    let step = move |steps: usize| {
        for _ in 0..steps {
            let Flock { bonds, neighbours, reference, .. } = &mut flock;
            let bonds = bonds.as_mut().expect("given above");
            bonds.break_stretched(1, neighbours, (&**reference, &present), &roles, &mut Vec::new());
            sweep.step(&flock, None, &present, &mut next);
            std::mem::swap(&mut present, &mut next);
        }
    };
    let subject = Subject::new(if cracked { CRACKED } else { INTACT }, side, followers, step);
    // The positions once more, to look at the bonds.
    Subject { bonds_watched, bytes_per_update: BYTES_PER_UPDATE + 16.0, ..subject }
}

/// A hexagonal lattice swept by lists, as an irregular body is, its particles numbered one way or the other.
fn lists(side: usize, order: &'static str) -> Subject {
    let (points, lists) = hexagonal(side);
    let mut rank: Vec<u32> = (0..points.len() as u32).collect();
    if order != SPATIAL {
        shuffle(&mut rank);
    }
    if order == RENUMBERED {
        let shuffled = reorder(&points, &rank);
        rank = order_in_columns(&shuffled, 1.0).into_iter().map(|i| rank[i as usize]).collect();
    }
    // `rank` names the old number of each new one.
    let mut new = vec![0; rank.len()];
    rank.iter().zip(0..).for_each(|(&old, now)| new[old as usize] = now);
    let renamed =
        rank.iter().map(|&old| lists[old as usize].iter().map(|&k| new[k as usize]).collect::<Vec<u32>>());
    let neighbours = Neighbours::from_lists(renamed);
    let roles: Vec<Role> = (0..rank.len())
        .map(|j| if neighbours.of(j).is_empty() { Role::Clamped } else { Role::Follower })
        .collect();
    let body = Body::new(side, reorder(&points, &rank), neighbours, roles);
    Subject { is_shared: false, ..body.subject(order, BYTES_PER_UPDATE + BYTES_PER_LIST, 1) }
}

/// The places of a hexagonal lattice, jumbled so little that no neighbours change but no two are translates, and
/// the lists of those inside.
fn hexagonal(side: usize) -> (Vectors, Vec<Vec<u32>>) {
    let at = |column: usize, row: usize| (column * side + row) as u32;
    let points = (0..side * side)
        .map(|i| [(i / side) as f64 * 0.75f64.sqrt(), (i % side) as f64 + 0.5 * (i / side % 2) as f64]);
    let inner = 1..side - 1;
    let lists = (0..side * side).map(|i| {
        let (column, row) = (i / side, i % side);
        if !inner.contains(&column) || !inner.contains(&row) {
            return Vec::new();
        }
        let shift = column % 2;
        let mut list = vec![
            at(column, row - 1),
            at(column, row + 1),
            at(column - 1, row + shift - 1),
            at(column - 1, row + shift),
            at(column + 1, row + shift - 1),
            at(column + 1, row + shift),
        ];
        // The order of summation differs from one to the next, as in a body without lattice.
        list.rotate_left(i % 6);
        list
    });
    (points.collect(), lists.collect())
}

fn reorder(points: &Vectors, rank: &[u32]) -> Vectors {
    rank.iter().map(|&i| points.get(i as usize)).collect()
}

/// The same jumble each time (a multiplicative generator; D. Knuth, *The Art of Computer Programming*, vol. 2).
fn shuffle(values: &mut [u32]) {
    let mut state = 88_172_645_463_325_252u64;
    for i in (1..values.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        values.swap(i, ((state >> 33) as usize) % (i + 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lattice_built_directly_is_the_one_a_scene_would_cut() {
        use crate::flock::body::{self, Cut};
        let lattice = Lattice::new(LatticeKind::Square { spacing: 1.0 }, [0.0; 2], 0.0);
        let cut = Cut::Count { columns: 9, rows: 9 };
        let (body, neighbours) = body::Body::build(lattice, &cut, &FIRST, None).expect("fits");
        let direct = Body::square(9, &FIRST);
        assert_eq!(direct.flock.reference, body.reference);
        let inner = (1..8).flat_map(|column| (1..8).map(move |row| 9 * column + row));
        for particle in inner {
            assert_eq!(direct.flock.neighbours.of(particle), neighbours.of(particle));
        }
        assert_eq!(direct.flock.neighbours.index.len(), 4 * direct.sweep(Update::default()).followers());
    }

    #[test]
    fn the_jumbled_lattice_is_swept_by_lists_whatever_its_order() {
        for order in [SPATIAL, RANDOM, RENUMBERED] {
            let mut subject = lists(20, order);
            assert_eq!(subject.followers, 18 * 18);
            assert!(subject.time(3) > 0.0);
        }
        let (points, lists) = hexagonal(20);
        for (j, list) in lists.iter().enumerate() {
            for &k in list {
                let apart = crate::flock::vectors::distance(points.get(j), points.get(k as usize));
                assert!((apart - 1.0).abs() < 1e-12, "{j} sees {k}");
            }
        }
    }
}
