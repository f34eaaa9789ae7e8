//! `flockform node` and `flockform robots`: a swarm over ROS 2, or over shared memory.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::sync_channel;

use clap::{Args, ValueEnum};
use flockform::live::command::Command;
use flockform::live::monitor::{CommandLink, Feed, Monitor};
use flockform::live::server::Server;
use flockform::messages::flockform_msgs::SetFormationRequest;
use flockform::record::About;
use flockform::ros::arguments::RosArguments;
use flockform::ros::edge::pulse::MIDDLEWARE_GONE;
use flockform::ros::edge::pulse::bound_opening;
use flockform::ros::node::{CommandQueue, FormationNode, NodeCommand, NodeError, NodeSnapshot};
use flockform::ros::robots::{Layout, RobotNodes};
use flockform::scene::swarm::Swarm;
use flockform::shm::{self, Domain, ShmError, SimulatedRobots};
use flockform::swarm::control::Control;
use flockform::swarm::control::scope::NodeScopeError;
use serde::{Deserialize, Serialize};

use super::live::{self, PageArguments};
use super::material::wrong;
use super::output::own_command_line;
use super::recording::{RecordArguments, close};
use super::supervise::{Life, supervise};
use super::swarm::SwarmFileArguments;
use super::{FAILED, Refusal, on_terminal, say};
use super::{interrupt, log};

/// Commands of the page that wait for the loop, which takes all of them in a period.
const MOST_COMMANDS: usize = 4;

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
    /// Show the swarm in a browser on this computer while it flies; nothing can be changed from there
    #[arg(long, group = "page")]
    live: bool,
    /// Let the page send commands as ROS 2 peers can, within `node.commands` of the swarm file: stop, resume, move
    #[arg(long, requires = "live")]
    allow_commands: bool,
    #[command(flatten)]
    page: PageArguments,
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
fn life(
    transport: Transport,
    swarm: &SwarmFileArguments,
    ros: &RosArguments,
) -> Result<Result<Option<Life>, ExitCode>, Refusal> {
    match transport {
        Transport::Shm => Ok(Ok(None)),
        Transport::Ros2 => Ok(supervise(&ros.security, || swarm.read())?.map(Some)),
    }
}

/// The swarm as its file was when the flight began.
fn as_begun(swarm: &SwarmFileArguments, life: &mut Option<Life>) -> SwarmFileArguments {
    swarm.as_read(life.as_mut().and_then(|life| life.text.take()))
}

/// Keeps a formation until it is interrupted.
pub fn node(arguments: &NodeArguments, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    let mut life = match life(arguments.transport, &arguments.swarm, ros)? {
        Ok(life) => life,
        Err(code) => return Ok(code),
    };
    // A node has a leave to take, and files of shared memory to remove: an interrupt waits until it is open.
    let interrupted = interrupt::serves();
    let file = as_begun(&arguments.swarm, &mut life);
    let swarm = file.load()?;
    let name = arguments.member.as_deref();
    match life {
        Some(mut life) => {
            // Of what strangers send, and not of what the file takes to be read.
            bound_opening();
            let left: Option<Left> = life.left();
            let page =
                arguments.live.then(|| LivePage::open(arguments, life.number, left.as_ref())).transpose()?;
            let mut node = FormationNode::open(&swarm, ros, name).map_err(|error| refused(&swarm, error))?;
            let (member, namespace) = (arguments.member.clone(), Some(node.fleet().to_owned()));
            let mut about = About { member, namespace, ..file.about("node", &swarm) };
            about.set.extend(node.overrides(&swarm));
            about.taken_over = left.as_ref().map(|left| left.node.control().clone());
            let recording = arguments.record.open(&about, life.number)?;
            if let Some(recording) = &recording {
                node.record(recording.sink()).map_err(NodeError::from)?;
            }
            node.share_log(log::level(), log::lines()).map_err(NodeError::from)?;
            announce(&swarm, node.control());
            if let Some(left) = left {
                node.restore(left.node);
            }
            tracing::info!("{}", node.reached_at());
            let page = page
                .flatten()
                .map(|page| page.serve(&swarm, &mut node, arguments.allow_commands))
                .transpose()?;
            node.watch_middleware().map_err(NodeError::from)?;
            let well = node.run_while(interrupted, &mut |node| {
                page.iter().for_each(|page| page.feed.offer(node.control()));
                let has_changed = node.has_changed();
                life.send(has_changed, || Left {
                    node: node.kept(),
                    page: page.as_ref().map(|page| page.place.clone()),
                })
            });
            live::close(page.and_then(|page| page.door));
            // An interrupt is the end of every node: lost output is no news of it, but an error of its own.
            let lost = close(recording).map_err(Refusal::from).and_then(|words| say(&words)).err();
            lost.iter().for_each(|lost| note!("error: {}", on_terminal(&lost.to_string())));
            return Ok(if well && lost.is_some() { ExitCode::from(FAILED) } else { ended(well) });
        }
        None => {
            arguments.record.require_none("--transport shm")?;
            if arguments.live {
                let message = "over shared memory a node serves no page";
                return Err(wrong("--live", message, "leave it out, or leave out --transport shm").into());
            }
            let domain = Domain::from_environment()?;
            let mut node =
                shm::FormationNode::open(&swarm, &domain, name).map_err(|error| refused(&swarm, error))?;
            announce(&swarm, node.control());
            node.run(interrupted)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The refusal of a node that did not open: of one robot's among several sweeps with the key that has them.
fn refused(swarm: &Swarm, error: impl Into<Refusal>) -> Refusal {
    let refusal = error.into();
    let (Refusal::Node(NodeError::NodeScope(NodeScopeError::NotAlone { name, .. }))
    | Refusal::Shm(ShmError::NodeScope(NodeScopeError::NotAlone { name, .. }))) = &refusal
    else {
        return refusal;
    };
    let sweeps = swarm.raw.control.sweeps;
    if sweeps == 1 {
        return refusal;
    }
    let why = format!("--member {name}: with {sweeps} sweeps its target depends on the whole formation");
    let help = "add --set control.sweeps=1, or run one node for all, without --member";
    swarm.refuse("control.sweeps", why, help).into()
}

/// State that a node's process leaves to the next.
#[derive(Deserialize, Serialize)]
struct Left {
    node: NodeSnapshot,
    /// Port and token of the page.
    page: Option<(u16, String)>,
}

/// A page that shows the flying swarm, in the process of the control loop. The next process serves the same address.
struct LivePage {
    server: Server,
    door: Option<PathBuf>,
}

/// The loop's end of a page that is served.
struct ServedPage {
    feed: Feed,
    place: (u16, String),
    door: Option<PathBuf>,
}

impl LivePage {
    /// The page of the process before this one goes on; a page that cannot be served ends no flight, but refuses to
    /// begin one.
    fn open(arguments: &NodeArguments, life: u32, left: Option<&Left>) -> Result<Option<Self>, Refusal> {
        let again = left.and_then(|left| left.page.clone());
        let server = match again.clone() {
            Some((port, token)) => {
                Server::reopen(port, token).map_err(|source| Refusal::Live { port: Some(port), source })
            }
            None => arguments.page.server(),
        };
        match server {
            Ok(server) => {
                let door = if again.is_none() { arguments.page.announce(&server)? } else { None };
                Ok(Some(Self { server, door }))
            }
            Err(refusal) if life == 1 => Err(refusal),
            Err(refusal) => {
                tracing::warn!("the swarm flies on without its page: {refusal}");
                Ok(None)
            }
        }
    }

    /// Serves the page in threads of its own, which the loop does not wait for.
    fn serve(
        self,
        swarm: &Swarm,
        node: &mut FormationNode,
        allow_commands: bool,
    ) -> Result<ServedPage, Refusal> {
        let Self { server, door } = self;
        let link = allow_commands.then(|| {
            let (send, commands) = sync_channel(MOST_COMMANDS);
            let (answers, answered) = sync_channel(MOST_COMMANDS);
            node.take_commands(CommandQueue { commands, answers });
            let send = move |viewer, command: &Command| {
                let command = node_command(command).ok_or("a node takes no such command")?;
                send.try_send((viewer, command))
                    .map_err(|_| "the node has not done the last commands yet: try again".into())
            };
            CommandLink { send: Box::new(send), answers: answered }
        });
        let (monitor, feed) = Monitor::new(swarm.clone(), link)?;
        let (session, place) = (Box::new(monitor), server.place());
        let command = own_command_line();
        let serve = move || {
            if let Err(error) = server.serve(session, command, PathBuf::new(), interrupt::serves()) {
                tracing::warn!("the page is no longer served: {error}");
            }
        };
        if let Err(error) = std::thread::Builder::new().name("live page".into()).spawn(serve) {
            tracing::warn!("the swarm flies without its page: {error}");
        }
        Ok(ServedPage { feed, place, door })
    }
}

/// The node's own command for one of the page.
fn node_command(command: &Command) -> Option<NodeCommand> {
    Some(match command.clone() {
        Command::EmergencyStop {} => NodeCommand::EmergencyStop,
        Command::Resume {} => NodeCommand::Resume,
        Command::Activate {} => NodeCommand::ChangeState("activate"),
        Command::Deactivate {} => NodeCommand::ChangeState("deactivate"),
        Command::SetFormation { name, translate, rotate, stretch, shear, duration } => {
            NodeCommand::SetFormation(SetFormationRequest {
                name,
                translate,
                rotate,
                stretch,
                shear,
                duration,
            })
        }
        _ => return None,
    })
}

fn announce(swarm: &Swarm, control: &Control) {
    let (count, rate) = (control.formation().count(), 1.0 / control.period());
    tracing::info!("`{}`: {count} robots at {rate:.1} Hz", swarm.name);
}

/// Flies simulated robots until they are interrupted.
pub fn robots(arguments: &RobotsArguments, ros: &RosArguments) -> Result<ExitCode, Refusal> {
    let mut life = match life(arguments.transport, &arguments.swarm, ros)? {
        Ok(life) => life,
        Err(code) => return Ok(code),
    };
    let interrupted = interrupt::serves();
    let swarm = as_begun(&arguments.swarm, &mut life).load()?;
    let announce = |count| tracing::info!("`{}`: {count} simulated robots", swarm.name);
    match life {
        Some(mut life) => {
            let layout = if arguments.node_per_robot { Layout::NodePerRobot } else { Layout::OneNode };
            bound_opening();
            let mut robots = RobotNodes::open(&swarm, ros, layout)?;
            robots.share_log(log::level(), log::lines()).map_err(NodeError::from)?;
            announce(robots.fleet().robots().len());
            tracing::info!("{}", robots.reached_at());
            if let Some(left) = life.left() {
                robots.restore(&left);
            }
            robots.watch_middleware().map_err(NodeError::from)?;
            return Ok(ended(
                robots.run_while(interrupted, &mut |robots| life.send(false, || robots.kept())),
            ));
        }
        None if arguments.node_per_robot => {
            let message = "robots are no ROS 2 nodes over shared memory";
            return Err(
                wrong("--node-per-robot", message, "leave it out, or leave out --transport shm").into()
            );
        }
        None => {
            let mut robots = SimulatedRobots::open(&swarm, &Domain::from_environment()?)?;
            announce(robots.fleet().robots().len());
            robots.run(interrupted)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
