//! The edge to ROS 2: what the node reads from its command line, the messages it speaks, the node itself.

#[allow(
    missing_docs,
    reason = "not written out yet: flags, names and values are those of `rcl`, named as there"
)]
pub mod arguments;
#[allow(missing_docs, reason = "not written out yet")]
pub mod edge;
mod network;
#[allow(missing_docs, reason = "not written out yet: the program and the recordings are its users")]
pub mod node;
#[allow(missing_docs, reason = "not written out yet: the program is its user")]
pub mod robots;
