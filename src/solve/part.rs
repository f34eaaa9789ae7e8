//! The part of a matrix that one of several ranks computes, and what it receives from the others for it.
//!
//! A rank owns consecutive groups of columns. Every pass over the particles is made group by group, and every sum is
//! added up over each group and then over the groups in their order, so ranks change no bit, as threads do not. Each of them
//! finds what all of them read, and nothing has to be negotiated: the columns around those of its groups.

use std::ops::Range;

use super::field::Real;
use super::operator::Matrix;
use crate::flock::halo::Halo;
use crate::flock::vectors::Vectors;
use crate::ranks::Team;

/// Groups per rank below which a matrix is not shared: the exchanges would take longer than the passes.
const FEWEST_GROUPS: usize = 2;

/// The groups of a matrix that each rank owns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cuts {
    /// First group of each rank, shape \[ranks + 1\].
    groups: Vec<usize>,
    /// First particle of each rank, shape \[ranks + 1\].
    particles: Vec<usize>,
}

impl Cuts {
    /// About as many particles for each rank; the first one owns all where there are few groups. `bounds` are those of the groups
    /// of the whole matrix.
    pub fn new(bounds: &[usize], ranks: usize) -> Self {
        let (groups, count) = (bounds.len() - 1, bounds[bounds.len() - 1]);
        let nearest = |particle: usize| {
            let after = bounds.partition_point(|&bound| bound < particle);
            let before = after.saturating_sub(1);
            if particle - bounds[before] < bounds[after] - particle { before } else { after }
        };
        let first = |rank: usize| match rank {
            0 => 0,
            _ if rank == ranks || groups < FEWEST_GROUPS * ranks => groups,
            _ => nearest(rank * count / ranks),
        };
        Self::of_groups(bounds, (0..=ranks).map(first).collect())
    }

    /// All for the first rank.
    pub fn of_one(bounds: &[usize], ranks: usize) -> Self {
        let groups = (0..=ranks).map(|rank| if rank == 0 { 0 } else { bounds.len() - 1 });
        Self::of_groups(bounds, groups.collect())
    }

    fn of_groups(bounds: &[usize], groups: Vec<usize>) -> Self {
        let particles = groups.iter().map(|&group| bounds[group]).collect();
        Self { groups, particles }
    }

    /// How many ranks there are.
    fn ranks(&self) -> usize {
        self.groups.len() - 1
    }

    /// The groups of a rank.
    pub fn groups_of(&self, rank: usize) -> Range<usize> {
        self.groups[rank]..self.groups[rank + 1]
    }

    /// The particles of a rank.
    pub fn particles_of(&self, rank: usize) -> Range<usize> {
        self.particles[rank]..self.particles[rank + 1]
    }

    /// The halo of a rank; `read_by` are the particles that a rank reads, which may be its own.
    pub fn halo(&self, rank: usize, read_by: impl Fn(usize) -> Range<usize>) -> Halo {
        Halo::new((rank, self.ranks()), |owner| self.particles_of(owner), read_by)
    }

    /// Whether more than one rank owns something.
    pub fn is_shared(&self) -> bool {
        self.groups.windows(2).filter(|ends| ends[0] < ends[1]).count() > 1
    }
}

/// Exchanges the particles of a vector.
pub fn receive<T: Real>(halo: &Halo, team: &Team, v: &mut Vectors<T>) {
    if *halo == Halo::default() {
        return;
    }
    let (sent, sizes) = halo.messages(&[&*v]);
    halo.put(&team.swap(&sent, &sizes), &mut [v]);
}

/// The part of a matrix that this rank computes.
#[derive(Clone, Debug)]
pub struct Part {
    /// The ranks.
    pub team: Team,
    /// What each of them owns.
    pub cuts: Cuts,
    /// What the rows of this one's particles lead to.
    halo: Halo,
}

impl Part {
    /// The part of this rank in a window that begins with the `first` particle of the whole; `read_by` are all that a rank reads.
    pub fn in_window(team: &Team, cuts: Cuts, first: usize, read_by: impl Fn(usize) -> Range<usize>) -> Self {
        let halo = cuts.halo(team.rank(), read_by).here(first);
        Self { team: team.clone(), cuts, halo }
    }

    /// The groups that this rank owns.
    pub fn groups(&self) -> Range<usize> {
        self.cuts.groups_of(self.team.rank())
    }

    /// Whether this rank is not the only one that owns groups.
    pub fn is_shared(&self) -> bool {
        self.cuts.is_shared()
    }

    /// The sum over all groups, of which this rank has its own, in their order; and whether any rank has the flag.
    pub fn sum(&self, own: &[f64], flag: bool) -> (f64, bool) {
        let words: Vec<u64> = own.iter().map(|sum| sum.to_bits()).chain([u64::from(flag)]).collect();
        let counts: Vec<usize> =
            (0..self.cuts.ranks()).map(|rank| self.cuts.groups_of(rank).len() + 1).collect();
        let all = self.team.gather(&words, &counts);
        let (mut rest, mut sums, mut any) = (&all[..], Vec::new(), false);
        for count in counts {
            let (of_rank, after) = rest.split_at(count);
            let (flag, of_groups) = of_rank.split_last().expect("a flag at least");
            sums.extend(of_groups.iter().map(|&bits| f64::from_bits(bits)));
            any |= *flag == 1;
            rest = after;
        }
        (sums.iter().sum(), any)
    }

    /// Makes known what the rows of this rank's particles lead to.
    pub fn receive<T: Real>(&self, v: &mut Vectors<T>) {
        receive(&self.halo, &self.team, v);
    }
}

/// How many particles of others a rank receives before it applies the rows of its own.
pub fn received_by(matrix: &Matrix, cuts: &Cuts, rank: usize) -> usize {
    read_by(matrix, cuts, rank).len() - cuts.particles_of(rank).len()
}

/// The particles of a rank and, in whole columns, those that their rows lead to.
fn read_by(matrix: &Matrix, cuts: &Cuts, rank: usize) -> Range<usize> {
    let groups = cuts.groups_of(rank);
    let [first, end] = [groups.start, groups.end].map(|group| matrix.group_columns[group]);
    let reach = matrix.reach_across();
    if groups.is_empty() { 0..0 } else { matrix.columns.particles(first - reach..end + reach) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::lattice::LatticeKind;
    use crate::ranks::in_process;
    use crate::solve::operator::RowCoefficients;
    use crate::solve::operator::samples::{operator, with_outliers};

    fn part(team: &Team, matrix: &Matrix) -> Part {
        let cuts = Cuts::new(&matrix.bounds, team.count());
        Part::in_window(team, cuts.clone(), 0, |rank| read_by(matrix, &cuts, rank))
    }

    /// Bodies on every lattice, each in groups of few particles; some have particles along an outline.
    fn matrices() -> Vec<Matrix> {
        let of_kind = |kind: LatticeKind| {
            let regular = operator(kind, 24, 17, |i| i < 9 || i == 50);
            [with_outliers(&regular), regular].map(|operator| Matrix::of_followers(&operator).regrouped(20))
        };
        LatticeKind::SAMPLES.into_iter().flat_map(of_kind).collect()
    }

    #[test]
    fn ranks_own_all_groups_once_and_about_as_much_each() {
        for matrix in matrices() {
            for ranks in 1..=7 {
                let cuts = Cuts::new(&matrix.bounds, ranks);
                let owned: Vec<usize> = (0..ranks).flat_map(|rank| cuts.groups_of(rank)).collect();
                assert_eq!(owned, (0..matrix.groups()).collect::<Vec<_>>());
                assert_eq!(cuts.is_shared(), ranks > 1 && matrix.groups() >= 2 * ranks);
                let largest = (0..ranks).map(|rank| cuts.particles_of(rank).len()).max();
                // Groups are columns, of up to 35 particles more than is asked for.
                let fair = matrix.count() / ranks + 2 * (20 + 35);
                assert!(!cuts.is_shared() || largest <= Some(fair), "{largest:?} {fair}");
            }
        }
    }

    #[test]
    fn a_body_of_few_groups_stays_on_the_first_rank() {
        let matrix = Matrix::of_followers(&operator(LatticeKind::SAMPLES[0], 24, 17, |i| i < 9));
        let cuts = Cuts::new(&matrix.bounds, 3);
        assert!(!cuts.is_shared());
        assert_eq!([0, 1, 2].map(|rank| cuts.groups_of(rank).len()), [matrix.groups(), 0, 0]);
    }

    #[test]
    fn everything_that_is_read_is_owned_or_received_and_sent_by_its_owner() {
        for matrix in matrices() {
            for ranks in 2..=5 {
                let parts: Vec<Part> = in_process(ranks).iter().map(|team| part(team, &matrix)).collect();
                for (rank, part) in parts.iter().enumerate() {
                    let mut known = vec![false; matrix.count()];
                    known[part.cuts.particles_of(rank)].fill(true);
                    for (other, of) in &part.halo.receives {
                        known[of.clone()].fill(true);
                        let sent = parts[*other].halo.sends.iter().find(|(to, _)| *to == rank);
                        assert_eq!(sent.map(|(_, of)| of), Some(of));
                    }
                    let received: usize = part.halo.receives.iter().map(|(_, of)| of.len()).sum();
                    assert_eq!(received_by(&matrix, &part.cuts, rank), received);
                    for run in part.groups().flat_map(|group| matrix.runs_of(group)) {
                        for &distance in matrix.distances(run) {
                            let start = (run.start as usize).wrapping_add_signed(distance as isize);
                            assert!(known[start..start + run.len as usize].iter().all(|&known| known));
                        }
                    }
                }
                let sends: usize = parts.iter().map(|part| part.halo.sends.len()).sum();
                assert_eq!(sends, parts.iter().map(|part| part.halo.receives.len()).sum::<usize>());
            }
        }
    }

    /// The product with rows on ranks that know nothing but their own particles, of these, and its sum, as bits.
    fn product<T: Real>(matrix: &Matrix, team: Option<&Team>) -> (Vec<[u64; 2]>, Range<usize>, u64) {
        let mut matrix = matrix.clone();
        matrix.part = team.map(|team| std::sync::Arc::new(part(team, &matrix)));
        let own =
            matrix.part.as_ref().map_or(0..matrix.count(), |part| part.cuts.particles_of(part.team.rank()));
        let noise = |i: usize| (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
        let of = |i: usize, at: usize| T::of(if own.contains(&i) { noise(at) } else { f64::NAN });
        let mut u = Vectors {
            x: (0..matrix.count()).map(|i| of(i, 2 * i)).collect(),
            y: (0..matrix.count()).map(|i| of(i, 2 * i + 1)).collect(),
        };
        let stencils = RowCoefficients::<T>::new(&matrix, 0.7);
        let mut out = Vectors::zeros(matrix.count());
        matrix.receive(&mut u);
        let sum = crate::solve::equilibrium::steps::apply(&matrix, &stencils, &u, &mut out);
        let products = own.clone().map(|i| [out.x[i].bits(), out.y[i].bits()]).collect();
        (products, own, sum.to_bits())
    }

    fn assert_products_agree<T: Real>() {
        for matrix in matrices() {
            let (alone, _, expected) = product::<T>(&matrix, None);
            for ranks in [1, 2, 3, 5, 40] {
                std::thread::scope(|scope| {
                    for team in in_process(ranks) {
                        let (matrix, alone) = (&matrix, &alone);
                        scope.spawn(move || {
                            let (found, own, sum) = product::<T>(matrix, Some(&team));
                            assert!(found == alone[own] && sum == expected);
                        });
                    }
                });
            }
        }
    }

    #[test]
    fn a_product_has_the_same_bits_on_any_number_of_ranks() {
        assert_products_agree::<f64>();
        assert_products_agree::<f32>();
    }

    #[test]
    fn a_flag_of_any_rank_is_known_to_all() {
        let matrix = &matrices()[0];
        std::thread::scope(|scope| {
            for team in in_process(3) {
                scope.spawn(move || {
                    let part = part(&team, matrix);
                    let own = vec![1.0; part.groups().len()];
                    let flags = [Some(2), None].map(|raised| part.sum(&own, raised == Some(team.rank())));
                    let all = matrix.groups() as f64;
                    assert_eq!(flags, [(all, true), (all, false)]);
                });
            }
        });
    }
}
