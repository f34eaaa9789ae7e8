//! Requests for what a client on Fast DDS sent before the middleware knew its writer.
//!
//! RustDDS drops samples of writers that it has not matched. Its own request after the match has Fast DDS wait for its
//! next heartbeat, and the first call of a service take 3 s (`.github/upstream.md`). Here the first sample is asked for by its
//! number, at the places that the client's participant announces.

use ros2_client::dds::rustdds::GUID;

use super::graph::{entity, prefix};
use super::packet::first_sample_wanted;
use super::places::{Places, is_fast_dds};

/// Asks a writer that has just been matched for its first sample.
pub(super) fn ask(places: &Places, reader: GUID, writer: GUID) {
    /// In the last byte of an entity: one of the middleware's own.
    const BUILT_IN: u8 = 0xc0;
    let to = prefix(writer);
    if !is_fast_dds(to) || entity(reader)[3] & BUILT_IN != 0 {
        return;
    }
    places.send(to, &first_sample_wanted(places.own(), entity(reader), to, entity(writer)));
}
