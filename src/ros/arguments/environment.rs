//! The environment variables that ROS 2 nodes read.

use super::RosArgumentError;
use super::security::SecurityRequest;
use super::value::integer;

/// Largest domain whose ports fit below 65536 (RTPS 2.3, section 9.6.1: 7400 + 250 domain).
pub(crate) const LARGEST_DOMAIN: u16 = 232;

/// How far nodes look for each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DiscoveryRange {
    /// This machine only.
    Localhost,
    /// All hosts that multicast reaches.
    #[default]
    Subnet,
    /// The middleware's own default.
    SystemDefault,
}

/// Middleware that nodes on DDS exchange with: their wire format is RTPS.
const ON_DDS: [&str; 5] = [
    "rmw_fastrtps_cpp",
    "rmw_fastrtps_dynamic_cpp",
    "rmw_cyclonedds_cpp",
    "rmw_connextdds",
    "rmw_gurumdds_cpp",
];

/// Settings of one middleware alone. Nodes on others, this one included, do not read them.
const OF_OTHERS: [(&str, &str); 6] = [
    ("CYCLONEDDS_URI", "Cyclone DDS"),
    ("FASTRTPS_DEFAULT_PROFILES_FILE", "Fast DDS"),
    ("FASTDDS_DEFAULT_PROFILES_FILE", "Fast DDS"),
    ("FASTDDS_BUILTIN_TRANSPORTS", "Fast DDS"),
    ("NDDS_QOS_PROFILES", "Connext"),
    ("NDDS_DISCOVERY_PEERS", "Connext"),
];

/// The environment variables of ROS 2; `Default` is an empty environment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// DDS domain (`ROS_DOMAIN_ID`), 0 to 232 \[default: 0\].
    pub domain: u16,
    /// How far to discover (`ROS_LOCALHOST_ONLY` before `ROS_AUTOMATIC_DISCOVERY_RANGE`)
    /// \[default: subnet\].
    pub discovery: DiscoveryRange,
    /// The middleware of the nodes around (`RMW_IMPLEMENTATION`), one on DDS.
    pub middleware: Option<String>,
    /// Variables that are set and have no effect here, in words.
    pub warnings: Vec<String>,
    /// The request for DDS security.
    pub security: SecurityRequest,
}

impl Environment {
    /// Reads the variables through `look_up`; an empty one counts as not set.
    ///
    /// # Errors
    /// A domain that is no whole number from 0 to 232, an unknown discovery range, and what this node cannot do:
    /// discovery that is off, peers by address or from a server, a middleware that is not DDS.
    pub fn read(look_up: &dyn Fn(&str) -> Option<String>) -> Result<Self, RosArgumentError> {
        let variable = |name: &str| look_up(name).filter(|value| !value.is_empty());
        let domain = variable("ROS_DOMAIN_ID").map_or(Ok(0), read_domain)?;
        let localhost_only = variable("ROS_LOCALHOST_ONLY").is_some_and(|value| value.starts_with('1'));
        let discovery = match variable("ROS_AUTOMATIC_DISCOVERY_RANGE") {
            _ if localhost_only => DiscoveryRange::Localhost,
            Some(range) => read_range(range)?,
            None => DiscoveryRange::default(),
        };
        if let Some(refusal) = unreachable_peers(&variable) {
            return Err(refusal);
        }
        Ok(Self {
            domain,
            discovery,
            middleware: variable("RMW_IMPLEMENTATION").map(read_middleware).transpose()?,
            warnings: OF_OTHERS.iter().filter(|(name, _)| variable(name).is_some()).map(of_others).collect(),
            security: SecurityRequest::read(&variable),
        })
    }
}

/// Peers that are found in ways that this node does not have.
fn unreachable_peers(variable: &dyn Fn(&str) -> Option<String>) -> Option<RosArgumentError> {
    let names_any = |peers: &String| peers.split(';').any(|peer| !peer.is_empty());
    let ways = [
        (
            "ROS_STATIC_PEERS",
            "this node finds peers by multicast and on this computer, not by address",
            "unset it for this process and let multicast reach the peers, or run it beside them",
        ),
        (
            "ROS_DISCOVERY_SERVER",
            "this node finds peers by multicast, not from a server of Fast DDS, and peers that ask one do not find it",
            "unset it for this process and for its peers",
        ),
    ];
    ways.into_iter()
        .find_map(|(name, reason, help)| Some(refused(name, variable(name).filter(names_any)?, reason, help)))
}

fn refused(
    variable: &'static str,
    value: String,
    reason: &'static str,
    help: &'static str,
) -> RosArgumentError {
    RosArgumentError::Environment { variable, value, reason, help }
}

fn read_middleware(value: String) -> Result<String, RosArgumentError> {
    if ON_DDS.contains(&value.as_str()) {
        return Ok(value);
    }
    let reason = "this node speaks DDS, and nodes on a middleware that is not known to do so do not hear it";
    let help = "run its peers on rmw_fastrtps_cpp or rmw_cyclonedds_cpp; if they are on DDS, unset it for this process";
    Err(refused("RMW_IMPLEMENTATION", value, reason, help))
}

fn of_others((name, middleware): &(&str, &str)) -> String {
    format!("{name} has no effect on this node: it is for nodes on {middleware}")
}

fn read_domain(value: String) -> Result<u16, RosArgumentError> {
    let domain = integer(&value).and_then(|number| u16::try_from(number).ok());
    let help = "set a domain from 0 to 232 (0 to 101 is safe on every system), or unset it for 0";
    let refused = refused("ROS_DOMAIN_ID", value, "is no whole number from 0 to 232", help);
    domain.filter(|domain| *domain <= LARGEST_DOMAIN).ok_or(refused)
}

fn read_range(value: String) -> Result<DiscoveryRange, RosArgumentError> {
    let (reason, help) = match value.as_str() {
        "LOCALHOST" => return Ok(DiscoveryRange::Localhost),
        "SUBNET" => return Ok(DiscoveryRange::Subnet),
        "SYSTEM_DEFAULT" => return Ok(DiscoveryRange::SystemDefault),
        "OFF" => (
            "the node would discover no robot, not even on this computer",
            "set LOCALHOST for this computer alone, or use --transport shm, which opens no socket",
        ),
        _ => ("is no discovery range", "set LOCALHOST, SUBNET or SYSTEM_DEFAULT, or unset it for SUBNET"),
    };
    Err(refused("ROS_AUTOMATIC_DISCOVERY_RANGE", value, reason, help))
}
