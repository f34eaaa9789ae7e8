//! Which processes meet: those of one domain on one computer.

use std::fmt::Display;

use iceoryx2::prelude::{
    CallbackProgression, Config, FileName, LogLevel, Node, NodeBuilder, NodeName, NodeState,
};
use iceoryx2::prelude::{SemanticString, SignalHandlingMode, ipc, set_log_level_from_env_or};

use super::folders::Folders;
use super::{ShmError, folders};

/// Names the domain, as `ROS_DOMAIN_ID` does for ROS 2.
pub const VARIABLE: &str = "FLOCKFORM_SHM_DOMAIN";

/// A domain: iceoryx2's own unless named. Every file that iceoryx2 makes for a named one begins with `NAME_`, which is
/// its configuration's `global.prefix`.
#[derive(Clone, Debug)]
pub struct Domain {
    config: Config,
}

impl Domain {
    /// The domain that the environment names; unless it does, iceoryx2's own, or `uUSER` where another user has that.
    ///
    /// # Errors
    /// A name that is none.
    pub fn from_environment() -> Result<Self, ShmError> {
        match std::env::var(VARIABLE) {
            Ok(name) if !name.is_empty() => Self::named(&name),
            _ => {
                let config = Config::global_config().clone();
                // Of several users the first has iceoryx2's own domain, the others one each.
                match folders::is_another_s(&config) {
                    None => Ok(Self { config }),
                    Some(user) => {
                        tracing::info!("another user has iceoryx2's own domain: {VARIABLE}=u{user} is taken");
                        Self::named(&format!("u{user}"))
                    }
                }
            }
        }
    }

    /// The domain of this name.
    ///
    /// # Errors
    /// A name that is none.
    pub fn named(name: &str) -> Result<Self, ShmError> {
        let refused = || {
            ShmError::Refused(format!(
                "{VARIABLE}={name:?} is no domain\n  help: give 1 to 32 letters, digits, `-` and `_`, or unset it for \
                 iceoryx2's own"
            ))
        };
        let is_allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        if !(1..=32).contains(&name.len()) || !name.chars().all(is_allowed) {
            return Err(refused());
        }
        let mut config = Config::global_config().clone();
        config.global.prefix = FileName::new(format!("{name}_").as_bytes()).map_err(|_| refused())?;
        Ok(Self { config })
    }

    /// Takes part under a name for diagnosis. The remains of dead peers are cleaned up.
    ///
    /// # Errors
    /// A computer that gives no shared memory.
    pub fn join(&self, name: &str) -> Result<Peer, ShmError> {
        // Errors come back to the caller, which words them.
        set_log_level_from_env_or(LogLevel::Fatal);
        let refused = |reason: &dyn Display| {
            ShmError::Refused(format!(
                "no place in shared memory: {reason}\n  help: is the folder of iceoryx2 (its root path, and /dev/shm) \
                 writable?"
            ))
        };
        let name = NodeName::new(name).map_err(|error| refused(&error))?;
        let folders = Folders::of(&self.config);
        folders.open();
        folders.clear_remains(|| has_peers(&self.config), || clean_up(&self.config, &folders));
        folders.clear_unfinished()?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(&self.config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| refused(&error))?;
        // The last of other peers may have removed them meanwhile, and iceoryx2 have made them this user's alone.
        folders.open();
        Ok(Peer { node, config: self.config.clone(), folders })
    }
}

/// Removes what dead nodes have left, and those of which iceoryx2 cannot.
fn clean_up(config: &Config, folders: &Folders) {
    let _ = Node::<ipc::Service>::list(config, |state| {
        let id = state.node_id().value();
        if let NodeState::Dead(dead) = state
            && dead.try_remove_stale_resources().is_err()
        {
            folders.forget(id);
        }
        CallbackProgression::Continue
    });
}

/// Whether a node lives in the domain, or may.
fn has_peers(config: &Config) -> bool {
    let mut found = false;
    let listed = Node::<ipc::Service>::list(config, |state| {
        found |= !matches!(state, NodeState::Dead(_));
        CallbackProgression::Continue
    });
    found || listed.is_err()
}

/// A process's place in a domain, of one thread.
#[derive(Debug)]
pub struct Peer {
    pub(super) node: Node<ipc::Service>,
    pub(super) config: Config,
    // Dropped after the node, which has its files there.
    folders: Folders,
}

impl Peer {
    /// Refuses or removes what processes left that died while they made it, before it is waited for.
    pub(super) fn clear_unfinished(&self) -> Result<(), ShmError> {
        self.folders.clear_unfinished()
    }

    /// Its node of iceoryx2, for services of your own.
    pub fn node(&self) -> &Node<ipc::Service> {
        &self.node
    }

    /// Gives back what peers that died since held: their places among the readers and the slices they had borrowed.
    pub fn clean_up(&self) {
        let state = self.node.try_cleanup_dead_nodes();
        if state.cleanups > 0 {
            tracing::info!("cleaned up after {} peers that died", state.cleanups);
        }
        if state.failed_cleanups > 0 {
            tracing::debug!("{} dead peers could not be cleaned up", state.failed_cleanups);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_that_would_be_a_path_is_refused_by_name() {
        for name in ["", "../x", "a b", &"x".repeat(33)] {
            let error = Domain::named(name).expect_err("no domain").to_string();
            assert!(error.contains(VARIABLE) && error.contains("help:"), "{error}");
        }
        assert!(Domain::named("lab-2_b").is_ok());
    }
}
