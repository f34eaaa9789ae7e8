//! Rows over index lists, for particles that no run fits.
//!
//! The lists are copied together in the order in which they are read, sorted within each band by how many
//! neighbours they name: a body without lattice has hardly two particles in a row with equally many, and a loop
//! over a number known beforehand is what keeps both load ports busy.

use std::ops::Range;

use super::kernel::Component;
use super::rows::Coefficients;
use super::terms::Terms;
use crate::flock::real::Real;

/// Prefetch distances in particles and in lists, for bodies larger than the caches: the processor cannot predict the
/// addresses that the lists name. Measured on a million particles: 1.4 times as fast.
const AHEAD: [usize; 2] = [64, 256];

/// Particles beyond which a body is read so.
const PREFETCHED_BEYOND: usize = 1 << 18;

/// The lists of all bands, one group after the other.
#[derive(Clone, Debug, Default)]
pub struct Gathers {
    groups: Vec<Group>,
    particles: Vec<u32>,
    /// Where the coefficients of each of `particles` begin; none where all count the same.
    coefficients: Vec<u32>,
    /// The neighbours of each of `particles`.
    index: Vec<u32>,
}

/// Particles of a band with equally many neighbours.
#[derive(Clone, Copy, Debug)]
struct Group {
    neighbours: u32,
    particles: u32,
    /// Where its lists begin in `index`.
    index: u32,
    /// The first and the last of all particles that are read in it.
    seen: [u32; 2],
}

impl Gathers {
    pub fn group_count(&self) -> usize {
        self.groups.len()
    }

    /// How many particles have lists.
    pub fn particles(&self) -> usize {
        self.particles.len()
    }

    /// Adds the particles of a band, ascending, each with its neighbours and, where they do not all count the same, where
    /// its coefficients begin; one without neighbours stays.
    pub fn push_band<'a>(&mut self, particles: &[u32], starts: &[u32], list: impl Fn(u32) -> &'a [u32]) {
        let size = |k: usize| list(particles[k]).len();
        let mut sorted: Vec<usize> = (0..particles.len()).collect();
        sorted.sort_by_key(|&k| size(k));
        // At once: lists that grow take up to twice what they hold.
        self.index.reserve(sorted.iter().map(|&k| size(k)).sum());
        for alike in sorted.chunk_by(|&a, &b| size(a) == size(b)) {
            let index = self.index.len();
            alike.iter().for_each(|&k| self.index.extend_from_slice(list(particles[k])));
            let read = || self.index[index..].iter().copied();
            self.groups.push(Group {
                neighbours: size(alike[0]) as u32,
                particles: self.particles.len() as u32,
                index: index as u32,
                seen: [read().min().unwrap_or(0), read().max().unwrap_or(0)],
            });
            self.particles.extend(alike.iter().map(|&k| particles[k]));
            self.coefficients.extend(alike.iter().filter_map(|&k| starts.get(k)));
        }
    }

    /// Computes some coordinates of the targets of some groups' particles.
    pub fn sweep<T: Real, const P: usize>(
        &self,
        groups: Range<usize>,
        coefficients: &Coefficients,
        components: &mut [Component<'_, T>; P],
        terms: &Terms<'_, T>,
    ) {
        for group in groups {
            let end = self.groups.get(group + 1).map_or(self.particles.len(), |next| next.particles as usize);
            let group = self.groups[group];
            let particles = group.particles as usize..end;
            let size = group.neighbours as usize;
            let index = &self.index[group.index as usize..][..size * particles.len()];
            let rows = self.coefficients.get(particles.clone()).unwrap_or_default();
            let all = Alike { particles: &self.particles[particles], rows, index, seen: group.seen, terms };
            match (coefficients, size) {
                (Coefficients::Equal, 1) => all.sweep::<1, P>(components),
                (Coefficients::Equal, 2) => all.sweep::<2, P>(components),
                (Coefficients::Equal, 3) => all.sweep::<3, P>(components),
                (Coefficients::Equal, 4) => all.sweep::<4, P>(components),
                (Coefficients::Equal, 5) => all.sweep::<5, P>(components),
                (Coefficients::Equal, 6) => all.sweep::<6, P>(components),
                (Coefficients::Equal, 7) => all.sweep::<7, P>(components),
                (Coefficients::Equal, 8) => all.sweep::<8, P>(components),
                _ => all.sweep_of_any(size, coefficients, components),
            }
            // A particle without neighbours stays.
            if size > 0 {
                all.complete(components);
            }
        }
    }
}

/// The particles of a group and their lists, all of one length.
struct Alike<'a, T> {
    particles: &'a [u32],
    /// Where the coefficients of each begin; none where all count the same.
    rows: &'a [u32],
    index: &'a [u32],
    seen: [u32; 2],
    terms: &'a Terms<'a, T>,
}

impl<T: Real> Alike<'_, T> {
    fn sweep<const N: usize, const P: usize>(&self, components: &mut [Component<'_, T>; P]) {
        self.assert_within(components);
        match components.each_ref().map(|component| component.rest) {
            rests if rests.iter().all(Option::is_none) => {
                self.fill::<N, P>(components, |_| [T::default(); P]);
            }
            rests => {
                self.fill::<N, P>(components, |j| {
                    rests.map(|rest| rest.map_or(T::default(), |rest| rest[j]))
                });
            }
        }
    }

    /// Computes what [`Rule::target`](crate::flock::rules::Rule::target) does: the rest offset is added to the mean,
    /// also where it is zero, which makes 0.0 of -0.0.
    #[inline(always)]
    fn fill<const N: usize, const P: usize>(
        &self,
        components: &mut [Component<'_, T>; P],
        rest: impl Fn(usize) -> [T; P],
    ) {
        let is_large = components.iter().any(|component| component.present.len() > PREFETCHED_BEYOND);
        // Where particle number 0 would stand: what a component says would be read again after every store.
        let present = components.each_ref().map(|c| c.present.as_ptr().wrapping_sub(c.seen_from));
        let next = components.each_mut().map(|c| c.next.as_mut_ptr().wrapping_sub(c.begin));
        let (lists, _) = self.index.as_chunks::<N>();
        for (&j, list) in self.particles.iter().zip(lists) {
            let j = j as usize;
            if is_large {
                let farthest = list.iter().max().map_or(0, |&k| k as usize);
                prefetch(std::ptr::from_ref(list).wrapping_add(AHEAD[1]));
                present.iter().for_each(|present| prefetch(present.wrapping_add(farthest + AHEAD[0])));
                next.iter().for_each(|next| prefetch(next.wrapping_add(j + AHEAD[0])));
            }
            let mut sum = [T::default(); P];
            for (k, &there) in list.iter().enumerate() {
                for (sum, present) in sum.iter_mut().zip(&present) {
                    // SAFETY: `seen` bounds every index of the group from both sides, being taken from these very lists
                    // when they were copied (they never change), and it was asserted to lie within the component.
                    let value = unsafe { *present.wrapping_add(there as usize) };
                    *sum = if k == 0 { value } else { *sum + value };
                }
            }
            let rest = rest(j);
            for p in 0..P {
                let target = sum[p] / T::of(N as f64) + rest[p];
                // SAFETY: the particles ascend, and the first and the last were asserted to lie within the component.
                // Measured, with the above: lists are swept 1.5 times as fast as with a check of each index.
                unsafe { *next[p].wrapping_add(j) = target };
            }
        }
    }

    /// Makes targets of the means.
    fn complete<const P: usize>(&self, components: &mut [Component<'_, T>; P]) {
        if self.terms.is_empty() {
            return;
        }
        for &j in self.particles {
            let j = j as usize;
            let mut target = components.each_ref().map(|c| [c.next[j - c.begin]]);
            if let (Some(along), [x, y]) = (self.terms.couples_along(), &mut target[..]) {
                let (along, across) = if along == 0 { (x, y) } else { (y, x) };
                self.terms.contract(j, along, across);
            }
            for (component, target) in components.iter_mut().zip(&mut target) {
                self.terms.overshoot(
                    component.axis,
                    j,
                    &component.present[j - component.seen_from..],
                    target,
                );
                component.next[j - component.begin] = target[0];
            }
        }
    }

    /// Any number of neighbours that count anything.
    fn sweep_of_any<const P: usize>(
        &self,
        size: usize,
        coefficients: &Coefficients,
        components: &mut [Component<'_, T>; P],
    ) {
        for (at, &j) in self.particles.iter().enumerate() {
            let (j, list) = (j as usize, &self.index[at * size..][..size]);
            let of = |k: u32| components.each_ref().map(|c| c.present[k as usize - c.seen_from]);
            let mut target = of(j as u32);
            if !list.is_empty() {
                let mean = match coefficients {
                    Coefficients::Equal => weighted(list.iter().map(|&k| (T::of(1.0), of(k))), size as f64),
                    Coefficients::Scalar(all) => {
                        let (weights, total) = all[self.rows[at] as usize..].split_at(size);
                        weighted(list.iter().zip(weights).map(|(&k, &w)| (T::of(w), of(k))), total[0])
                    }
                    Coefficients::Matrix(all) => {
                        let (blocks, _) = all[self.rows[at] as usize..].as_chunks::<4>();
                        let pairs = list.iter().zip(blocks);
                        pairs.fold([T::of(-0.0); P], |sum, (&k, block)| plus(sum, block, of(k)))
                    }
                };
                let rest = components.each_ref().map(|c| c.rest.map_or(T::default(), |rest| rest[j]));
                let mut all: [T; P] = std::array::from_fn(|p| mean[p] + rest[p]);
                let force = components.each_ref().map(|c| c.force.map(|force| force[j]));
                if let (Coefficients::Matrix(blocks), [Some(_), ..]) = (coefficients, &force[..]) {
                    let compliance = &blocks[self.rows[at] as usize..].as_chunks::<4>().0[size];
                    all = plus(all, compliance, force.map(Option::unwrap_or_default));
                }
                target = all;
            }
            for (component, target) in components.iter_mut().zip(target) {
                component.next[j - component.begin] = target;
            }
        }
    }

    fn assert_within<const P: usize>(&self, components: &[Component<'_, T>; P]) {
        let [first, last] = self.seen.map(|k| k as usize);
        let swept = [self.particles.first(), self.particles.last()].map(|j| j.map_or(0, |&j| j as usize));
        for component in components {
            let end = component.seen_from + component.present.len();
            assert!(
                component.seen_from <= first && last < end,
                "a list names a particle beyond the component"
            );
            let end = component.begin + component.next.len();
            assert!(
                component.begin <= swept[0] && swept[1] < end,
                "a particle beyond the component has a list"
            );
        }
    }
}

/// The mean of vectors with weights, which add up to a total.
#[inline(always)]
fn weighted<T: Real, const P: usize>(pairs: impl Iterator<Item = (T, [T; P])>, total: f64) -> [T; P] {
    let add = |sum: [T; P], (weight, v): (T, [T; P])| std::array::from_fn(|p| sum[p] + weight * v[p]);
    pairs.fold([T::of(-0.0); P], add).map(|sum| sum / T::of(total))
}

/// A sum and a matrix times a vector.
#[inline(always)]
fn plus<T: Real, const P: usize>(sum: [T; P], block: &[f64; 4], v: [T; P]) -> [T; P] {
    let [xx, xy, yx, yy] = block.map(T::of);
    let ([x, y], [sum_x, sum_y]) = (&v[..], &sum[..]) else { unreachable!("matrices need both coordinates") };
    let all = [*sum_x + (xx * *x + xy * *y), *sum_y + (yx * *x + yy * *y)];
    std::array::from_fn(|p| all[p])
}

/// Has the caches fetch what stands there, if anything does.
#[inline(always)]
fn prefetch<T>(place: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch reads nothing and never faults, whatever the address.
    unsafe {
        std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(place.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = place;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(index: &[Vec<u32>], particles: &[u32], present: &[f64], seen_from: usize) -> Vec<f64> {
        let mut lists = Gathers::default();
        lists.push_band(particles, &[], |j| &index[j as usize]);
        let (begin, mut next) = (particles[0] as usize, vec![-1.0; 8]);
        let rest = (0..8).map(|j| 100.0 * f64::from(j)).collect::<Vec<_>>();
        let component =
            Component { axis: 0, seen_from, present, rest: Some(&rest), force: None, begin, next: &mut next };
        lists.sweep(0..lists.group_count(), &Coefficients::Equal, &mut [component], &Terms::NONE);
        next
    }

    #[test]
    fn each_takes_the_mean_of_those_on_its_own_list() {
        let index = [vec![], vec![3, 2], vec![4], vec![], vec![2, 3, 5], vec![2; 9]];
        let next = sweep(&index, &[1, 2, 3, 4, 5], &[20.0, 30.0, 40.0, 50.0], 2);
        assert_eq!(next, [125.0, 240.0, 30.0, 100.0 / 3.0 + 400.0, 520.0, -1.0, -1.0, -1.0]);
    }

    #[test]
    #[should_panic(expected = "beyond the component")]
    fn a_particle_behind_the_end_of_what_is_there_is_never_read() {
        sweep(&[vec![1], vec![0, 2]], &[0, 1], &[20.0, 30.0], 0);
    }

    #[test]
    #[should_panic(expected = "has a list")]
    fn nothing_is_written_behind_the_end_of_what_is_there() {
        sweep(&vec![vec![0]; 12], &[1, 9], &[20.0, 30.0], 0);
    }

    #[test]
    #[should_panic(expected = "beyond the component")]
    fn a_particle_before_what_is_there_is_never_read() {
        sweep(&[vec![1], vec![0, 2]], &[1], &[20.0, 30.0], 1);
    }
}
