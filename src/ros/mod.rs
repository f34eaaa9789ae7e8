//! The edge to ROS 2: what the node reads from its command line, the messages it speaks, the node itself.

pub mod arguments;
pub mod edge;
pub mod messages;
pub mod node;
pub mod robots;
