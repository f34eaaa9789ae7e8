//! Payloads as they arrive.
//!
//! Endpoints hand over bytes, and decoding happens elsewhere: a service must look at a request before it knows
//! how to read it.

use std::convert::Infallible;

use ros2_client::dds::rustdds::RepresentationIdentifier;
use ros2_client::dds::rustdds::bytes::Bytes;
use ros2_client::dds::rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};
use serde::Serialize;

use crate::messages::wire::{Order, encode};

/// One sample's bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Payload {
    pub order: Order,
    pub bytes: Vec<u8>,
}

impl Payload {
    /// A value, ready to be sent.
    pub fn of<T: Serialize>(value: &T) -> Result<Self, String> {
        let mut bytes = Vec::with_capacity(2 * size_of::<T>());
        encode(value, &mut bytes)?;
        Ok(Self { order: Order::Little, bytes })
    }

    /// As it stands in a packet: behind its encapsulation, and with bytes after it up to a multiple of four.
    pub fn serialized(&self) -> Vec<u8> {
        let order = u8::from(self.order == Order::Little);
        let mut bytes = [&[0, order, 0, 0], &self.bytes[..]].concat();
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes
    }
}

/// Lets RustDDS read and write [`Payload`]s.
pub(super) struct Verbatim;

impl DeserializerAdapter<Payload> for Verbatim {
    type Error = Infallible;
    type Decoded = Payload;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Payload) -> Payload {
        decoded
    }
}

impl DefaultDecoder<Payload> for Verbatim {
    type Decoder = Copied;
    const DECODER: Copied = Copied;
}

/// Copies the bytes out of RustDDS's cache.
#[derive(Clone)]
pub(super) struct Copied;

impl Decode<'_, Payload> for Copied {
    type Error = Infallible;

    fn decode_bytes(self, bytes: &[u8], encoding: RepresentationIdentifier) -> Result<Payload, Infallible> {
        let order = if encoding == RepresentationIdentifier::CDR_BE { Order::Big } else { Order::Little };
        Ok(Payload { order, bytes: bytes.to_vec() })
    }
}

impl SerializerAdapter<Payload> for Verbatim {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(value: &Payload) -> Result<Bytes, Infallible> {
        Ok(Bytes::copy_from_slice(&value.bytes))
    }
}
