//! Whatever stands in a file is read or refused: recordings, messages, checkpoints, scenes, swarms, parameter files.
//!
//! Good files are damaged at random, by proptest, for `FLOCKFORM_FUZZ_SECONDS` each (one, unless given). A panic fails
//! and is shrunk; so does a file that makes its reader take more memory or time than it is worth.

#![cfg(all(feature = "export", feature = "record"))]

mod checkpoints;
#[path = "../common/folders.rs"]
mod folders;
#[path = "../common/process.rs"]
mod process;
mod recordings;
#[path = "../common/scenes.rs"]
mod scenes;
#[path = "../common/swarms.rs"]
mod swarms;
mod texts;

use std::time::{Duration, Instant};

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

use process::status;

/// Longest time that one damaged file may take to be read or refused; unoptimised, on a machine with other things to do.
const PATIENCE: Duration = Duration::from_secs(20);

/// Runs `test` on values of `strategy` until the time is over.
fn fuzz<S: Strategy>(strategy: &S, test: impl Fn(S::Value)) {
    let seconds = std::env::var("FLOCKFORM_FUZZ_SECONDS").map_or(1.0, |text| text.parse().expect("a number"));
    let (begun, mut cases) = (Instant::now(), 0_u32);
    while begun.elapsed().as_secs_f64() < seconds || cases == 0 {
        // Every round begins elsewhere, and every run at the same places: a failure can be looked at again.
        let seed: Vec<u8> = (0..32).map(|k| cases.wrapping_mul(2_654_435_761).to_le_bytes()[k % 4]).collect();
        let config = Config { cases: 16, failure_persistence: None, ..Config::default() };
        let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &seed));
        let round = runner.run(strategy, |value| {
            let since = Instant::now();
            let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| test(value)));
            prop_assert!(caught.is_ok(), "it panics");
            prop_assert!(since.elapsed() < PATIENCE, "it takes {:?}", since.elapsed());
            Ok(())
        });
        round.unwrap_or_else(|failure| panic!("round {cases}: {failure}"));
        cases += 16;
    }
}

/// What is done to a file.
#[derive(Clone, Debug)]
enum Damage {
    Flip {
        at: u32,
        bits: u8,
    },
    /// A number that is a length more often than not.
    Write {
        at: u32,
        value: u64,
        bytes: u8,
    },
    Cut {
        at: u32,
    },
    Remove {
        at: u32,
        count: u8,
    },
    Repeat {
        at: u32,
        count: u8,
    },
}

fn damage() -> impl Strategy<Value = Vec<Damage>> {
    let value = prop_oneof![
        any::<u64>(),
        (0..64_u32).prop_map(|shift| 1 << shift),
        (0..64_u32).prop_map(|shift| (1_u64 << shift).wrapping_sub(1)),
        Just(0),
        Just(u64::MAX),
        Just(1_000_000_000_000),
    ];
    let one = prop_oneof![
        4 => (any::<u32>(), any::<u8>()).prop_map(|(at, bits)| Damage::Flip { at, bits }),
        4 => (any::<u32>(), value, 1..=8_u8).prop_map(|(at, value, bytes)| Damage::Write { at, value, bytes }),
        1 => any::<u32>().prop_map(|at| Damage::Cut { at }),
        1 => (any::<u32>(), any::<u8>()).prop_map(|(at, count)| Damage::Remove { at, count }),
        1 => (any::<u32>(), any::<u8>()).prop_map(|(at, count)| Damage::Repeat { at, count }),
    ];
    prop::collection::vec(one, 1..6)
}

/// The file after all that; places count from its beginning, and from there again after its end.
fn damaged(good: &[u8], damage: &[Damage]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for one in damage {
        let place = |at: u32| if bytes.is_empty() { 0 } else { at as usize % bytes.len() };
        match *one {
            Damage::Flip { at, bits } => {
                let at = place(at);
                bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= bits);
            }
            Damage::Write { at, value, bytes: count } => {
                let at = place(at);
                let written = value.to_le_bytes();
                bytes.iter_mut().skip(at).zip(&written[..count.into()]).for_each(|(byte, new)| *byte = *new);
            }
            Damage::Cut { at } => bytes.truncate(place(at)),
            Damage::Remove { at, count } => {
                let at = place(at);
                let end = (at + usize::from(count)).min(bytes.len());
                bytes.drain(at..end);
            }
            Damage::Repeat { at, count } => {
                let at = place(at);
                let end = (at + usize::from(count)).min(bytes.len());
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
        }
    }
    bytes
}

/// Peak memory of this process so far [kB], where the system tells it.
fn peak() -> Option<u64> {
    status(std::process::id(), "VmHWM")?.parse().ok()
}
