//! A peer in another language: the iceoryx2 package of Python.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::Duration;

use flockform::shm::FormationNode;
use flockform::shm::link::Robots;
use flockform::swarm::pace::system_time;
use flockform::swarm::transport::RobotsEnd;
use flockform::swarm::watch::Pose;

use super::support::*;

#[test]
#[ignore = "needs Python with `pip install iceoryx2`: FLOCKFORM_PYTHON=python cargo test --test transport -- --ignored"]
fn python_reads_poses_and_moves_a_leader() {
    let name = domain_name();
    let shm = domain(&name);
    let mut node = FormationNode::open(&row(3, &[]), &shm, None).expect("a node");
    let peer = shm.join("test").expect("shared memory");
    let mut robots = Robots::open(&peer, "row", 3).expect("an end");
    let python = std::env::var("FLOCKFORM_PYTHON").unwrap_or_else(|_| "python3".into());
    let mut script = Command::new(python)
        .arg(format!("{}/tests/transport/peer.py", env!("CARGO_MANIFEST_DIR")))
        .args([&name, "row"])
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .stdout(Stdio::piped())
        .spawn()
        .expect("python starts");
    let output = BufReader::new(script.stdout.take().expect("piped"));
    let (say, lines) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        output.lines().map_while(Result::ok).for_each(|line| {
            // The test may be over.
            let _ = say.send(line);
        });
    });
    // The script leads robot 0 to a metre above where it reads robot 2: at (2.25, 0.5).
    let mut places = [[0.0, 0.0], [1.0, 0.0], [2.25, 0.5]];
    until("the leader is where Python led it", || {
        let stamp = system_time();
        let poses: Vec<(usize, Pose)> = (0..3)
            .map(|m| (m, Pose { position: places[m], yaw: 0.0, stamp, frame_is_right: true }))
            .collect();
        robots.send(stamp, &poses).expect("said");
        node.tick();
        robots.targets(&mut |m, place| {
            if m == 0 {
                places[0] = place;
            }
        });
        std::thread::sleep(Duration::from_millis(5));
        (places[0] == [2.25, 1.5]).then_some(())
    });
    let first = lines.recv_timeout(PATIENCE).expect("the script says what it read");
    assert_eq!(first, "3 poses, robot 2 at 2.25 0.5, header FlockformHeader_v1");
    script.kill().expect("it lives");
    script.wait().expect("a child");
}
