//! Round values along an axis, and how they are written.

use super::letters::text_width;

/// Values at multiples of 1, 2 or 5 times a power of ten.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    pub values: Vec<f64>,
    /// Power of ten that is taken out of the labels and into the axis's name.
    exponent: i32,
    decimals: usize,
}

impl Ticks {
    /// Ticks within `low` to `high`, at most as many steps as `most` apart.
    pub fn within(low: f64, high: f64, most: f64) -> Self {
        let step = round_step((high - low) / most.max(1.0));
        let slack = 1e-9;
        Self::multiples(step, (low / step - slack).ceil(), (high / step + slack).floor())
    }

    /// The fewest ticks that enclose `low` to `high` in steps of which `most` would fit.
    pub fn around(low: f64, high: f64, most: f64) -> Self {
        let step = round_step((high - low) / most.max(1.0));
        let slack = 1e-9;
        Self::multiples(step, (low / step + slack).floor(), (high / step - slack).ceil())
    }

    /// A single value.
    pub fn single(value: f64) -> Self {
        let exponent = exponent_for(value.abs());
        let decimals = if value == 0.0 { 0 } else { 3 };
        Self { values: vec![value], exponent, decimals }
    }

    fn multiples(step: f64, first: f64, last: f64) -> Self {
        // However wide the range, no axis has more ticks than it can show.
        const MOST: usize = 64;
        let count = ((last - first) as usize).min(MOST);
        let values: Vec<f64> = (0..=count).map(|n| (first + n as f64) * step).collect();
        let exponent = exponent_for(values.iter().fold(0.0, |most, value| most.max(value.abs())));
        let decimals = (-(step / 10f64.powi(exponent)).log10().floor()).clamp(0.0, 12.0) as usize;
        Self { values, exponent, decimals }
    }

    pub fn label(&self, value: f64) -> String {
        let text = format!("{:.*}", self.decimals, value / 10f64.powi(self.exponent));
        match text.strip_prefix('-') {
            Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
            Some(digits) => format!("\u{2212}{digits}"),
            None => text,
        }
    }

    /// Width of the widest label in letters of this size \[px\].
    pub fn widest_label(&self, size: f64) -> f64 {
        self.values.iter().map(|&value| text_width(&self.label(value), size)).fold(0.0, f64::max)
    }

    /// `quantity [unit]`, with the power of ten that the labels leave out; a count has no unit.
    pub fn axis_name(&self, quantity: &str, unit: &str) -> String {
        let power = power_of_ten(self.exponent);
        match (self.exponent, unit) {
            (0, "") => quantity.to_owned(),
            (0, unit) => format!("{quantity} [{unit}]"),
            (_, "") => format!("{quantity} [{power}]"),
            (_, unit) => format!("{quantity} [{power} {unit}]"),
        }
    }
}

/// `10` with this exponent, as it is printed.
pub fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(exponent))
}

/// A power of a thousand for numbers that would need many digits.
fn exponent_for(largest: f64) -> i32 {
    if largest == 0.0 || (1e-2..1e5).contains(&largest) {
        0
    } else {
        ((largest.log10() / 3.0).floor() * 3.0) as i32
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    if !(least.is_finite() && least > f64::MIN_POSITIVE) {
        return 1.0;
    }
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .map(|m| m * decade)
        .into_iter()
        .find(|&s| s >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

fn superscript(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    number.to_string().chars().map(|c| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &Ticks) -> Vec<String> {
        ticks.values.iter().map(|&value| ticks.label(value)).collect()
    }

    #[test]
    fn ticks_are_round_and_lie_within_the_axis() {
        assert_eq!(labels(&Ticks::within(-0.7, 11.2, 6.0)), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels(&Ticks::within(-0.31, 0.3, 4.0)), ["\u{2212}0.2", "0.0", "0.2"]);
    }

    #[test]
    fn ticks_around_a_range_enclose_it() {
        let ticks = Ticks::around(0.0, 0.93, 10.0);
        assert_eq!((ticks.values[0], ticks.values.len()), (0.0, 11), "{ticks:?}");
        assert!(ticks.values[10] >= 0.93);
    }

    #[test]
    fn small_and_large_numbers_move_their_power_of_ten_to_the_axis() {
        let small = Ticks::within(0.0, 4e-5, 4.0);
        assert_eq!(labels(&small), ["0", "10", "20", "30", "40"]);
        assert_eq!(small.axis_name("PE1", "mm²"), "PE1 [10⁻⁶ mm²]");
        assert_eq!(Ticks::within(0.0, 3e6, 3.0).axis_name("x", "m"), "x [10⁶ m]");
    }

    #[test]
    fn ranges_without_extent_or_end_still_have_ticks() {
        for (low, high) in [(1.0, 1.0), (0.0, f64::INFINITY), (-1e300, 1e300), (f64::NAN, 1.0)] {
            assert!(Ticks::within(low, high, 5.0).values.len() <= 65);
        }
    }
}
