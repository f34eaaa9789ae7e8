//! Conditions on single particles, by which they take roles.

/// A condition on one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    pub quantity: Quantity,
    pub above: Option<f64>,
    pub below: Option<f64>,
}

impl Condition {
    pub fn holds(&self, value: f64) -> bool {
        self.above.is_none_or(|bound| value > bound) && self.below.is_none_or(|bound| value < bound)
    }
}

/// The quantity that a condition tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    X,
    Y,
    Displacement,
    Pe1,
    Pe2,
}
