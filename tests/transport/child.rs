//! This test program as another process, with a task: to be killed in the midst of it.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use flockform::shm::channel::{Capacity, Reader};
use flockform::shm::link::{POSES, Robots};
use flockform::shm::payload::{Payload, Pose};
use flockform::shm::{Domain, positions};
use flockform::swarm::transport::RobotsEnd;

use super::support::*;
use crate::running::Running;

const TASK: &str = "FLOCKFORM_TEST_TASK";
const READY: &str = "ready";

/// Few places, so that it shows when those of the dead are not free again.
pub const NARROW: Capacity = Capacity { writers: 2, readers: 2, queue: 4, borrowed: 2, history: 1 };

/// Another process, at its task until it is killed.
pub struct Process(Running);

impl Process {
    /// Waits until it says that it is at it.
    pub fn start(task: &str, domain: &str) -> Self {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command
            .args(["--exact", "child::task", "--ignored", "--nocapture"])
            .env(TASK, task)
            .env(flockform::shm::domain::VARIABLE, domain)
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        let this = Self(Running(child));
        let is_ready = output.lines().map_while(Result::ok).any(|line| line.ends_with(READY));
        assert!(is_ready, "{task} ended before it was at it");
        this
    }

    /// SIGKILL, and the wait for its end.
    pub fn kill(self) {
        drop(self.0);
    }
}

#[test]
#[ignore = "a process that other tests start, with its task in the environment"]
fn task() {
    let Ok(task) = std::env::var(TASK) else { return };
    let domain = Domain::from_environment().expect("a domain");
    let peer = domain.join("child").expect("shared memory");
    match task.as_str() {
        "hold poses" => hold(&Reader::<Pose>::open(&peer, "row", POSES, &NARROW).expect("a reader")),
        "hold positions" => hold(&positions::read(&peer, "body").expect("a reader")),
        "never read positions" => {
            let _reader = positions::read(&peer, "body").expect("a reader");
            println!("{READY}");
            rest();
        }
        "say poses" => {
            let mut robots = Robots::open(&peer, "row", 3).expect("an end");
            let begun = Instant::now();
            println!("{READY}");
            while begun.elapsed() < PATIENCE {
                let stamp = flockform::swarm::pace::system_time();
                robots.send(stamp, &[(1, pose(1.0, stamp))]).expect("said");
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        other => panic!("there is no task {other}"),
    }
}

/// Borrows as many slices as a reader may, and keeps them.
fn hold<T: Payload>(reader: &Reader<T>) {
    let one = || until("a slice", || reader.take());
    let _held = [one(), one()];
    println!("{READY}");
    rest();
}

fn rest() {
    std::thread::sleep(2 * PATIENCE);
}
