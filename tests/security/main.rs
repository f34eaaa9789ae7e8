//! Secured DDS (SROS2): who takes part, who reads and who may publish. All of it on loopback, with keystores that the
//! command `openssl` makes.
//!
//! ```text
//! apt-get install libssl-dev pkg-config openssl g++ libfastrtps-dev
//! cargo test --no-default-features --features ros,security --test security -- --ignored --test-threads=1
//! ```

#![cfg(feature = "security")]

mod enclaves;
mod exchange;
mod keystore;
mod nodes;
#[path = "../common/process.rs"]
mod process;
#[path = "../common/running.rs"]
#[expect(dead_code, reason = "the processes here end by the end of their input")]
mod running;
#[path = "../common/signals.rs"]
mod signals;
#[path = "../common/stranger.rs"]
#[expect(dead_code, reason = "all strangers' names are good here")]
mod stranger;
#[path = "../common/swarms.rs"]
mod swarms;
#[path = "../common/waits.rs"]
mod waits;
