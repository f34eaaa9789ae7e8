//! Particles with rows of their own, as those along an outline and beside it have: so many at a time, each in a lane.

use std::ops::Range;

use super::matrix::Matrix;
use crate::solve::field::Real;

/// Particles of a pack: one AVX2 vector of single precision, two of double.
pub const PACK: usize = 8;

/// Particles that are gone over together.
#[derive(Clone, Debug)]
pub struct Pack {
    /// The particle of each lane; in the last pack of a group one may be there more than once.
    pub particles: [u32; PACK],
    classes: [u32; PACK],
    /// Where its terms lie, as many as the longest of its rows has.
    pub terms: Range<u32>,
}

/// The packs of a matrix.
#[derive(Clone, Debug, Default)]
pub struct Packs {
    packs: Vec<Pack>,
    /// First pack of each group, shape \[groups + 1\].
    groups: Vec<usize>,
    /// The particles that each term reads, shape \[terms\]\[lanes\].
    read: Vec<[u32; PACK]>,
}

impl Packs {
    pub fn new(matrix: &Matrix) -> Self {
        let mut packs = Self { groups: vec![0], ..Self::default() };
        for group in 0..matrix.groups() {
            let short = matrix.runs_of(group).iter().filter(|run| run.is_packed());
            let mut particles: Vec<_> =
                short.flat_map(|run| (run.start..run.start + run.len).map(move |i| (i, run))).collect();
            // Rows about as long as each other have the fewest terms that only some of them need.
            particles.sort_by_key(|(_, run)| run.terms);
            for of_pack in particles.chunks(PACK) {
                let begin = packs.read.len();
                let terms = of_pack.iter().map(|(_, run)| run.terms).max().unwrap_or_default() as usize;
                packs.read.resize(begin + terms, [of_pack[0].0; PACK]);
                let lanes: [_; PACK] = std::array::from_fn(|lane| of_pack[lane.min(of_pack.len() - 1)]);
                for (lane, (particle, run)) in lanes.iter().enumerate() {
                    for (read, &distance) in packs.read[begin..].iter_mut().zip(matrix.distances(run)) {
                        read[lane] = particle.wrapping_add_signed(distance);
                    }
                }
                let terms = begin as u32..packs.read.len() as u32;
                let particles = lanes.map(|(particle, _)| particle);
                packs.packs.push(Pack { particles, classes: lanes.map(|(_, run)| run.class), terms });
            }
            packs.groups.push(packs.packs.len());
        }
        packs
    }

    pub fn all(&self) -> &[Pack] {
        &self.packs
    }

    /// Numbers of the packs of a group.
    #[inline(always)]
    pub fn of_group(&self, group: usize) -> Range<usize> {
        self.groups[group]..self.groups[group + 1]
    }

    /// The particles that these terms read.
    #[inline(always)]
    pub fn read_by(&self, terms: Range<usize>) -> &[[u32; PACK]] {
        &self.read[terms]
    }

    /// The blocks of the particles of all packs, lane by lane; nothing where a row has no more.
    pub fn interleaved<T: Real, B: Iterator<Item = [T; 4]>>(
        &self,
        blocks: impl Fn(u32) -> B,
    ) -> Vec<[[T; PACK]; 4]> {
        let mut all = vec![[[T::default(); PACK]; 4]; self.read.len()];
        for pack in &self.packs {
            let of_pack = &mut all[pack.terms.start as usize..pack.terms.end as usize];
            for (lane, &class) in pack.classes.iter().enumerate() {
                for (to, block) in of_pack.iter_mut().zip(blocks(class)) {
                    (0..4).for_each(|entry| to[entry][lane] = block[entry]);
                }
            }
        }
        all
    }

    /// Four numbers of the particles of each pack, lane by lane.
    pub fn of_each<T: Real>(&self, numbers: impl Fn(u32) -> [T; 4]) -> Vec<[[T; PACK]; 4]> {
        let of_pack = |pack: &Pack| {
            let of_lane = pack.classes.map(&numbers);
            std::array::from_fn(|entry| of_lane.map(|numbers| numbers[entry]))
        };
        self.packs.iter().map(of_pack).collect()
    }
}
