//! The way of a process into the network.

use super::arguments::{DiscoveryRange, RosArguments};
use super::edge::{Edge, EdgeError, Options};
use crate::messages::escaped;

/// Characters of a warning that are logged \[1\].
const LONGEST: usize = 1000;

/// Joins where and as the environment says: in the clear, or with the keys of an enclave.
///
/// # Errors
/// As [`Edge::open`].
pub fn join(arguments: &RosArguments) -> Result<Edge, EdgeError> {
    let environment = &arguments.environment;
    let loopback_only = environment.discovery == DiscoveryRange::Localhost;
    let options = Options { domain: environment.domain, loopback_only };
    for warning in environment.warnings.iter().chain(&arguments.security.warnings) {
        tracing::warn!("{}", escaped(warning, LONGEST));
    }
    #[cfg(feature = "security")]
    if let Some(enclave) = &arguments.security.enclave {
        tracing::info!("secured with the keys in {}", enclave.display());
        return Edge::open_in_enclave(options, enclave);
    }
    Edge::open(options)
}
