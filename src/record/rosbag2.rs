//! Records that `ros2 bag` looks for in a file of the profile `ros2`: the quality of service of each channel, and one metadata record.
//!
//! Both are those of rosbag2's metadata version 9 (Jazzy). They are JSON, which is YAML too.

use mcap::records::Metadata;
use serde_json::json;

use crate::messages::type_description_interfaces::TypeDescription;

/// Name of the metadata record.
pub(super) const METADATA: &str = "rosbag2";
/// Key of a channel's quality of service.
pub(super) const OFFERED_QOS: &str = "offered_qos_profiles";
/// Distribution whose message definitions the file has.
const DISTRIBUTION: &str = "jazzy";

/// A topic of the recording.
pub(super) struct Channel {
    pub id: u16,
    /// `package/msg/Name`.
    pub kind: String,
    pub reliable: bool,
    pub messages: u64,
}

/// Times of the messages so far \[ns\].
#[derive(Clone, Copy, Default)]
pub(super) struct Span {
    times: Option<[u64; 2]>,
}

impl Span {
    pub fn add(&mut self, time: u64) {
        let [first, last] = self.times.unwrap_or([time; 2]);
        self.times = Some([first.min(time), last.max(time)]);
    }
}

/// A publisher's quality of service as rosbag2 writes it: history is not known to those that only listen.
pub(super) fn offered_qos(reliable: bool) -> serde_json::Value {
    let infinite = json!({"sec": 9_223_372_036_u64, "nsec": 854_775_807});
    json!([{
        "history": "unknown",
        "depth": 0,
        "reliability": if reliable { "reliable" } else { "best_effort" },
        "durability": "volatile",
        "deadline": infinite,
        "lifespan": infinite,
        "liveliness": "automatic",
        "liveliness_lease_duration": infinite,
        "avoid_ros_namespace_conventions": false,
    }])
}

/// The hash of a type `package/msg/Name`; empty, as in recordings of older distributions, where the type has no description here.
fn hash(kind: &str) -> String {
    let described = kind.split_once("/msg/").map(|(package, name)| format!("{package}/{name}"));
    described.and_then(|name| TypeDescription::of(&name)).map_or_else(String::new, |known| known.hash())
}

/// The record of a whole recording in the file of this name.
pub(super) fn metadata<'a>(
    file: &str,
    span: Span,
    channels: impl Iterator<Item = (&'a String, &'a Channel)>,
) -> Metadata {
    let [first, last] = span.times.unwrap_or_default();
    let (start, duration) = (json!({"nanoseconds_since_epoch": first}), json!({"nanoseconds": last - first}));
    let mut count = 0;
    let topics: Vec<_> = channels
        .map(|(topic, channel)| {
            count += channel.messages;
            let metadata = json!({
                "name": topic,
                "type": channel.kind,
                "serialization_format": "cdr",
                "offered_qos_profiles": offered_qos(channel.reliable),
                "type_description_hash": hash(&channel.kind),
            });
            json!({"topic_metadata": metadata, "message_count": channel.messages})
        })
        .collect();
    let bag = json!({
        "version": 9,
        "storage_identifier": "mcap",
        "duration": duration,
        "starting_time": start,
        "message_count": count,
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file],
        "files": [{"path": file, "starting_time": start, "duration": duration, "message_count": count}],
        "custom_data": null,
        "ros_distro": DISTRIBUTION,
    });
    let entry = ("serialized_metadata".to_owned(), format!("{bag:#}"));
    Metadata { name: METADATA.to_owned(), metadata: [entry].into() }
}
