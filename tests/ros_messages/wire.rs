//! Messages to bytes and back, by the very adapters that the node's publishers and subscriptions use.

use ros2_client::dds::rustdds::no_key::{Decode, DefaultDecoder, SerializerAdapter};
use ros2_client::dds::rustdds::{CDRDeserializerAdapter, CDRSerializerAdapter, RepresentationIdentifier};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Little-endian CDR, without the four bytes that name the encoding.
pub fn encode<T: Serialize>(message: &T) -> Vec<u8> {
    let bytes = <CDRSerializerAdapter<T> as SerializerAdapter<T>>::to_bytes(message);
    bytes.expect("plain data").to_vec()
}

pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let decoder = <CDRDeserializerAdapter<T> as DefaultDecoder<T>>::DECODER;
    decoder.decode_bytes(bytes, RepresentationIdentifier::CDR_LE).map_err(|error| error.to_string())
}
