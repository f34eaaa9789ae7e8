//! Conditions on single particles, by which they take roles.

/// A condition on one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// The quantity that is tested.
    pub quantity: Quantity,
    /// Greatest value at which it does not hold; unbounded where there is none.
    pub above: Option<f64>,
    /// Least value at which it does not hold; unbounded where there is none.
    pub below: Option<f64>,
}

impl Condition {
    /// Whether a value of the quantity lies between the bounds, both excluded; always where there are none.
    pub fn holds(&self, value: f64) -> bool {
        self.above.is_none_or(|bound| value > bound) && self.below.is_none_or(|bound| value < bound)
    }
}

/// The quantity that a condition tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Present coordinate along x \[length\].
    X,
    /// Present coordinate along y \[length\].
    Y,
    /// Distance from the place in the reference configuration \[length\].
    Displacement,
    /// First pseudo-energy \[length^2\] ([`super::pseudo_energy::pe1`]).
    Pe1,
    /// Second pseudo-energy, the length of the last move \[length\] ([`super::pseudo_energy::pe2`]).
    Pe2,
}
