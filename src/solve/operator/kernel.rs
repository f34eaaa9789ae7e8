//! The loops that equilibrium is found in: a matrix applied over its runs, and what is made of the
//! product while it is in the registers.
//!
//! Per particle a row of nine blocks is 36 multiplications and as many additions: in single precision
//! less than the memory takes, if the vectors are as wide as the processor has them. The loops are
//! therefore compiled twice. Lanes are never added to each other, so the width changes no bit.

use super::matrix::{LONG, Matrix, Run};
use super::packs::PACK;
use super::rows::RowRef;
use crate::flock::block::{Block, inverse, transposed};
use crate::flock::lanes::{InLanes, add_product, in_lanes, lanes};
use crate::solve::field::{Real, VectorsRef};

/// Particles at a time: four AVX2 vectors of single and eight of double precision, so that a block is
/// loaded once for all of them.
const WIDE: usize = 32;
/// The same for what is left.
const NARROW: usize = 8;
/// The same of short runs: columns that an outline cuts end anywhere.
const NARROWEST: usize = LONG as usize;

/// The rows of a matrix in the precision they are applied in.
#[derive(Clone, Debug)]
pub struct RowCoefficients<T> {
    /// Where the blocks of each class begin, shape \[classes + 1\].
    starts: Vec<u32>,
    /// By class of a long run: `D`, then `-K` of each entry, each by columns.
    blocks: Vec<[T; 4]>,
    /// `D^-1` by class, by rows.
    inverse: Vec<[T; 4]>,
    /// The blocks of the particles of each pack, lane by lane, shape \[terms of all packs\].
    packed: Vec<[[T; PACK]; 4]>,
    /// Their `D^-1`, shape \[packs\].
    packed_inverse: Vec<[[T; PACK]; 4]>,
}

impl<T: Real> RowCoefficients<T> {
    /// Rows multiplied by `scale`. A `D` without inverse is given zero: what it belongs to stays put.
    pub fn new(matrix: &Matrix, scale: f64) -> Self {
        let mut stencils = Self {
            starts: vec![0],
            blocks: Vec::new(),
            inverse: Vec::new(),
            packed: Vec::new(),
            packed_inverse: Vec::new(),
        };
        let mut is_long = vec![false; matrix.rows.len()];
        matrix
            .runs()
            .iter()
            .filter(|run| !run.is_packed())
            .for_each(|run| is_long[run.class as usize] = true);
        stencils.inverse.reserve_exact(matrix.rows.len());
        stencils.starts.reserve_exact(matrix.rows.len());
        for (row, is_long) in matrix.rows.iter().zip(is_long) {
            if is_long {
                stencils.blocks.extend(blocks::<T>(row, scale));
            }
            stencils.starts.push(stencils.blocks.len() as u32);
            stencils.inverse.push(cast(inverse(row.diagonal).unwrap_or_default(), 1.0 / scale));
        }
        stencils.packed = matrix.packs().interleaved(|class| blocks(matrix.rows.of(class), scale));
        stencils.packed_inverse = matrix.packs().of_each(|class| stencils.inverse[class as usize]);
        stencils
    }

    /// The same rows with the modulus of every number in place of the number.
    pub fn absolute(mut self) -> Self {
        let size = |v: &mut T| *v = T::of(v.wide().abs());
        self.blocks.as_flattened_mut().iter_mut().for_each(size);
        self.packed.as_flattened_mut().as_flattened_mut().iter_mut().for_each(size);
        self
    }

    /// `D` and `-K` of each entry of a class, by columns; nothing of a class that no long run has.
    fn blocks(&self, class: u32) -> &[[T; 4]] {
        &self.blocks[self.starts[class as usize] as usize..self.starts[class as usize + 1] as usize]
    }

    /// `D^-1` of a class, by rows.
    pub fn inverse(&self, class: u32) -> &[T; 4] {
        &self.inverse[class as usize]
    }
}

/// Entries of a block, one after the other.
fn cast<T: Real>([[xx, xy], [yx, yy]]: Block, factor: f64) -> [T; 4] {
    [xx, xy, yx, yy].map(|v| T::of(v * factor))
}

/// `D`, then `-K` of each entry of a row, each by columns and multiplied by `scale`.
fn blocks<T: Real>(row: RowRef<'_>, scale: f64) -> impl Iterator<Item = [T; 4]> {
    let others = row.entries.iter().map(move |(_, block)| cast(transposed(*block), -scale));
    std::iter::once(cast(transposed(*row.diagonal), scale)).chain(others)
}

/// A computation that uses `K u`.
pub trait Task<T> {
    /// Takes `K u` of some particles.
    fn take<const W: usize>(&mut self, particles: &impl Particles<T, W>, x: &[T; W], y: &[T; W]);
}

/// Particles that are gone over together.
pub trait Particles<T, const W: usize> {
    /// Their values of a whole vector.
    fn of(&self, values: &[T]) -> [T; W];
    /// Writes theirs of a vector that begins at number `begin`.
    fn set(&self, values: &mut [T], begin: usize, new: [T; W]);
    /// An entry of `D^-1`, by rows, of one of them.
    fn inverse(&self, entry: usize, lane: usize) -> T;
}

/// `D^-1` of particles that are gone over together, by rows.
trait Inverse<T> {
    fn entry(&self, entry: usize, lane: usize) -> T;
}

/// One for all of them.
impl<T: Real> Inverse<T> for &[T; 4] {
    #[inline(always)]
    fn entry(&self, entry: usize, _: usize) -> T {
        self[entry]
    }
}

/// One for each lane.
impl<T: Real> Inverse<T> for &[[T; PACK]; 4] {
    #[inline(always)]
    fn entry(&self, entry: usize, lane: usize) -> T {
        self[entry][lane]
    }
}

/// Particles from number `at` on.
struct InARow<I> {
    at: usize,
    inverse: I,
}

impl<T: Real, I: Inverse<T>, const W: usize> Particles<T, W> for InARow<I> {
    #[inline(always)]
    fn of(&self, values: &[T]) -> [T; W] {
        lanes(values, self.at)
    }

    #[inline(always)]
    fn set(&self, values: &mut [T], begin: usize, new: [T; W]) {
        values[self.at - begin..][..W].copy_from_slice(&new);
    }

    #[inline(always)]
    fn inverse(&self, entry: usize, lane: usize) -> T {
        self.inverse.entry(entry, lane)
    }
}

/// Particles anywhere.
struct Scattered<'a, T> {
    particles: &'a [u32; PACK],
    inverse: &'a [[T; PACK]; 4],
}

impl<T: Real> Particles<T, PACK> for Scattered<'_, T> {
    #[inline(always)]
    fn of(&self, values: &[T]) -> [T; PACK] {
        self.particles.map(|i| values[i as usize])
    }

    #[inline(always)]
    fn set(&self, values: &mut [T], begin: usize, new: [T; PACK]) {
        for (&i, new) in self.particles.iter().zip(new) {
            values[i as usize - begin] = new;
        }
    }

    #[inline(always)]
    fn inverse(&self, entry: usize, lane: usize) -> T {
        self.inverse.entry(entry, lane)
    }
}

/// Hands `K u` of the particles in a group to the task.
pub fn pass<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    group: usize,
    u: VectorsRef<'_, T>,
    task: &mut impl Task<T>,
) {
    // Measured with AVX2: the beams of the benchmark are solved 1.2 to 2.5 times as fast.
    in_lanes(Pass { matrix, stencils, group, u, task });
}

/// A group to go over, in pieces of a width of their own.
struct Pass<'a, T, K> {
    matrix: &'a Matrix,
    stencils: &'a RowCoefficients<T>,
    group: usize,
    u: VectorsRef<'a, T>,
    task: &'a mut K,
}

impl<T: Real, K: Task<T>> InLanes for Pass<'_, T, K> {
    const BYTES: usize = size_of::<T>();
    const MULTIPLIES: bool = false;

    #[inline(always)]
    fn run<const W: usize>(self) {
        let Self { matrix, stencils, group, u, task } = self;
        over_runs(matrix, stencils, matrix.runs_of(group), u, task);
        over_packs(matrix, stencils, group, u, task);
    }
}

#[inline(always)]
fn over_runs<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    runs: &[Run],
    u: VectorsRef<'_, T>,
    task: &mut impl Task<T>,
) {
    for run in runs.iter().filter(|run| !run.is_packed()) {
        let (blocks, distances) = (stencils.blocks(run.class), matrix.distances(run));
        let inverse = stencils.inverse(run.class);
        let (mut at, end) = (run.start as usize, (run.start + run.len) as usize);
        while at + WIDE <= end {
            several::<T, WIDE>(blocks, distances, inverse, at, u, task);
            at += WIDE;
        }
        while at + NARROW <= end {
            several::<T, NARROW>(blocks, distances, inverse, at, u, task);
            at += NARROW;
        }
        // What is left is computed with some of those before it once more, which takes less time than one by one.
        if at < end && run.len as usize >= NARROW {
            several::<T, NARROW>(blocks, distances, inverse, end - NARROW, u, task);
        } else if at < end {
            several::<T, NARROWEST>(blocks, distances, inverse, at, u, task);
            several::<T, NARROWEST>(blocks, distances, inverse, end - NARROWEST, u, task);
        }
    }
}

/// The particles of a group in packs, each by a row of its own.
#[inline(always)]
fn over_packs<T: Real>(
    matrix: &Matrix,
    stencils: &RowCoefficients<T>,
    group: usize,
    u: VectorsRef<'_, T>,
    task: &mut impl Task<T>,
) {
    // One length, so that an index is compared with it once for both components.
    let (of_x, of_y) = (u.x, &u.y[..u.x.len()]);
    let all = matrix.packs();
    let packs = all.of_group(group);
    for (pack, inverse) in all.all()[packs.clone()].iter().zip(&stencils.packed_inverse[packs]) {
        let mut sum = [[T::default(); PACK]; 2];
        let (rows, gathers) = all.read_by(pack);
        let (of_rows, of_gathers) = stencils.packed[pack.terms()].split_at(rows.len());
        for (block, &first) in of_rows.iter().zip(rows) {
            add_lanes(block, [lanes(of_x, first as usize), lanes(of_y, first as usize)], &mut sum);
        }
        for (block, from) in of_gathers.iter().zip(gathers) {
            add_lanes(block, [from.map(|i| of_x[i as usize]), from.map(|i| of_y[i as usize])], &mut sum);
        }
        let [x, y] = &sum;
        match pack.is_in_a_row {
            true => task.take(&InARow { at: pack.particles[0] as usize, inverse }, x, y),
            false => task.take(&Scattered { particles: &pack.particles, inverse }, x, y),
        }
    }
}

/// Adds the product of a block of each lane and what the lane reads.
#[inline(always)]
fn add_lanes<T: Real>(block: &[[T; PACK]; 4], [ux, uy]: [[T; PACK]; 2], [x, y]: &mut [[T; PACK]; 2]) {
    let [xx, yx, xy, yy] = block;
    for k in 0..PACK {
        x[k] += xx[k] * ux[k] + xy[k] * uy[k];
        y[k] += yx[k] * ux[k] + yy[k] * uy[k];
    }
}

#[inline(always)]
fn several<T: Real, const W: usize>(
    blocks: &[[T; 4]],
    distances: &[i32],
    inverse: &[T; 4],
    at: usize,
    u: VectorsRef<'_, T>,
    task: &mut impl Task<T>,
) {
    let mut sum = [[T::default(); W]; 2];
    for (&[xx, yx, xy, yy], &distance) in blocks.iter().zip(distances) {
        let from = at.wrapping_add_signed(distance as isize);
        add_product([xx, xy, yx, yy], &[lanes(u.x, from), lanes(u.y, from)], &mut sum);
    }
    task.take(&InARow { at, inverse }, &sum[0], &sum[1]);
}

/// `K u` of one particle.
#[inline(always)]
pub fn product(row: RowRef<'_>, distances: &[i32], at: usize, u: VectorsRef<'_, f64>) -> [f64; 2] {
    let mut sums = [0.0; 4];
    let mut add = |sign: f64, block: &Block, distance: i32| {
        let from = at.wrapping_add_signed(distance as isize);
        let factors = [u.x[from], u.y[from], u.x[from], u.y[from]];
        for (k, value) in block.as_flattened().iter().enumerate() {
            sums[k] += sign * value * factors[k];
        }
    };
    add(1.0, row.diagonal, distances[0]);
    for ((_, block), &distance) in row.entries.iter().zip(&distances[1..]) {
        add(-1.0, block, distance);
    }
    [sums[0] + sums[1], sums[2] + sums[3]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::lattice::LatticeKind;
    use crate::flock::vectors::Vectors;
    use crate::solve::operator::samples::{operator, with_outliers, with_own_rows};

    struct Collect<T>(Vectors<T>);

    impl<T: Real> Task<T> for Collect<T> {
        fn take<const W: usize>(&mut self, particles: &impl Particles<T, W>, x: &[T; W], y: &[T; W]) {
            particles.set(&mut self.0.x, 0, *x);
            particles.set(&mut self.0.y, 0, *y);
        }
    }

    /// Particles one by one add up in another order.
    fn assert_widths_agree<T: Real>(matrix: &Matrix, rounding: f64) {
        let stencils = RowCoefficients::<T>::new(matrix, 0.7);
        let noise = |i: usize| T::of((i as f64 * 0.618_033_988_749_895).fract() - 0.5);
        let u = Vectors {
            x: (0..matrix.count()).map(noise).collect(),
            y: (0..matrix.count()).map(|i| noise(7 * i)).collect(),
        };
        let [mut wide, mut portable] = [(); 2].map(|()| Collect(Vectors::zeros(matrix.count())));
        for group in 0..matrix.groups() {
            pass(matrix, &stencils, group, u.view(), &mut wide);
            Pass { matrix, stencils: &stencils, group, u: u.view(), task: &mut portable }.run::<1>();
        }
        assert!(wide.0 == portable.0);
        let widen = |values: &[T]| values.iter().map(|v| v.wide()).collect::<Vec<_>>();
        let found = Vectors { x: widen(&wide.0.x), y: widen(&wide.0.y) };
        let size = found.x.iter().chain(&found.y).fold(0.0, |size: f64, v| size.max(v.abs()));
        let u = Vectors { x: widen(&u.x), y: widen(&u.y) };
        let mut count = 0;
        for run in matrix.runs() {
            for at in run.start as usize..(run.start + run.len) as usize {
                let alone = product(matrix.rows.of(run.class), matrix.distances(run), at, u.view());
                let found = found.get(at);
                let off = (0..2).map(|k| (0.7 * alone[k] - found[k]).abs()).fold(0.0, f64::max);
                assert!(off <= rounding * size, "{at}: {off:e} of {size:e}");
                count += 1;
            }
        }
        assert!(count > 4000);
    }

    #[test]
    fn the_width_of_the_vectors_changes_no_bit() {
        let regular = operator(LatticeKind::SAMPLES[3], 30, 143, |i| i % 211 == 0);
        for operator in [with_outliers(&regular), with_own_rows(&regular), regular] {
            let matrix = Matrix::of_followers(&operator);
            assert_widths_agree::<f32>(&matrix, 1e-6);
            assert_widths_agree::<f64>(&matrix, 2e-15);
        }
    }

    #[test]
    fn particles_one_above_the_other_with_rows_of_their_own_are_in_packs_in_a_row() {
        let regular = operator(LatticeKind::SAMPLES[3], 30, 143, |i| i % 211 == 0);
        let matrix = Matrix::of_followers(&with_own_rows(&regular));
        let (packs, in_a_row) =
            (matrix.packs().all().len(), matrix.packs().all().iter().filter(|pack| pack.is_in_a_row).count());
        assert!(packs > 500 && in_a_row > packs * 9 / 10, "{in_a_row} of {packs}");
    }
}
