//! `flockform node` and `flockform robots`: a swarm over ROS 2, or over shared memory.

use std::process::ExitCode;

use clap::{Args, ValueEnum};
use flockform::record::About;
use flockform::ros::arguments::RosArguments;
use flockform::ros::edge::pulse::MIDDLEWARE_GONE;
use flockform::ros::node::{FormationNode, NodeError};
use flockform::ros::robots::{Layout, RobotNodes};
use flockform::scene::swarm::Swarm;
use flockform::shm::{self, Domain, SimulatedRobots};
use flockform::swarm::control::Control;

use super::recording::{RecordArguments, close};
use super::supervise::{Life, supervise};
use super::swarm::SwarmFileArguments;
use super::{Refusal, say};
use super::{interrupt, log};

/// Middleware between the node and the robots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Transport {
    /// ROS 2: topics, services, parameters, lifecycle
    #[default]
    Ros2,
    /// Shared memory of this computer, without a copy (iceoryx2); FLOCKFORM_SHM_DOMAIN keeps swarms apart
    Shm,
}

#[derive(Debug, Args)]
pub struct NodeArguments {
    #[command(flatten)]
    swarm: SwarmFileArguments,
    /// Middleware that carries poses and targets
    #[arg(long, value_enum, default_value_t)]
    pub transport: Transport,
    /// Run as the node of this robot: receive only its pose and its neighbours', and send only its target
    #[arg(long, value_name = "NAME")]
    pub member: Option<String>,
    #[command(flatten)]
    record: RecordArguments,
}

#[derive(Debug, Args)]
pub struct RobotsArguments {
    #[command(flatten)]
    swarm: SwarmFileArguments,
    /// Middleware that carries poses and targets
    #[arg(long, value_enum, default_value_t)]
    pub transport: Transport,
    /// Make each robot a ROS 2 node of its own, /ROBOT/robot, instead of one node for all
    #[arg(long)]
    node_per_robot: bool,
}

/// Exit code of a node or robots that ran.
fn ended(well: bool) -> ExitCode {
    if well { ExitCode::SUCCESS } else { ExitCode::from(MIDDLEWARE_GONE) }
}

/// In the process that does the work its life, which shared memory needs none of; in the one that outlives it the
/// code to end with.
fn life(transport: Transport, ros: &RosArguments) -> Result<Result<Option<Life>, ExitCode>, Refusal> {
    match transport {
        Transport::Shm => Ok(Ok(None)),
        Transport::Ros2 => Ok(supervise(&ros.security).map_err(Refusal::Supervise)?.map(Some)),
    }
}

/// Keeps a formation until it is interrupted.
pub fn node(arguments: &NodeArguments, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    let life = match life(arguments.transport, ros)? {
        Ok(life) => life,
        Err(code) => return Ok(code),
    };
    let swarm = arguments.swarm.load()?;
    let name = arguments.member.as_deref();
    match life {
        Some(mut life) => {
            let mut node = FormationNode::open(&swarm, ros, name)?;
            let (member, namespace) = (arguments.member.clone(), Some(node.fleet().to_owned()));
            let mut about = About { member, namespace, ..arguments.swarm.about("node", &swarm) };
            about.set.extend(node.overrides(&swarm));
            let recording = arguments.record.open(&about, false, life.number())?;
            if let Some(recording) = &recording {
                node.record(recording.sink()).map_err(NodeError::from)?;
            }
            if let Some(level) = log::level() {
                node.serve_log_level(level).map_err(NodeError::from)?;
            }
            if let Some(lines) = log::lines() {
                node.publish_log(lines).map_err(NodeError::from)?;
            }
            announce(&swarm, node.control());
            if let Some(left) = life.left() {
                node.restore(left);
            }
            tracing::info!("{}", node.reached_at());
            node.watch_middleware().map_err(NodeError::from)?;
            let well = node.run_while(interrupt::serves(), &mut |node| life.tell(|| node.kept()));
            say(&close(recording)?);
            return Ok(ended(well));
        }
        None => {
            arguments.record.require_none("--transport shm")?;
            let mut node = shm::FormationNode::open(&swarm, &Domain::from_environment()?, name)?;
            announce(&swarm, node.control());
            node.run(interrupt::serves())?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn announce(swarm: &Swarm, control: &Control) {
    let (count, rate) = (control.formation().count(), 1.0 / control.period());
    tracing::info!("`{}`: {count} robots at {rate:.1} Hz", swarm.name);
}

/// Flies simulated robots until they are interrupted.
pub fn robots(arguments: &RobotsArguments, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    let life = match life(arguments.transport, ros)? {
        Ok(life) => life,
        Err(code) => return Ok(code),
    };
    let swarm = arguments.swarm.load()?;
    let announce = |count| tracing::info!("`{}`: {count} simulated robots", swarm.name);
    match life {
        Some(mut life) => {
            let layout = if arguments.node_per_robot { Layout::NodePerRobot } else { Layout::OneNode };
            let mut robots = RobotNodes::open(&swarm, ros, layout)?;
            if let Some(lines) = log::lines() {
                robots.publish_log(lines).map_err(NodeError::from)?;
            }
            announce(robots.fleet().robots().len());
            tracing::info!("{}", robots.reached_at());
            if let Some(left) = life.left() {
                robots.restore(&left);
            }
            robots.watch_middleware().map_err(NodeError::from)?;
            return Ok(ended(
                robots.run_while(interrupt::serves(), &mut |robots| life.tell(|| robots.kept())),
            ));
        }
        None if arguments.node_per_robot => return Err(Refusal::NoNodes),
        None => {
            let mut robots = SimulatedRobots::open(&swarm, &Domain::from_environment()?)?;
            announce(robots.fleet().robots().len());
            robots.run(interrupt::serves())?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
