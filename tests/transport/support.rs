//! Formations to carry, bounded waits, domains that no other test meets.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use flockform::scene::swarm::Swarm;
use flockform::shm::Domain;
use flockform::swarm::control::Control;
use flockform::swarm::control::scope::NodeScope;
use flockform::swarm::transport::{ControllerEnd, Received, RobotsEnd, Target};
use flockform::swarm::watch::Pose;

pub use crate::signals::signal;
use crate::waits::within;

pub const PATIENCE: Duration = Duration::from_secs(20);

/// What `look` finds in time.
pub fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    within(PATIENCE, what, look)
}

/// The name of a domain of shared memory of this test alone.
pub fn domain_name() -> String {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    format!("test_{}_{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed))
}

pub fn domain(name: &str) -> Domain {
    Domain::named(name).expect("a name")
}

/// Robots in a row, a metre apart; the first is led from outside.
pub fn row(count: usize, more: &[&str]) -> Swarm {
    let robot = |k: usize| format!("{{ name = \"r{k}\", place = [{k}.0, 0.0] }},\n");
    let robots: String = (0..count).map(robot).collect();
    let text = format!(
        "title = \"A row\"\nradius = 0.1\nrobots = [\n{robots}]\n[links]\nkind = \"nearest\"\ncount = 2\n\
         [[leaders]]\nrobots = [\"r0\"]\nprogram = {{ kind = \"external\" }}\n\
         [control]\nperiod = 0.01\n[poses]\nfresh = 8.0\nage_limit = 10.0\nstop_after = 20.0\n"
    );
    let overrides: Vec<String> = more.iter().map(|&text| text.to_owned()).collect();
    Swarm::parse("row", "a test's swarm", &text, &overrides, None).expect("valid")
}

/// Makes robots of a row measure each other.
pub const MEASURED: [&str; 2] = ["limits.speed=1.0", "ranges={ reach = 5.0 }"];

pub fn control_of(swarm: &Swarm) -> (Control, NodeScope) {
    let mut control = Control::new(swarm).expect("valid");
    let part = NodeScope::take(swarm, &mut control, None).expect("all");
    (control, part)
}

pub fn pose(x: f64, stamp: f64) -> Pose {
    Pose { position: [x, 2.0], yaw: 0.5, stamp, frame_is_right: true }
}

/// A transport under test, between robots of one formation and their loops.
pub trait Transport {
    type Controller: ControllerEnd;
    type Robots: RobotsEnd;

    /// Robots in the formation.
    fn count(&self) -> usize;

    /// The loop's end, made anew.
    fn controller(&mut self) -> Self::Controller;

    /// A robots' end, made anew.
    fn robots(&mut self) -> Self::Robots;

    /// Whether what was said last is there at once; a network takes its time, and may lose it.
    fn newest_waits(&self) -> bool {
        true
    }
}

/// All poses that arrived since the last call.
pub fn heard(end: &mut impl ControllerEnd) -> Vec<(usize, Pose)> {
    let mut poses = Vec::new();
    end.receive(0.0, &mut |heard| {
        if let Received::Pose(member, pose) = heard {
            poses.push((member, pose));
        }
    });
    poses
}

/// Says a pose of `member` until it is heard: over a network the first ones find nobody yet.
pub fn meet<C: ControllerEnd, R: RobotsEnd>(controller: &mut C, robots: &mut R, member: usize) {
    until("the ends find each other, poses", || {
        robots.send(1.0, &[(member, pose(0.0, 1.0))]).expect("said");
        heard(controller).iter().any(|(m, _)| *m == member).then_some(())
    });
    // And the way back.
    until("the ends find each other, targets", || {
        let mut found = None;
        controller.send(1.0, &[target(member, 0.0)]).expect("sent");
        robots.targets(&mut |m, _| found = (m == member).then_some(()).or(found));
        found
    });
    std::thread::sleep(Duration::from_millis(20));
    heard(controller);
    robots.targets(&mut |_, _| ());
}

pub fn target(member: usize, x: f64) -> Target {
    Target { member, position: [x, 3.0], yaw: 0.0 }
}
