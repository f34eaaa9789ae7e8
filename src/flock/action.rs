//! Actions on a body while it is stepped.

use crate::geometry::shape::Segment;

/// Something that is done to the body at the beginning of a step; `T` is how particles follow.
#[derive(Clone, Debug)]
pub struct Action<T> {
    /// First step at which it holds.
    pub at: usize,
    /// The change.
    pub what: ActionKind<T>,
}

/// Kinds of actions.
#[derive(Clone, Debug)]
pub enum ActionKind<T> {
    /// The particles follow by this from now on.
    Follow(T),
    /// Every bond breaks that crosses this line where the body stands then \[length\].
    Cut(Segment),
}

impl<T> Action<T> {
    /// Whether bonds are cut.
    pub(crate) fn is_cut(&self) -> bool {
        matches!(self.what, ActionKind::Cut(_))
    }
}
