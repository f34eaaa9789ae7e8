//! `std_msgs`: the header that stamped messages begin with, colours, and a message that says nothing but that it was sent.

use serde::{Deserialize, Serialize};

use super::builtin_interfaces::Time;
pub use crate::ros::edge::services::Empty;

/// When, and in which frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    pub stamp: Time,
    /// Coordinate frame, without a leading slash.
    pub frame_id: String,
}

/// A colour, each part from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorRGBA {
    pub r: f32,
    pub g: f32,
    pub b: f32,
    /// Opacity.
    pub a: f32,
}

super::messages!("std_msgs": Header, ColorRGBA, Empty);
