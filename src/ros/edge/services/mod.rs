//! Structs of the standard services: fields in the order of the `.srv` and `.msg` files.

pub mod lifecycle_msgs;
pub mod rcl_interfaces;
pub mod rosgraph_msgs;
pub mod std_srvs;

use serde::{Deserialize, Deserializer, Serialize};

/// `builtin_interfaces/Time`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    pub sec: i32,
    pub nanosec: u32,
}

impl Time {
    /// From seconds since the epoch, rounded down to a nanosecond; out of range, the nearest that fits.
    pub fn from_seconds(seconds: f64) -> Self {
        let whole = seconds.floor();
        let nanosec = ((seconds - whole) * 1e9) as u32;
        Self { sec: whole as i32, nanosec: nanosec.min(999_999_999) }
    }

    /// Seconds since the epoch.
    pub fn seconds(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

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
    fn times_keep_their_nanoseconds() {
        assert_eq!(Time::from_seconds(12.5), Time { sec: 12, nanosec: 500_000_000 });
        assert_eq!(Time::from_seconds(-0.25), Time { sec: -1, nanosec: 750_000_000 });
        assert_eq!(Time { sec: 3, nanosec: 250_000_000 }.seconds(), 3.25);
        assert_eq!(Time::from_seconds(f64::NAN), Time::default());
    }

    #[test]
    fn nothing_is_one_byte_out_and_any_bytes_in() {
        let mut bytes = Vec::new();
        encode(&Empty, &mut bytes).expect("plain");
        assert_eq!(bytes, [0]);
        assert_eq!(decode::<Empty>(&[], Order::Little), Ok(Empty));
        assert_eq!(decode::<Empty>(&[0], Order::Big), Ok(Empty));
    }
}
