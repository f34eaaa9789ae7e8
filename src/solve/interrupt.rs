//! A flag that ends a solve before it is done.

use std::sync::atomic::{AtomicBool, Ordering};

/// Looked at before each iteration of a solver; what raises the flag, a signal or a button, is the caller's business.
#[derive(Clone, Copy, Debug, Default)]
pub struct Interrupt(Option<&'static AtomicBool>);

impl Interrupt {
    /// Ends what looks at it once `flag` is raised.
    pub fn new(flag: &'static AtomicBool) -> Self {
        Self(Some(flag))
    }

    /// Whether to end; never, where it has no flag.
    pub fn is_raised(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// Two requests are the same whatever may interrupt them.
impl PartialEq for Interrupt {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
