//! One quantity of every particle in one frame, as whole multiples of a power of two.
//!
//! A quantum that is a power of two is shared by frames of like range, so that a particle at rest has the same
//! code in each and costs nothing once frames are written as differences.

use serde::{Deserialize, Serialize};

/// Quanta no coarser than the range asks for are kept through this many halvings of the range: frames then
/// keep sharing them.
const HYSTERESIS: i32 = 2;
/// Smallest quantum: 2^-1000 is still a normal number.
const LEAST_EXPONENT: i32 = -1000;
/// Whole numbers up to this power of two are exact in a double, which is what the browser has.
const EXACT_BITS: i32 = 52;

/// Codes of a quantity, shape \[count\]: the value is `(base + code) 2^exponent`, and the largest code means
/// that there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuantizedChannel {
    pub exponent: i32,
    pub base: i64,
    pub bits: u32,
    low: Vec<u16>,
    /// The bits above the lowest sixteen; empty where there are none.
    high: Vec<u8>,
}

impl QuantizedChannel {
    /// Codes of `bits` bits, 2 to 24; values that are not finite have none. `before` is the same quantity in the
    /// frame before.
    pub fn of(values: &[f64], bits: u32, before: Option<&QuantizedChannel>) -> Self {
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low.is_finite() { (low, high) } else { (0.0, 0.0) };
        let exponent = exponent(low, high, bits, before.map(|track| track.exponent));
        let scale = (-f64::from(exponent)).exp2();
        let base = (low * scale).round() as i64;
        let nothing = none(bits);
        // Half is added before the cut, instead of rounding: that is a call, and this the loop that costs.
        let above = 0.5 - base as f64;
        let code = |&value: &f64| {
            let code = (value * scale + above) as u32;
            if value.is_finite() { code.min(nothing - 1) } else { nothing }
        };
        let mut track =
            Self { exponent, base, bits, low: Vec::with_capacity(values.len()), high: Vec::new() };
        if bits > 16 {
            track.high.extend(values.iter().map(|value| (code(value) >> 16) as u8));
        }
        track.low.extend(values.iter().map(|value| code(value) as u16));
        track
    }

    /// Writes the codes, shape \[count\].
    pub fn read(&self, codes: &mut Vec<u32>) {
        codes.clear();
        codes.extend(self.low.iter().map(|&low| u32::from(low)));
        for (code, &high) in codes.iter_mut().zip(&self.high) {
            *code |= u32::from(high) << 16;
        }
    }

    /// The values, each within half a quantum; NaN where there is none.
    pub fn values(&self) -> Vec<f64> {
        let mut codes = Vec::new();
        self.read(&mut codes);
        let (quantum, nothing) = (f64::from(self.exponent).exp2(), none(self.bits));
        let value = |code: u32| (self.base + i64::from(code)) as f64 * quantum;
        codes.into_iter().map(|code| if code == nothing { f64::NAN } else { value(code) }).collect()
    }

    /// Bytes of a code in memory and in the file.
    pub fn bytes(bits: u32) -> usize {
        bits.div_ceil(8) as usize
    }
}

/// The code of a value that there is not.
pub fn none(bits: u32) -> u32 {
    (1 << bits) - 1
}

/// The finest quantum, or the one of the frame before if that is nearly as fine.
fn exponent(low: f64, high: f64, bits: u32, before: Option<i32>) -> i32 {
    // One code means no value, one is lost to rounding at the ends.
    let codes = f64::from(none(bits) - 2);
    // Halves, so that a range of the largest doubles stays finite.
    let range = 2.0 * (0.5 * high - 0.5 * low) / codes;
    let size = low.abs().max(high.abs());
    let exact = if size > 0.0 { size.log2().ceil() as i32 - EXACT_BITS } else { LEAST_EXPONENT };
    let asked = if range > 0.0 { range.log2().ceil() as i32 } else { exact };
    let finest = asked.max(exact).max(LEAST_EXPONENT);
    match before {
        Some(before) if (finest..=finest + HYSTERESIS).contains(&before) => before,
        // All alike, and any quantum does that they are a multiple of: the frame before decides.
        Some(before) if range == 0.0 && size == 0.0 => before,
        _ => finest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(track: &QuantizedChannel, particle: usize) -> u32 {
        let mut codes = Vec::new();
        track.read(&mut codes);
        codes[particle]
    }

    #[test]
    fn a_value_comes_back_within_half_a_quantum_and_the_quantum_fits_the_range() {
        for bits in [12, 16, 24] {
            for (low, high) in [(-1.0, 3.0), (1e6, 1e6 + 1.0), (-3e-9, 0.0), (0.0, 1e300), (5.0, 5.0)] {
                let values: Vec<f64> = (0..=50).map(|k| low + (high - low) * f64::from(k) / 50.0).collect();
                let track = QuantizedChannel::of(&values, bits, None);
                let quantum = f64::from(track.exponent).exp2();
                assert!(
                    quantum <= (2.0 * (high - low) / f64::from(none(bits) - 2)).max(1e-9),
                    "{bits} {low}"
                );
                for (found, wanted) in track.values().iter().zip(&values) {
                    let off = (found - wanted).abs();
                    assert!(off <= 0.5 * quantum, "{bits}: {wanted} off by {off}");
                }
            }
        }
    }

    #[test]
    fn a_value_that_is_not_finite_has_the_code_of_no_value() {
        let track = QuantizedChannel::of(&[1.0, f64::NAN, f64::INFINITY, 2.0], 12, None);
        assert_eq!([code(&track, 1), code(&track, 2)], [none(12); 2]);
        assert!(code(&track, 3) < none(12));
        let is_there: Vec<bool> = track.values().iter().map(|value| value.is_finite()).collect();
        assert_eq!(is_there, [true, false, false, true]);
    }

    #[test]
    fn frames_of_like_range_share_a_quantum_so_that_rest_costs_nothing() {
        let first = QuantizedChannel::of(&[0.0, 0.25, 1.0], 16, None);
        let second = QuantizedChannel::of(&[0.0, 0.25, 0.6], 16, Some(&first));
        assert_eq!((first.exponent, code(&first, 1)), (second.exponent, code(&second, 1)));
        let wider = QuantizedChannel::of(&[0.0, 0.25, 2.7], 16, Some(&second));
        assert_eq!(wider.exponent, first.exponent + 1);
    }
}
