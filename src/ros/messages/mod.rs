//! The messages of the node's topics, one file per interface package.
//!
//! A message on the wire (CDR) has no field names: **the order of the fields of each struct is the
//! format**. `tests/ros_messages` holds every struct here against its `.msg` text, and against a
//! reference encoder byte for byte. Names, units and frames are those of the packages (REP 103: SI,
//! right-handed; REP 105: frames).

pub mod builtin_interfaces;
pub mod definitions;
pub mod diagnostic_msgs;
pub mod flockform_msgs;
pub mod geometry_msgs;
pub mod nav_msgs;
pub mod rosgraph_msgs;
pub mod sensor_msgs;
pub mod std_msgs;
pub mod tf2_msgs;
pub mod visualization_msgs;

pub use crate::ros::edge::Message;

/// Names the messages of one package after their structs.
macro_rules! messages {
    ($package:literal: $($message:ident),+ $(,)?) => {$(
        impl ros2_client::Message for $message {}
        impl $crate::ros::edge::Message for $message {
            const PACKAGE: &'static str = $package;
            const NAME: &'static str = stringify!($message);
        }
    )+};
}
use messages;
