//! `std_msgs`: the header that stamped messages begin with, colours, and a message that says nothing but that it was sent.

use serde::{Deserialize, Deserializer, Serialize};

use super::builtin_interfaces::Time;
use super::messages;

messages! { "std_msgs";
    /// When, and in which frame.
    Header {
        stamp: Time,
        /// Coordinate frame, without a leading slash.
        frame_id: String,
    }

    /// A colour, each part from 0 to 1.
    #[derive(Copy)]
    ColorRGBA {
        r: f32,
        g: f32,
        b: f32,
        /// Opacity.
        a: f32,
    }
}

messages!("std_msgs": Empty);

/// A struct without fields: one zero byte on the wire, which some peers leave out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Empty;

impl Serialize for Empty {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u8(0)
    }
}

impl<'de> Deserialize<'de> for Empty {
    fn deserialize<D: Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Ok(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::wire::{Order, decode, encode};

    #[test]
    fn nothing_is_one_byte_out_and_any_bytes_in() {
        let mut bytes = Vec::new();
        encode(&Empty, &mut bytes).expect("plain");
        assert_eq!(bytes, [0]);
        assert_eq!(decode::<Empty>(&[], Order::Little), Ok(Empty));
        assert_eq!(decode::<Empty>(&[0], Order::Big), Ok(Empty));
    }
}
