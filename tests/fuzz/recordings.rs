//! MCAP files, and the CDR messages in them.

use std::path::Path;
use std::sync::OnceLock;

use flockform::messages::flockform_msgs::LoopEvent;
use flockform::messages::geometry_msgs::{PoseArray, PoseStamped, PoseWithCovarianceStamped};
use flockform::messages::nav_msgs::Odometry;
use flockform::messages::recorder::RecordedMessage;
use flockform::record::flight::FlightMessages;
use flockform::record::replay::{recorded_swarm, replay};
use flockform::record::{About, Entry, Reader, Recording, Shared};
use flockform::scene::bundled::bundled_swarm;
use flockform::swarm::flight::{Flight, fly_with_observer};
use proptest::prelude::*;

use super::*;
use crate::folders::temporary;
use crate::swarms::load_swarm;

/// Ten ticks of flight.
const SHORT: [&str; 2] = ["flight.duration=0.5", "flight.bounds={}"];

fn swarm() -> flockform::scene::swarm::Swarm {
    load_swarm("square", &SHORT)
}

/// What is said of the flight, as the program says it.
fn about() -> About {
    About {
        source: "swarm",
        name: "square".to_owned(),
        swarm: Some(bundled_swarm("square").expect("bundled").text.to_owned()),
        set: SHORT.map(str::to_owned).into(),
        ..About::default()
    }
}

/// A recording of ten ticks, whole.
fn good() -> &'static [u8] {
    static GOOD: OnceLock<Vec<u8>> = OnceLock::new();
    GOOD.get_or_init(|| {
        let folder = temporary();
        let path = folder.path().join("flight.mcap");
        let swarm = swarm();
        let flight = Flight::new(&swarm).expect("flies");
        let recording = Shared::new(Recording::create(&path, &about(), false).expect("created"));
        let messages = FlightMessages::new(&swarm, flight.control(), recording.sink()).expect("named");
        let messages = std::cell::RefCell::new(messages);
        let mut hear = |received| messages.borrow_mut().receive(received);
        fly_with_observer(&swarm, &mut hear, &mut |flight, _| {
            let time = (flight.fleet().period() - 1) as f64 * swarm.raw.control.period;
            messages.borrow_mut().tick(flight.control(), time);
            std::ops::ControlFlow::Continue(())
        })
        .expect("flies");
        recording.take().expect("once").finish().expect("written");
        std::fs::read(path).expect("readable")
    })
}

fn read(bytes: Vec<u8>) {
    let Ok(reader) = Reader::of_bytes(Path::new("damaged.mcap"), bytes) else { return };
    let _ = reader.described();
    if let Ok(swarm) = recorded_swarm(&reader, &[]) {
        let _ = replay(&reader, &swarm, 0.0);
    }
    // As `replay --swarm` does, which needs nothing of what the file says of itself.
    let _ = replay(&reader, &swarm(), 0.0);
}

#[test]
fn a_damaged_recording_is_replayed_as_far_as_it_goes_or_refused() {
    let whole = Reader::of_bytes(Path::new("good.mcap"), good().to_vec()).expect("readable");
    assert!(replay(&whole, &swarm(), 0.0).expect("flies").holds());
    let before = peak();
    fuzz(&damage(), |damage| read(damaged(good(), &damage)));
    if let (Some(before), Some(after)) = (before, peak()) {
        assert!(after < before + 600_000, "{before} kB, and {after} kB afterwards");
    }
}

/// A file that is well-formed but for this record.
fn with_record(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
    let mut bytes = mcap::MAGIC.to_vec();
    // The header: a profile and a library without letters.
    bytes.extend([1, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    bytes.push(opcode);
    bytes.extend(length.to_le_bytes());
    bytes.extend(body);
    bytes
}

#[test]
fn lengths_beyond_the_file_allocate_nothing_and_panic_nowhere() {
    let before = peak();
    for opcode in 0..=16_u8 {
        for length in [0, 1, 3, 12, 39, 40, 1 << 20, 1 << 40, 1_000_000_000_000, u64::MAX] {
            for fill in [0, 0xff] {
                let body = vec![fill; usize::try_from(length).unwrap_or(64).min(64)];
                read(with_record(opcode, length, &body));
            }
        }
    }
    // A chunk that promises a terabyte: times, size uncompressed, checksum, `zstd`, size, and nothing.
    let mut chunk = vec![0; 16];
    chunk.extend(1_000_000_000_000_u64.to_le_bytes());
    chunk.extend([0; 4]);
    for compression in ["", "zstd", "lz4"] {
        let mut chunk = chunk.clone();
        chunk.extend((compression.len() as u32).to_le_bytes());
        chunk.extend(compression.as_bytes());
        for size in [0_u64, 8, 1 << 40] {
            let mut chunk = chunk.clone();
            chunk.extend(size.to_le_bytes());
            chunk.extend([0x28, 0xb5, 0x2f, 0xfd, 0, 0, 0, 0]);
            let length = chunk.len() as u64;
            read(with_record(6, length, &chunk));
        }
    }
    if let (Some(before), Some(after)) = (before, peak()) {
        assert!(after < before + 300_000, "{before} kB, and {after} kB afterwards");
    }
}

/// Payloads on the topics that a replay listens to, and of the kinds that it knows.
fn messages() -> impl Strategy<Value = Vec<(usize, Vec<Damage>)>> {
    prop::collection::vec((any::<prop::sample::Index>().prop_map(|i| i.index(4096)), damage()), 1..12)
}

#[test]
fn messages_with_anything_in_them_are_replayed_or_refused() {
    let reader = Reader::of_bytes(Path::new("good.mcap"), good().to_vec()).expect("readable");
    let mut entries: Vec<Entry> = Vec::new();
    assert_eq!(reader.each(&mut |entry| entries.push(entry.clone())), None);
    let folder = temporary();
    fuzz(&messages(), |messages| {
        let path = folder.path().join("messages.mcap");
        let mut recording = Recording::create(&path, &about(), true).expect("created");
        for (n, entry) in entries.iter().enumerate() {
            let changes = messages.iter().filter(|(which, _)| which % entries.len() == n);
            let change = |payload: Vec<u8>, (_, damage): &(usize, Vec<Damage>)| damaged(&payload, damage);
            let payload = changes.fold(entry.payload.clone(), change);
            let (package, name) = entry.kind.split_once('/').expect("a kind");
            let (package, name) = kind(package, name);
            let (time, published) = (entry.published, entry.published);
            let topic = &*entry.topic;
            recording.write(&RecordedMessage {
                topic,
                package,
                name,
                payload: &payload,
                reliable: true,
                time,
                published,
            });
        }
        recording.finish().expect("written");
        read(std::fs::read(&path).expect("readable"));
    });
}

/// The names as the program has them.
fn kind(package: &str, name: &str) -> (&'static str, &'static str) {
    fn leak(text: &str) -> &'static str {
        static KNOWN: std::sync::Mutex<Vec<&'static str>> = std::sync::Mutex::new(Vec::new());
        let mut known = KNOWN.lock().expect("nobody panics here");
        if let Some(one) = known.iter().find(|one| **one == text) {
            return one;
        }
        known.push(Box::leak(text.to_owned().into_boxed_str()));
        known.last().expect("just put there")
    }
    (leak(package), leak(name))
}

#[test]
fn any_payload_is_a_message_or_none() {
    let entry = |kind: &str, payload: Vec<u8>| Entry {
        topic: "t".into(),
        kind: kind.into(),
        payload,
        published: 0.0,
    };
    fuzz(&prop::collection::vec(any::<u8>(), 0..400), |bytes| {
        for order in [0, 1] {
            let payload = [vec![0, order, 0, 0], bytes.clone()].concat();
            let _ = entry("geometry_msgs/PoseStamped", payload.clone()).decode::<PoseStamped>();
            let _ = entry("geometry_msgs/PoseArray", payload.clone()).decode::<PoseArray>();
            let _ = entry("geometry_msgs/PoseWithCovarianceStamped", payload.clone())
                .decode::<PoseWithCovarianceStamped>();
            let _ = entry("nav_msgs/Odometry", payload.clone()).decode::<Odometry>();
            let _ = entry("flockform_msgs/LoopEvent", payload).decode::<LoopEvent>();
        }
    });
}
