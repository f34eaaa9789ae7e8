//! `flockform node` and `flockform robots`: a swarm over ROS 2.

use std::process::ExitCode;

use clap::Args;
use flockform::record::About;
use flockform::ros::arguments::RosArguments;
use flockform::ros::node::{FormationNode, NodeError};
use flockform::ros::robots::RobotNodes;

use super::recording::{RecordArguments, close};
use super::run::interrupt_flag;
use super::swarm::SwarmFileArguments;
use super::{Refusal, print};

#[derive(Debug, Args)]
pub struct NodeArguments {
    #[command(flatten)]
    swarm: SwarmFileArguments,
    /// Be the node of this robot alone: hear nobody but it and its neighbours, and send it alone targets
    #[arg(long, value_name = "NAME")]
    member: Option<String>,
    #[command(flatten)]
    record: RecordArguments,
}

#[derive(Debug, Args)]
pub struct RobotsArguments {
    #[command(flatten)]
    swarm: SwarmFileArguments,
}

/// Keeps a formation until it is interrupted.
pub fn node(arguments: &NodeArguments, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    let swarm = arguments.swarm.load()?;
    let mut node = FormationNode::open(&swarm, ros, arguments.member.as_deref())?;
    let member = arguments.member.clone();
    let namespace = Some(node.namespace().to_owned());
    let about = About { member, namespace, ..arguments.swarm.about("node", &swarm) };
    let recording = arguments.record.open(&about, false)?;
    if let Some(recording) = &recording {
        node.record(recording.sink()).map_err(NodeError::from)?;
    }
    let control = node.control();
    tracing::info!(
        "`{}`: {} robots at {:.1} Hz",
        swarm.name,
        control.formation().count(),
        1.0 / control.period()
    );
    node.run(&interrupt_flag());
    print(&close(recording)?);
    Ok(ExitCode::SUCCESS)
}

/// Flies simulated robots until they are interrupted.
pub fn robots(arguments: &RobotsArguments, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    let swarm = arguments.swarm.load()?;
    let mut robots = RobotNodes::open(&swarm, ros)?;
    tracing::info!("`{}`: {} simulated robots", swarm.name, robots.fleet().robots().len());
    robots.run(&interrupt_flag());
    Ok(ExitCode::SUCCESS)
}
