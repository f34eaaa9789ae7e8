//! Peers that are killed (SIGKILL) in the midst of it.

use std::time::Duration;

use flockform::shm::channel::Writer;
use flockform::shm::link::{Controller, POSES, Robots};
use flockform::shm::payload::Pose;
use flockform::swarm::pace::system_time;
use flockform::swarm::transport::RobotsEnd;

use super::child::{NARROW, Process};
use super::support::*;

/// Two places for readers, and five that die in them.
#[test]
fn a_reader_killed_while_it_holds_slices_holds_nobody_up_and_leaves_its_place() {
    let name = domain_name();
    let peer = domain(&name).join("test").expect("shared memory");
    let mut writer = Writer::<Pose>::open(&peer, "row", POSES, &NARROW, 3).expect("a writer");
    let send = |writer: &mut Writer<Pose>| {
        let stamp = system_time();
        let element = |k: usize| Pose { member: k as u32, frame: 0, position: [0.0; 2], yaw: 0.0, stamp };
        writer.send(stamp, 0, 3, element).expect("sent, whoever died");
    };
    for _ in 0..5 {
        let stop = std::sync::atomic::AtomicBool::new(false);
        let reader = std::thread::scope(|scope| {
            let started = scope.spawn(|| {
                let reader = Process::start("hold poses", &name);
                stop.store(true, std::sync::atomic::Ordering::Relaxed);
                reader
            });
            while !stop.load(std::sync::atomic::Ordering::Relaxed) && !started.is_finished() {
                send(&mut writer);
                std::thread::sleep(Duration::from_millis(1));
            }
            started.join().expect("it started")
        });
        assert_eq!(writer.readers(), 1);
        reader.kill();
        (0..200).for_each(|_| send(&mut writer));
        // The system lets go of what a killed process held in its own time.
        until("its place is free again", || {
            peer.clean_up();
            (writer.readers() == 0).then_some(())
        });
    }
}

#[test]
fn robots_that_are_killed_are_forgotten_and_heard_again_when_they_come_back() {
    let name = domain_name();
    let shm = domain(&name);
    let peer = shm.join("test").expect("shared memory");
    let (control, part) = control_of(&row(3, &[]));
    let mut controller = Controller::open(&peer, "row", &control, &part).expect("an end");
    let own = shm.join("test").expect("shared memory");
    let mut others = Robots::open(&own, "row", 3).expect("an end");
    meet(&mut controller, &mut others, 0);
    for _ in 0..3 {
        let robots = Process::start("say poses", &name);
        let now = system_time();
        until("the other process is heard", || {
            heard(&mut controller).iter().any(|(m, pose)| *m == 1 && pose.stamp > now).then_some(())
        });
        robots.kill();
        peer.clean_up();
        // What it had sent may still come, and nothing after it.
        heard(&mut controller);
        others.send(1.0, &[(0, pose(1.0, 1.0))]).expect("said");
        assert_eq!(heard(&mut controller), [(0, pose(1.0, 1.0))]);
    }
}
