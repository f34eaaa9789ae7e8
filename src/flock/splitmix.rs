//! splitmix64 (Steele, Lea and Flood 2014): a few lines, the same on every machine.

/// Increment of a stream's state from draw to draw.
pub(crate) const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// The bits of a state spread over the whole number: neighbouring states give numbers that have nothing in common.
pub(crate) fn mixed(state: u64) -> u64 {
    let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_stream_of_seed_zero_is_met() {
        // First outputs of the reference implementation (S. Vigna, prng.di.unimi.it/splitmix64.c) from state 0.
        let drawn: Vec<u64> = (1..=3_u64).map(|k| mixed(k.wrapping_mul(STEP))).collect();
        assert_eq!(drawn, [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f]);
    }
}
