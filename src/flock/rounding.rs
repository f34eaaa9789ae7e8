//! Comparisons in which rounding has no say: what a file gives as 0.3 is 0.1 times 3.

/// Less than this is rounding: in units of what is compared, or \[m\].
pub const ROUNDING: f64 = 1e-9;

/// Whether a value is at most its limit, or above it by rounding alone.
pub fn at_most(value: f64, limit: f64) -> bool {
    value <= limit + ROUNDING * limit.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_alone_breaks_no_limit() {
        assert!(at_most(3.0 * 0.1, 0.3) && at_most(0.3, 3.0 * 0.1) && at_most(-0.3, -0.1 * 3.0));
        assert!(at_most(f64::INFINITY, f64::INFINITY) && !at_most(f64::INFINITY, 1e300));
        assert!(!at_most(0.301, 0.3) && !at_most(1e-300, 0.0) && !at_most(f64::NAN, 1.0));
    }
}
