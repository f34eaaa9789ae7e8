//! Over shared memory.

use flockform::shm::channel::{Capacity, Reader, Writer};
use flockform::shm::link::{Controller, POSES, Robots};
use flockform::shm::payload::{Leader, Pose as WirePose};
use flockform::shm::{Domain, Peer, ShmError};
use flockform::swarm::transport::{ControllerEnd, Received, RobotsEnd};
use flockform::swarm::watch::Range;
use iceoryx2::prelude::{ZeroCopySend, ipc};

use super::promises::kept;
use super::support::*;

struct Shm {
    count: usize,
    more: &'static [&'static str],
    domain: Domain,
    peers: Vec<Peer>,
}

impl Shm {
    fn new(count: usize) -> Self {
        Self { count, more: &[], domain: domain(&domain_name()), peers: Vec::new() }
    }

    fn peer(&mut self) -> &Peer {
        self.peers.push(self.domain.join("test").expect("shared memory"));
        &self.peers[self.peers.len() - 1]
    }
}

impl Transport for Shm {
    type Controller = Controller;
    type Robots = Robots;

    fn count(&self) -> usize {
        self.count
    }

    fn controller(&mut self) -> Controller {
        let (control, part) = control_of(&row(self.count, self.more));
        Controller::open(self.peer(), "row", &control, &part).expect("an end")
    }

    fn robots(&mut self) -> Robots {
        let (count, measures) = (self.count, !self.more.is_empty());
        let peer = self.peer();
        let robots = Robots::open(peer, "row", count).expect("an end");
        if measures { robots.with_ranges(peer, "row", count).expect("an end") } else { robots }
    }
}

kept!(Shm::new(3), Shm { more: &MEASURED, ..Shm::new(3) }, (Shm::new(1000), (0..1000).collect()));

#[test]
fn two_periods_in_which_all_measure_all_wait_for_a_late_loop() {
    const COUNT: usize = 200;
    let mut shm = Shm { more: &MEASURED, ..Shm::new(COUNT) };
    let (mut controller, mut robots) = (shm.controller(), shm.robots());
    meet(&mut controller, &mut robots, 0);
    let pairs = || (0..COUNT).flat_map(|i| (0..COUNT).filter(move |&j| j != i).map(move |j| (i, j)));
    let mut expected = Vec::new();
    for stamp in [1.0, 2.0] {
        let of_pair = |(observer, of)| Range { observer, of, distance: 1.0, stamp };
        let period: Vec<Range> = pairs().map(of_pair).collect();
        robots.send_ranges(stamp, &period).expect("sent");
        expected.extend(period.into_iter().map(Received::Range));
    }
    let mut found = Vec::new();
    controller.receive(2.0, &mut |received| found.push(received));
    assert!(found == expected, "{} of {} ranges", found.len(), expected.len());
}

#[test]
fn ranges_by_or_of_nobody_are_left_out_and_counted() {
    let mut shm = Shm { more: &MEASURED, ..Shm::new(3) };
    let (mut controller, mut robots) = (shm.controller(), shm.robots());
    meet(&mut controller, &mut robots, 0);
    let range = |observer, of| Range { observer, of, distance: 1.0, stamp: 1.0 };
    robots.send_ranges(1.0, &[range(3, 0), range(0, 7), range(0, 1)]).expect("sent");
    let mut found = Vec::new();
    controller.receive(1.0, &mut |received| found.push(received));
    assert_eq!(found, [Received::Range(range(0, 1))]);
    assert_eq!(controller.refused(), 2);
    let unequipped = Robots::open(shm.peer(), "row", 3).expect("an end").send_ranges(1.0, &[range(0, 1)]);
    assert!(unequipped.expect_err("no rangefinders").to_string().contains("ranges"));
}

#[test]
fn a_pose_or_a_leader_of_nobody_is_left_out_and_counted() {
    let mut shm = Shm::new(3);
    let mut controller = shm.controller();
    let mut robots = shm.robots();
    meet(&mut controller, &mut robots, 0);
    robots.send(1.0, &[(3, pose(0.0, 1.0)), (2, pose(5.0, 1.0))]).expect("said");
    assert_eq!(heard(&mut controller), [(2, pose(5.0, 1.0))]);
    let peer = shm.peer();
    let mut leaders = Writer::<Leader>::open(peer, "row", "leaders", &Capacity::SWARM, 2).expect("a writer");
    let all = [(0, 4.0), (u32::MAX, 5.0)];
    let leader = |k: usize| Leader { member: all[k].0, reserved: 0, position: [all[k].1, 0.0] };
    leaders.send(1.0, 0, 2, leader).expect("sent");
    let mut told = Vec::new();
    controller.receive(1.0, &mut |heard| told.push(heard));
    assert_eq!(told, [Received::Leader(0, [4.0, 0.0])]);
    assert_eq!(controller.refused(), 2);
}

/// An older one, of the same size and alignment.
#[derive(Clone, Copy, Debug, ZeroCopySend)]
#[repr(C)]
#[type_name("FlockformPose_v0")]
struct OlderPose([f64; 5]);

#[test]
fn another_version_of_a_type_is_refused_with_both_names() {
    let name = domain_name();
    let shm = domain(&name);
    let mut config = iceoryx2::prelude::Config::global_config().clone();
    use iceoryx2::prelude::SemanticString;
    config.global.prefix = iceoryx2::prelude::FileName::new(format!("{name}_").as_bytes()).expect("a prefix");
    let older =
        iceoryx2::prelude::NodeBuilder::new().config(&config).create::<ipc::Service>().expect("a node");
    let service = "flockform/row/poses".try_into().expect("a name");
    let _held =
        older.service_builder(&service).publish_subscribe::<[OlderPose]>().create().expect("a service");

    let peer = shm.join("test").expect("shared memory");
    let opened = Reader::<WirePose>::open(&peer, "row", POSES, &Capacity::SWARM);
    let Err(error @ ShmError::Type { .. }) = opened else { panic!("not refused as another type") };
    let words = error.to_string();
    for part in ["flockform/row/poses", "FlockformPose_v0", "FlockformPose_v1", "help: "] {
        assert!(words.contains(part), "{part}: {words}");
    }
}

#[test]
fn a_service_of_less_capacity_is_refused_with_what_it_takes() {
    let peer = domain(&domain_name()).join("test").expect("shared memory");
    let small = Capacity { writers: 1, ..Capacity::SWARM };
    let _held = Reader::<WirePose>::open(&peer, "row", POSES, &small).expect("a reader");
    let error = Reader::<WirePose>::open(&peer, "row", POSES, &Capacity::SWARM).err().expect("refused");
    assert!(error.to_string().contains("max_publishers(64)"), "{error}");
}

#[test]
fn swarms_and_domains_do_not_meet() {
    let (here, there) = (domain(&domain_name()), domain(&domain_name()));
    let peer = here.join("test").expect("shared memory");
    let stranger = there.join("test").expect("shared memory");
    let open = |peer: &Peer, space: &str| Robots::open(peer, space, 3).expect("an end");
    let (control, part) = control_of(&row(3, &[]));
    let mut controller = Controller::open(&peer, "row", &control, &part).expect("an end");
    let mut robots = open(&peer, "row");
    let mut strangers = [open(&peer, "other"), open(&stranger, "row")];
    for one in &mut strangers {
        one.send(1.0, &[(1, pose(9.0, 1.0))]).expect("said");
    }
    robots.send(1.0, &[(0, pose(1.0, 1.0))]).expect("said");
    assert_eq!(heard(&mut controller), [(0, pose(1.0, 1.0))]);
}

#[test]
fn a_reader_looks_into_the_memory_that_the_writer_filled() {
    let peer = domain(&domain_name()).join("test").expect("shared memory");
    let capacity = Capacity { readers: 1, ..Capacity::SWARM };
    let mut writer = Writer::<WirePose>::open(&peer, "row", POSES, &capacity, 8).expect("a writer");
    let reader = Reader::<WirePose>::open(&peer, "row", POSES, &capacity).expect("a reader");
    let element =
        |k: usize| WirePose { member: k as u32, frame: 0, position: [0.5, 1.5], yaw: 2.0, stamp: 3.0 };
    writer.send(7.0, 4, 8, element).expect("sent");
    writer.send(8.0, 5, 3, element).expect("sent");
    let first = reader.take().expect("the first");
    assert_eq!((first.len(), first[7].member, first.header().sequence), (8, 7, 0));
    let second = reader.take().expect("the second, while the first is held");
    assert_eq!((second.len(), second.header().step, second.header().stamp), (3, 5, 8.0));
    let error = writer.send(9.0, 6, 9, element).expect_err("more than it was opened for");
    assert!(matches!(error, ShmError::Send { .. }), "{error}");
    drop((first, second));
    assert!(reader.take().is_none());
}

/// A full `/dev/shm` ends a process that writes where it has not written before.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_one_reader_can_make_a_writer_use_is_taken_when_it_is_opened() {
    use std::os::unix::fs::MetadataExt;
    let name = domain_name();
    let peer = domain(&name).join("test").expect("shared memory");
    let taken = || -> u64 {
        let files = std::fs::read_dir("/dev/shm").expect("a folder").flatten();
        let own = files.filter(|file| file.file_name().to_string_lossy().starts_with(&format!("{name}_")));
        own.filter_map(|file| file.metadata().ok()).map(|file| 512 * file.blocks()).sum()
    };
    let capacity = Capacity::SWARM;
    let mut writer = Writer::<WirePose>::open(&peer, "row", POSES, &capacity, 500).expect("a writer");
    let reader = Reader::<WirePose>::open(&peer, "row", POSES, &capacity).expect("a reader");
    let element = |_| WirePose { member: 1, frame: 0, position: [0.5, 1.5], yaw: 2.0, stamp: 3.0 };
    writer.send(1.0, 1, 1, element).expect("sent");
    let mut held = vec![reader.take().expect("the first")];
    let before = taken();
    for step in 2..50 {
        writer.send(1.0, step, 500, element).expect("sent");
        if held.len() < capacity.borrowed {
            held.extend(reader.take());
        }
    }
    assert_eq!(
        (held.len(), taken()),
        (capacity.borrowed, before),
        "by a reader that holds what it can and sleeps"
    );
}
