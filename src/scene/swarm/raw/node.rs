//! The ROS 2 side as written: topics, types and frames.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Topics and messages of the node. `{name}` in a topic stands for the robot's name; a topic without a slash before it is
/// below the fleet's namespace, which `--ros-args -r __ns:=/NAMESPACE` gives.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RawNode {
    /// Frame of every pose (REP 105).
    pub frame_id: String,
    /// Written before the frames that robots carry, `{name}/base_link`: those of simulated ones on `/tf`, and those of velocities.
    /// The fleet's namespace and a slash unless given, and nothing in the root.
    pub frame_prefix: Option<String>,
    /// The message type of poses.
    pub pose_type: RawPoseType,
    /// Topic of each robot's pose, or of the array of all.
    pub pose_topic: String,
    /// Robots whose poses the node of one robot (`--member`) receives; with `[ranges]` all, for a lie is found by those that measure.
    pub hears: RawHears,
    /// The message type of targets.
    pub target_type: RawTargetType,
    /// Topic of each robot's target, or of the array of all.
    pub target_topic: String,
    /// Topic of the next place of each leader with an `external` program, a `geometry_msgs/PoseStamped`.
    pub leader_topic: String,
    /// Topic of the ranges that each robot measures of others, a `flockform_msgs/Ranges`; needs `[ranges]`.
    pub ranges_topic: String,
    /// Publishes velocities towards the targets too.
    pub velocity: Option<RawVelocityType>,
    /// Topic of each robot's velocity.
    pub velocity_topic: String,
    /// A `std_msgs/Empty` on this topic stops every robot, as the service `~/emergency_stop` does. A topic reaches the node that
    /// flies now, whatever a client's graph remembers of earlier ones.
    pub emergency_stop_topic: String,
    /// Publishes `visualization_msgs/MarkerArray` on `~/markers`; recordings have them in any case.
    pub markers: bool,
    /// Services of the node beside its commands, and of the node of simulated robots. Each costs every peer of the network endpoints
    /// to discover.
    pub services: Vec<RawService>,
    /// Commands that the node accepts from the network.
    pub commands: RawCommands,
}

impl Default for RawNode {
    fn default() -> Self {
        Self {
            frame_id: "map".into(),
            frame_prefix: None,
            pose_type: RawPoseType::default(),
            pose_topic: "{name}/pose".into(),
            hears: RawHears::default(),
            target_type: RawTargetType::default(),
            target_topic: "{name}/target_pose".into(),
            leader_topic: "{name}/leader_pose".into(),
            ranges_topic: "{name}/ranges".into(),
            velocity: None,
            velocity_topic: "{name}/cmd_vel".into(),
            emergency_stop_topic: "~/emergency_stop_request".into(),
            markers: false,
            services: vec![RawService::Parameters, RawService::Lifecycle],
            commands: RawCommands::default(),
        }
    }
}

impl RawNode {
    /// Whether the node has these services.
    pub fn serves(&self, service: RawService) -> bool {
        self.services.contains(&service)
    }

    /// Frame that a robot of a fleet carries (REP 105).
    pub(crate) fn body_frame(&self, fleet: &str, name: &str) -> String {
        let below_fleet = || format!("{fleet}/").trim_start_matches('/').to_owned();
        let prefix = self.frame_prefix.clone().unwrap_or_else(below_fleet);
        format!("{prefix}{name}/base_link")
    }

    /// Whether all targets are one message.
    pub(crate) fn has_target_array(&self) -> bool {
        self.target_type == RawTargetType::PoseArray
    }

    /// Gives an array whose topic is not named in the file a name without a robot's in it.
    pub(in crate::scene::swarm) fn name_arrays(&mut self) {
        let unnamed = Self::default();
        if self.pose_type == RawPoseType::PoseArray && self.pose_topic == unnamed.pose_topic {
            self.pose_topic = "poses".into();
        }
        if self.has_target_array() && self.target_topic == unnamed.target_topic {
            self.target_topic = "target_poses".into();
        }
    }
}

/// Services by kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawService {
    /// `ros2 param`: six services and `/parameter_events`.
    Parameters,
    /// `ros2 lifecycle`: five services.
    Lifecycle,
    /// The topic `~/transition_event`.
    TransitionEvents,
    /// `~/get_logger_levels` and `~/set_logger_levels`.
    LoggerLevels,
    /// `~/get_type_description`.
    TypeDescription,
}

named! {
    /// Commands that are accepted while the node runs. The limits of the file hold in any case: commands can
    /// tighten them and never loosen them.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    pub enum RawCommands {
        /// None: services refuse, parameters are read-only, leaders are moved by the file's programs alone.
        None => "none",
        /// Emergency stop, and the lifecycle's way out of active.
        StopOnly => "stop-only",
        /// All services, parameters, and the topics of leaders that are led from outside.
        #[default]
        All => "all",
    }
}

impl RawCommands {
    /// Whether an emergency stop is accepted.
    pub fn may_stop(self) -> bool {
        self != Self::None
    }

    /// Whether everything is accepted.
    pub fn may_do_all(self) -> bool {
        self == Self::All
    }
}

/// Message that carries poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawPoseType {
    /// `geometry_msgs/PoseStamped`.
    #[default]
    PoseStamped,
    /// `geometry_msgs/PoseWithCovarianceStamped`.
    PoseWithCovarianceStamped,
    /// `nav_msgs/Odometry`.
    Odometry,
    /// One `geometry_msgs/PoseArray` for all, in the order of the robots, on `pose_topic`, which then is `poses` unless given.
    PoseArray,
}

/// Robots whose poses the node of one robot receives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawHears {
    /// All where `limits.clearance` is given, for any of them may come near; otherwise the neighbours.
    #[default]
    All,
    /// The robots that its own follows: from others it keeps no distance.
    Neighbours,
}

/// Message that carries targets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawTargetType {
    /// `geometry_msgs/PoseStamped`.
    #[default]
    PoseStamped,
    /// One `geometry_msgs/PoseArray` for all, in the order of the robots, on `target_topic`, which then is `target_poses` unless
    /// given. Robots that are sent nowhere have places that are not numbers.
    PoseArray,
}

/// Message that carries velocities.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RawVelocityType {
    /// `geometry_msgs/Twist`.
    Twist,
    /// `geometry_msgs/TwistStamped`, in the frame that the robot carries.
    TwistStamped,
}
