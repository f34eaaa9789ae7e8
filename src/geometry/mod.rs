//! Shapes of the plane, and the outlines that bound them.
//!
//! Lengths are in the unit of the shape's description, in the world frame; angles in radians, counter-clockwise.

pub mod box_tree;
mod crossings;
pub(crate) mod disjoint_sets;
pub(crate) mod lists;
pub mod locate;
pub mod meeting;
pub mod outline;
pub mod partition;
pub mod piece;
pub mod point;
pub mod portion;
pub mod shape;
pub mod specimen;

pub use point::Point;
