//! The environment variables that ROS 2 nodes read.

use super::RosArgumentError;
use super::security::SecurityRequest;
use super::value::integer;

/// Largest domain whose ports fit below 65536 (RTPS 2.3, section 9.6.1: 7400 + 250 domain).
pub const LARGEST_DOMAIN: u16 = 232;

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

/// The environment variables of ROS 2; `Default` is an empty environment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// DDS domain (`ROS_DOMAIN_ID`), 0 to 232 \[default: 0\].
    pub domain: u16,
    /// How far to discover (`ROS_LOCALHOST_ONLY` before `ROS_AUTOMATIC_DISCOVERY_RANGE`)
    /// \[default: subnet\].
    pub discovery: DiscoveryRange,
    /// The middleware of the nodes around (`RMW_IMPLEMENTATION`), as typed: it decides how services
    /// are called.
    pub middleware: Option<String>,
    /// The request for DDS security.
    pub security: SecurityRequest,
}

impl Environment {
    /// Reads the variables through `look_up`; an empty one counts as not set.
    ///
    /// # Errors
    /// A domain that is no whole number from 0 to 232, an unknown discovery range, and what this node cannot do:
    /// discovery that is off, peers by address.
    pub fn read(look_up: &dyn Fn(&str) -> Option<String>) -> Result<Self, RosArgumentError> {
        let variable = |name: &str| look_up(name).filter(|value| !value.is_empty());
        let domain = variable("ROS_DOMAIN_ID").map_or(Ok(0), read_domain)?;
        let localhost_only = variable("ROS_LOCALHOST_ONLY").is_some_and(|value| value.starts_with('1'));
        let discovery = match variable("ROS_AUTOMATIC_DISCOVERY_RANGE") {
            _ if localhost_only => DiscoveryRange::Localhost,
            Some(range) => read_range(range)?,
            None => DiscoveryRange::default(),
        };
        if let Some(value) =
            variable("ROS_STATIC_PEERS").filter(|peers| peers.split(';').any(|p| !p.is_empty()))
        {
            return Err(RosArgumentError::Environment {
                variable: "ROS_STATIC_PEERS",
                value,
                reason: "this node finds peers by multicast and on this computer, not by address",
                help: "unset it for this process and let multicast reach the peers, or run it beside them",
            });
        }
        Ok(Self {
            domain,
            discovery,
            middleware: variable("RMW_IMPLEMENTATION"),
            security: SecurityRequest::read(&variable),
        })
    }
}

fn read_domain(value: String) -> Result<u16, RosArgumentError> {
    let domain = integer(&value).and_then(|number| u16::try_from(number).ok());
    domain.filter(|domain| *domain <= LARGEST_DOMAIN).ok_or(RosArgumentError::Environment {
        variable: "ROS_DOMAIN_ID",
        value,
        reason: "is no whole number from 0 to 232",
        help: "set a domain from 0 to 232 (0 to 101 is safe on every system), or unset it for 0",
    })
}

fn read_range(value: String) -> Result<DiscoveryRange, RosArgumentError> {
    Ok(match value.as_str() {
        "OFF" => {
            return Err(RosArgumentError::Environment {
                variable: "ROS_AUTOMATIC_DISCOVERY_RANGE",
                value,
                reason: "the node would discover no robot, not even on this computer",
                help: "set LOCALHOST for this computer alone, or use --transport shm, which opens no socket",
            });
        }
        "LOCALHOST" => DiscoveryRange::Localhost,
        "SUBNET" => DiscoveryRange::Subnet,
        "SYSTEM_DEFAULT" => DiscoveryRange::SystemDefault,
        _ => {
            return Err(RosArgumentError::Environment {
                variable: "ROS_AUTOMATIC_DISCOVERY_RANGE",
                value,
                reason: "is no discovery range",
                help: "set LOCALHOST, SUBNET or SYSTEM_DEFAULT, or unset it for SUBNET",
            });
        }
    })
}
