//! Lifecycle of a managed node: the machine and the services that drive it.
//!
//! States, transitions, ids and labels are those of `lifecycle_msgs` and of ROS 2's own machine.

mod machine;
mod served;

pub use machine::{Goal, Machine, State, Transition};
pub use served::Lifecycle;
