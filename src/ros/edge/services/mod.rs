//! Structs of the standard services: fields in the order of the `.srv` and `.msg` files.

pub mod lifecycle_msgs;
pub mod rcl_interfaces;
pub mod std_srvs;

pub use crate::ros::messages::builtin_interfaces::Time;
pub use crate::ros::messages::rosgraph_msgs;

use serde::{Deserialize, Deserializer, Serialize};

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
    use crate::ros::edge::wire::{Order, decode, encode};

    #[test]
    fn nothing_is_one_byte_out_and_any_bytes_in() {
        let mut bytes = Vec::new();
        encode(&Empty, &mut bytes).expect("plain");
        assert_eq!(bytes, [0]);
        assert_eq!(decode::<Empty>(&[], Order::Little), Ok(Empty));
        assert_eq!(decode::<Empty>(&[0], Order::Big), Ok(Empty));
    }
}
