//! The CDR encoding, in which messages travel and are recorded.
//!
//! Any bytes at all end in a value or an error.

use ros2_client::dds::rustdds::RepresentationIdentifier;
use ros2_client::dds::rustdds::serialization::{deserialize_from_cdr_with_rep_id, to_writer_with_rep_id};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Byte order of a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    Little,
    Big,
}

impl Order {
    fn identifier(self) -> RepresentationIdentifier {
        match self {
            Order::Little => RepresentationIdentifier::CDR_LE,
            Order::Big => RepresentationIdentifier::CDR_BE,
        }
    }
}

/// Bytes that are no value of the type asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{length} bytes are no {kind}: {reason}")]
pub struct BadPayload {
    pub kind: &'static str,
    pub length: usize,
    pub reason: String,
}

/// Reads a value from a payload (without its four byte encapsulation header). Bytes after the value are
/// padding and ignored.
///
/// # Errors
/// [`BadPayload`] for bytes that are no such value; no bytes cause a panic.
pub fn decode<T: DeserializeOwned>(bytes: &[u8], order: Order) -> Result<T, BadPayload> {
    deserialize_from_cdr_with_rep_id::<T>(bytes, order.identifier()).map(|(value, _)| value).map_err(
        |error| BadPayload {
            kind: std::any::type_name::<T>(),
            length: bytes.len(),
            reason: error.to_string(),
        },
    )
}

/// Appends a value in little endian CDR, aligned to the beginning of `value` itself.
///
/// # Errors
/// Types that CDR cannot express: sequences of unknown length, maps.
pub fn encode<T: Serialize>(value: &T, into: &mut Vec<u8>) -> Result<(), String> {
    to_writer_with_rep_id(into, value, RepresentationIdentifier::CDR_LE).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{lifecycle_msgs, rcl_interfaces, rosgraph_msgs, std_srvs};
    use proptest::prelude::*;

    /// Decodes in both byte orders; what comes out must encode again.
    fn survives<T: Serialize + DeserializeOwned>(bytes: &[u8]) {
        for order in [Order::Little, Order::Big] {
            if let Ok(value) = decode::<T>(bytes, order) {
                encode(&value, &mut Vec::new()).expect("was decoded");
            }
        }
    }

    proptest! {
        #[test]
        fn any_bytes_end_in_a_value_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..256)) {
            survives::<rosgraph_msgs::Clock>(&bytes);
            survives::<std_srvs::SetBoolRequest>(&bytes);
            survives::<rcl_interfaces::ParameterEvent>(&bytes);
            survives::<rcl_interfaces::DescribeParametersResponse>(&bytes);
            survives::<rcl_interfaces::Settings>(&bytes);
            survives::<rcl_interfaces::ListParametersRequest>(&bytes);
            survives::<lifecycle_msgs::TransitionEvent>(&bytes);
            survives::<lifecycle_msgs::ChangeStateRequest>(&bytes);
        }
    }

    #[test]
    fn a_length_larger_than_the_payload_is_refused() {
        let endless = [0xff; 12];
        assert!(decode::<Vec<f64>>(&endless, Order::Little).is_err());
        assert!(decode::<String>(&endless, Order::Little).is_err());
        assert!(decode::<Vec<String>>(&endless, Order::Big).is_err());
    }

    #[test]
    fn fields_are_aligned_to_their_size_from_the_beginning() {
        let mut bytes = Vec::new();
        encode(&(1_u8, 2_u32, 3_f64), &mut bytes).expect("plain");
        assert_eq!(bytes.len(), 16);
        assert_eq!(decode::<(u8, u32, f64)>(&bytes, Order::Little), Ok((1, 2, 3.0)));
    }
}
