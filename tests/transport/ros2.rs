//! Over ROS 2, on loopback. The tests take turns: they share topics, and participants are dear.

use std::sync::{Mutex, MutexGuard, PoisonError};

use flockform::ros::arguments::RosArguments;
use flockform::ros::edge::{Edge, Node, Options};
use flockform::ros::node::Link as Controller;
use flockform::ros::robots::{Layout, Link as Robots};
use flockform::scene::swarm::Swarm;
use flockform::swarm::control::scope::NodeScope;
use flockform::swarm::transport::{ControllerEnd, Received, Target};

use super::promises::kept;
use super::support::*;

/// A loop's end with the node that it was made from.
pub struct Served {
    link: Controller,
    _node: Node,
}

impl ControllerEnd for Served {
    type Error = <Controller as ControllerEnd>::Error;

    fn receive(&mut self, now: f64, take: &mut dyn FnMut(Received)) {
        self.link.receive(now, take);
    }

    fn send(&mut self, now: f64, targets: &[Target]) -> Result<(), Self::Error> {
        self.link.send(now, targets)
    }

    fn refused(&self) -> u64 {
        self.link.refused()
    }
}

struct Ros2 {
    swarm: Swarm,
    /// Whom the loop sends targets.
    mine: Vec<usize>,
    _turn: MutexGuard<'static, ()>,
}

impl Ros2 {
    fn new(swarm: Swarm, mine: Vec<usize>) -> Self {
        static TURN: Mutex<()> = Mutex::new(());
        Self { swarm, mine, _turn: TURN.lock().unwrap_or_else(PoisonError::into_inner) }
    }

    fn small() -> Self {
        Self::new(row(3, &[]), vec![0, 1, 2])
    }
}

fn domain() -> u16 {
    100 + (std::process::id() % 101) as u16
}

impl Transport for Ros2 {
    type Controller = Served;
    type Robots = Robots;

    fn newest_waits(&self) -> bool {
        false
    }

    fn count(&self) -> usize {
        control_of(&self.swarm).0.formation().count()
    }

    fn controller(&mut self) -> Served {
        let (control, _) = control_of(&self.swarm);
        let heard = (0..control.formation().count()).collect();
        let part = NodeScope { mine: self.mine.clone(), heard };
        let edge = Edge::open(Options { domain: domain(), loopback_only: true }).expect("sockets");
        let node = edge.node("/", "flockform").expect("a node");
        let names = &control.formation().names;
        let topic = |pattern: &str, m: usize| Ok(node.topic(&pattern.replace("{name}", &names[m]))?);
        let link = Controller::open(&node, &self.swarm.raw.node, &control, &part, false, &topic);
        Served { link: link.expect("an end"), _node: node }
    }

    fn robots(&mut self) -> Robots {
        let id = domain().to_string();
        let environment = |name: &str| match name {
            "ROS_DOMAIN_ID" => Some(id.clone()),
            "ROS_AUTOMATIC_DISCOVERY_RANGE" => Some("LOCALHOST".into()),
            _ => None,
        };
        let arguments = RosArguments::parse(["flockform".to_owned()], &environment).expect("none").1;
        let (control, _) = control_of(&self.swarm);
        Robots::open(&self.swarm, control.formation(), &arguments, Layout::OneNode).expect("an end")
    }
}

/// Large swarms as one array; ten of them get targets, a topic each.
fn large() -> (Ros2, Vec<usize>) {
    let swarm = row(1000, &["node.pose_type=pose-array", "node.pose_topic=/poses"]);
    let served: Vec<usize> = (0..1000).step_by(100).collect();
    (Ros2::new(swarm, served.clone()), served)
}

kept!(Ros2::small(), Ros2::new(row(3, &MEASURED), vec![0, 1, 2]), large());
