//! Points that may be near those of one cell, and the test of which are.
//!
//! Most of a neighbour query is this test: three candidates for every neighbour. It is compiled twice,
//! as the loops of [`lanes`](crate::flock::lanes) are.

use std::ops::Range;

/// Squared distances decide, but for those this near to the squared radius \[1\].
const DOUBTFUL: f64 = 1e-14;

/// Radii whose squares are neither infinite nor anywhere near underflow \[length\].
const SQUARABLE: Range<f64> = 1e-140..1e140;

/// Points copied and tested at once.
const LANES: usize = 8;

/// Points in parallel arrays, which are longer by [`LANES`]: the last are read with as many at once.
#[derive(Clone, Debug, Default)]
pub struct Slots {
    pub members: Vec<u32>,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
}

impl Slots {
    /// Makes room for so many points.
    pub fn resize(&mut self, count: usize) {
        self.members.resize(count + LANES, 0);
        self.x.resize(count + LANES, 0.0);
        self.y.resize(count + LANES, 0.0);
    }

    #[inline]
    pub fn set(&mut self, slot: usize, member: u32, [x, y]: [f64; 2]) {
        (self.members[slot], self.x[slot], self.y[slot]) = (member, x, y);
    }

    /// The points in a stretch of slots within `radius` of a place \[length\].
    pub fn near(&self, run: Range<usize>, here: [f64; 2], radius: f64) -> impl Iterator<Item = u32> {
        let points = self.members[run.clone()].iter().zip(self.x[run.clone()].iter().zip(&self.y[run]));
        let near = points.filter(move |&(_, (&x, &y))| (x - here[0]).hypot(y - here[1]) <= radius);
        near.map(|(&member, _)| member)
    }
}

/// Points that may be near those of one cell.
#[derive(Clone, Debug, Default)]
pub struct Candidates {
    /// As many as there are; then some that are infinitely far away.
    slots: Slots,
    count: usize,
    near: Vec<u64>,
}

impl Candidates {
    /// Replaces them by the points in these stretches of slots.
    pub fn gather(&mut self, slots: &Slots, around: &[Range<usize>]) {
        let count = around.iter().map(|run| run.len()).sum::<usize>();
        if self.slots.members.len() < count + 2 * LANES {
            self.slots.resize(2 * count + LANES);
            self.near.resize(2 * count, 0);
        }
        let mut end = 0;
        for run in around {
            // Without calls for a few bytes each: what is copied too much the next run overwrites.
            for k in (0..run.len()).step_by(LANES) {
                let (from, to) = (run.start + k..run.start + k + LANES, end + k..end + k + LANES);
                self.slots.members[to.clone()].copy_from_slice(&slots.members[from.clone()]);
                self.slots.x[to.clone()].copy_from_slice(&slots.x[from.clone()]);
                self.slots.y[to].copy_from_slice(&slots.y[from]);
            }
            end += run.len();
        }
        self.slots.x[end..end + LANES].fill(f64::INFINITY);
        self.count = end;
    }

    /// Room that the list of one point asks for.
    pub fn room(&self) -> usize {
        self.count + LANES
    }

    /// Lists the others within `radius` \[length\] of each of the numbers `own`, one list after the other
    /// in `lists`, which has [`Candidates::room`] for each; and how long each is.
    pub fn list_near(&mut self, own: Range<usize>, radius: f64, lists: &mut [u32], lengths: &mut Vec<u32>) {
        if !SQUARABLE.contains(&radius) {
            return each(own, lists, lengths, |k, list| self.keep_exactly(k, radius, list));
        }
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt") {
            // SAFETY: the processor has AVX2 and POPCNT, which is all that the callee asks for. Measured:
            // lists are made 1.3 times as fast.
            return unsafe { avx2::list_near(self, own, radius, lists, lengths) };
        }
        self.list_near_anywhere(own, radius, lists, lengths);
    }

    fn list_near_anywhere(
        &mut self,
        own: Range<usize>,
        radius: f64,
        lists: &mut [u32],
        lengths: &mut Vec<u32>,
    ) {
        each(own, lists, lengths, |k, list| self.keep_near(k, radius, list));
    }

    /// Writes those near number `own`; returns how many.
    #[inline(always)]
    fn keep_near(&mut self, own: usize, radius: f64, list: &mut [u32]) -> usize {
        let count = self.count;
        let Slots { members, x, y } = &self.slots;
        let near = &mut self.near[..count];
        if !mark_near((&x[..count], &y[..count]), [x[own], y[own]], bounds(radius), near) {
            return self.keep_exactly(own, radius, list);
        }
        near[own] = 0;
        let list = &mut list[..=count];
        let mut kept = 0;
        // Written whether near or not, and kept by going on: no branch to be mispredicted.
        for (&member, &near) in members.iter().zip(&*near) {
            list[kept] = member;
            kept += near as usize;
        }
        kept
    }

    /// The same where squares are too coarse.
    #[cold]
    fn keep_exactly(&self, own: usize, radius: f64, list: &mut [u32]) -> usize {
        let Slots { members, x, y } = &self.slots;
        let near = self.slots.near(0..self.count, [x[own], y[own]], radius);
        let others = near.filter(|&member| member != members[own]);
        others.zip(list).map(|(member, place)| *place = member).count()
    }
}

/// Writes a list for each number, one after the other, and how long it is.
#[inline(always)]
fn each(
    own: Range<usize>,
    lists: &mut [u32],
    lengths: &mut Vec<u32>,
    mut keep: impl FnMut(usize, &mut [u32]) -> usize,
) {
    let mut end = 0;
    lengths.clear();
    for k in own {
        let length = keep(k, &mut lists[end..]);
        lengths.push(length as u32);
        end += length;
    }
}

/// Squared distances up to the first are surely near, beyond the second surely not \[length^2\].
fn bounds(radius: f64) -> [f64; 2] {
    [radius * radius * (1.0 - DOUBTFUL), radius * radius * (1.0 + DOUBTFUL)]
}

/// Marks whose squared distance is within the radius by 1, the others by 0; false if one of them is so
/// near to the radius that squares are too coarse. As wide as the coordinates, for the sake of vectors.
#[inline(always)]
fn mark_near((x, y): (&[f64], &[f64]), here: [f64; 2], bounds: [f64; 2], near: &mut [u64]) -> bool {
    let [surely, hardly] = bounds;
    let mut doubtful = 0;
    for ((near, &x), &y) in near.iter_mut().zip(x).zip(y) {
        let (dx, dy) = (x - here[0], y - here[1]);
        let square = dx * dx + dy * dy;
        *near = u64::from(square <= surely);
        doubtful += u64::from(square <= hardly) - *near;
    }
    doubtful == 0
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    use super::*;

    /// For each set of lanes their numbers, one a byte, the lowest first.
    static PACKED: [u64; 1 << LANES] = packed();

    const fn packed() -> [u64; 1 << LANES] {
        let mut all = [0; 1 << LANES];
        let mut set = 0;
        while set < all.len() {
            let (mut lane, mut kept) = (0, 0);
            while lane < LANES {
                if set >> lane & 1 == 1 {
                    all[set] |= (lane as u64) << (8 * kept);
                    kept += 1;
                }
                lane += 1;
            }
            set += 1;
        }
        all
    }

    /// The same as [`Candidates::list_near_anywhere`].
    #[target_feature(enable = "avx2,popcnt")]
    pub fn list_near(
        around: &Candidates,
        own: Range<usize>,
        radius: f64,
        lists: &mut [u32],
        lengths: &mut Vec<u32>,
    ) {
        let mut end = 0;
        lengths.clear();
        for k in own {
            let length = keep_near(around, k, radius, &mut lists[end..]);
            lengths.push(length as u32);
            end += length;
        }
    }

    #[target_feature(enable = "avx2,popcnt")]
    #[inline]
    fn keep_near(around: &Candidates, own: usize, radius: f64, list: &mut [u32]) -> usize {
        let [surely, hardly] = bounds(radius);
        let (surely, hardly) = (_mm256_set1_pd(surely), _mm256_set1_pd(hardly));
        let slots = &around.slots;
        let here = [_mm256_set1_pd(slots.x[own]), _mm256_set1_pd(slots.y[own])];
        let filled = around.count.next_multiple_of(LANES);
        let (x, y) = (slots.x[..filled].as_chunks().0, slots.y[..filled].as_chunks().0);
        let points = slots.members[..filled].as_chunks().0.iter().zip(x.iter().zip(y));
        let (mut kept, mut doubtful) = (0, _mm256_setzero_pd());
        for (chunk, (members, (x, y))) in points.enumerate() {
            let (low, high) = (squares(x, y, 0, here), squares(x, y, 4, here));
            let (near_low, near_high) = (within(low, surely), within(high, surely));
            doubtful = _mm256_or_pd(doubtful, _mm256_xor_pd(near_low, within(low, hardly)));
            doubtful = _mm256_or_pd(doubtful, _mm256_xor_pd(near_high, within(high, hardly)));
            let near = _mm256_movemask_pd(near_low) | _mm256_movemask_pd(near_high) << 4;
            let itself = if own / LANES == chunk { 1 << (own % LANES) } else { 0 };
            let near = near as usize & !itself;
            let order = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(PACKED[near] as i64));
            let packed = _mm256_permutevar8x32_epi32(load(members), order);
            store(packed, (&mut list[kept..kept + LANES]).try_into().expect("as many"));
            kept += near.count_ones() as usize;
        }
        if _mm256_movemask_pd(doubtful) == 0 { kept } else { around.keep_exactly(own, radius, list) }
    }

    /// Squared distances of four, from lane `k` on.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn squares(x: &[f64; LANES], y: &[f64; LANES], k: usize, here: [__m256d; 2]) -> __m256d {
        let dx = _mm256_sub_pd(_mm256_set_pd(x[k + 3], x[k + 2], x[k + 1], x[k]), here[0]);
        let dy = _mm256_sub_pd(_mm256_set_pd(y[k + 3], y[k + 2], y[k + 1], y[k]), here[1]);
        _mm256_add_pd(_mm256_mul_pd(dx, dx), _mm256_mul_pd(dy, dy))
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn within(squares: __m256d, bound: __m256d) -> __m256d {
        _mm256_cmp_pd::<_CMP_LE_OQ>(squares, bound)
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn load(numbers: &[u32; LANES]) -> __m256i {
        // SAFETY: reads eight numbers of any alignment, as many as there are.
        unsafe { _mm256_loadu_si256(numbers.as_ptr().cast()) }
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn store(numbers: __m256i, place: &mut [u32; LANES]) {
        // SAFETY: writes eight numbers at any alignment, as many as there is room for.
        unsafe { _mm256_storeu_si256(place.as_mut_ptr().cast(), numbers) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square lattice of unit spacing, shaken where it is to have no distance twice.
    fn candidates(count: usize, shaken: f64) -> Candidates {
        let mut slots = Slots::default();
        slots.resize(count);
        for k in 0..count {
            let [i, j] = [k / 7, k % 7].map(|site| site as f64);
            let aside = shaken * (1.7 * k as f64).sin();
            slots.set(k, 3 * k as u32, [i + aside, j - 0.5 * aside]);
        }
        let mut around = Candidates::default();
        // In three stretches, of which each ends amid a chunk.
        let [first, second] = [count / 3, count - count / 4];
        around.gather(&slots, &[0..first, first..second, second..count]);
        around
    }

    #[test]
    fn the_width_of_the_vectors_changes_no_list() {
        for count in [1, 7, 8, 9, 33, 64, 100] {
            for (shaken, radius) in [(0.4, 1.9), (0.0, 2.0), (0.0, 5.0), (0.3, 1e150), (0.3, 1e-150)] {
                let mut around = candidates(count, shaken);
                let room = count * around.room();
                let (mut lists, mut lengths) = ([vec![0; room], vec![0; room]], [Vec::new(), Vec::new()]);
                around.list_near(0..count, radius, &mut lists[0], &mut lengths[0]);
                around.list_near_anywhere(0..count, radius.min(1e100), &mut lists[1], &mut lengths[1]);
                assert_eq!(lengths[0], lengths[1], "{count} {shaken} {radius}");
                let total: u32 = lengths[0].iter().sum();
                let [wide, narrow] = lists.each_ref().map(|list| &list[..total as usize]);
                assert_eq!(wide, narrow, "{count} {shaken} {radius}");
                let exact: Vec<u32> = (0..count)
                    .flat_map(|k| {
                        let mut list = vec![0; around.room()];
                        let kept = around.keep_exactly(k, radius, &mut list);
                        list.truncate(kept);
                        list
                    })
                    .collect();
                assert_eq!(wide, exact, "{count} {shaken} {radius}");
            }
        }
    }
}
