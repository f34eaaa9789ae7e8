//! Secured DDS (SROS2): who takes part, who reads and who may publish. All of it on loopback, with keystores that the
//! command `openssl` makes.
//!
//! ```text
//! apt-get install libssl-dev pkg-config openssl g++ libfastrtps-dev
//! cargo test --features security --test security -- --ignored --test-threads=1
//! ```

#![cfg(feature = "security")]

mod enclaves;
mod exchange;
mod keystore;
mod nodes;
#[path = "../common/running.rs"]
mod running;
#[path = "../common/signals.rs"]
mod signals;
#[path = "../common/stranger.rs"]
mod stranger;
#[path = "../common/swarms.rs"]
mod swarms;
#[path = "../common/waits.rs"]
mod waits;
