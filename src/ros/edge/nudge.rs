//! Requests for what a client on Fast DDS sent before the middleware knew its writer.
//!
//! RustDDS drops samples of writers that it has not matched. Its own request after the match has Fast DDS wait for its
//! next heartbeat, and the first call of a service take 3 s (`.github/upstream.md`). Here the first sample is asked for by its
//! number, at the places that the client's participant announces; and once more, since the client may not have matched us
//! yet, or its answer be lost, and it does not take the next request of the middleware, which has the same number.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::GUID;

use super::graph::{entity, prefix};
use super::packet::first_sample_wanted;
use super::places::{Places, is_fast_dds};

/// When a writer is asked again \[s\].
const AGAIN: Duration = Duration::from_millis(250);

/// Writers that wait to be asked again \[1\].
const MOST_WAITING: usize = 1024;

/// Writers that have just been matched: when, by which reader, and which.
#[derive(Default)]
pub(super) struct Nudges(VecDeque<(Instant, GUID, GUID)>);

impl Nudges {
    /// Asks a writer that has just been matched for its first sample.
    pub fn ask(&mut self, places: &Places, reader: GUID, writer: GUID) {
        /// In the last byte of an entity: one of the middleware's own.
        const BUILT_IN: u8 = 0xc0;
        if !is_fast_dds(prefix(writer)) || entity(reader)[3] & BUILT_IN != 0 {
            return;
        }
        send(places, reader, writer, 1);
        if self.0.len() < MOST_WAITING {
            self.0.push_back((Instant::now(), reader, writer));
        }
    }

    /// Asks those again whose time has come.
    pub fn repeat(&mut self, places: &Places) {
        while let Some((since, reader, writer)) = self.0.front().copied() {
            if since.elapsed() < AGAIN {
                return;
            }
            self.0.pop_front();
            send(places, reader, writer, 2);
        }
    }
}

fn send(places: &Places, reader: GUID, writer: GUID, count: u32) {
    let to = prefix(writer);
    places.send(to, &first_sample_wanted(places.own(), entity(reader), to, entity(writer), count));
}
