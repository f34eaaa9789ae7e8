//! DDS over loopback, one `PoseArray` a message, polled as the node polls it.

use std::time::{Duration, Instant};

use super::measure::{End, Ends, Samples, Work, exchange};
use super::ways::words;
use super::{DDS_TURNS, Effort, Report};
use crate::messages::builtin_interfaces::Time;
use crate::messages::geometry_msgs::{Pose, PoseArray};
use crate::ros::edge::{Edge, Node, Options, Publisher, Quality, Subscription};

pub const NAME: &str = "DDS";

/// Between two looks for what arrived.
const LOOK: Duration = Duration::from_micros(50);
/// For the two to find each other.
const DISCOVERY: Duration = Duration::from_secs(15);

struct Dds {
    publisher: Publisher<PoseArray>,
    subscription: Subscription<PoseArray>,
    own: PoseArray,
    arrived: PoseArray,
    poses: usize,
    // Dropped after all that was made from it.
    _node: Node,
}

impl Dds {
    fn open(poses: usize, [out, back]: [&str; 2]) -> Result<Self, String> {
        // A domain that runs side by side are unlikely to share.
        let domain = 100 + (std::process::id() % 101) as u16;
        let edge = Edge::open(Options { domain, loopback_only: true }).map_err(words)?;
        let node = edge.node("/", &format!("bench_{out}")).map_err(words)?;
        let topic = |side: &str| format!("/bench_{poses}_{side}");
        Ok(Self {
            publisher: node.publisher(&topic(out), Quality::reliable(1)).map_err(words)?,
            subscription: node.subscription(&topic(back), Quality::reliable(1)).map_err(words)?,
            own: PoseArray::default(),
            arrived: PoseArray::default(),
            poses,
            _node: node,
        })
    }

    /// Both directions: reliable, so that nothing is sent before it can be heard.
    fn meet(&self) -> Result<(), String> {
        let begun = Instant::now();
        while self.publisher.matched() == 0 || self.subscription.matched() == 0 {
            if begun.elapsed() > DISCOVERY {
                return Err(format!("the participants did not find each other within {DISCOVERY:?}"));
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        // Matched here is not yet matched there.
        std::thread::sleep(Duration::from_millis(200));
        Ok(())
    }
}

impl End for Dds {
    fn fill(&mut self) -> Result<(), String> {
        self.own.poses.clear();
        self.own.poses.extend((0..self.poses).map(|k| Pose::planar([k as f64, 0.5], 0.25)));
        Ok(())
    }

    fn send(&mut self, mark: u64) -> Result<(), String> {
        // A stamp holds 32 bits twice.
        self.own.header.stamp = Time { sec: (mark >> 32) as i32, nanosec: mark as u32 };
        self.publisher.publish(&self.own).map_err(words)
    }

    fn receive(&mut self, patience: Duration) -> Result<Option<u64>, String> {
        let begun = Instant::now();
        loop {
            if let Some((message, _)) = self.subscription.take() {
                self.arrived = message;
                let Time { sec, nanosec } = self.arrived.header.stamp;
                return Ok(Some((sec as u64) << 32 | u64::from(nanosec)));
            }
            if begun.elapsed() >= patience {
                return Ok(None);
            }
            std::thread::sleep(LOOK);
        }
    }

    fn read(&mut self) -> f64 {
        self.arrived.poses.iter().map(|pose| pose.position.x + pose.position.y + pose.orientation.z).sum()
    }
}

pub fn measure(effort: &Effort, report: &mut Report) {
    for work in Work::ALL {
        for &poses in effort.sizes {
            let mut samples = Samples::default();
            let measured = open(poses).and_then(|(near, far)| {
                let (rounds, seconds) = (DDS_TURNS * effort.rounds, DDS_TURNS as f64 * effort.seconds);
                exchange(near, far, work, rounds, seconds, &mut samples)
            });
            match measured {
                Ok(()) => report.cases.push(samples.case(NAME, work, poses)),
                Err(why) => report.skipped.push(format!("{NAME}, {poses} poses: {why}")),
            }
        }
    }
}

fn open(poses: usize) -> Result<Ends, String> {
    let near = Dds::open(poses, ["out", "back"])?;
    let far = Dds::open(poses, ["back", "out"])?;
    near.meet()?;
    far.meet()?;
    Ok((Box::new(near), Box::new(move || Ok(Box::new(far) as Box<dyn End>))))
}
