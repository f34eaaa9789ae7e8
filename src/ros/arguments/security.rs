//! DDS security as ROS 2 asks for it (SROS2): which enclave's keys a process takes part with, or none.
//!
//! The rules are those of `rcl` (`security.c`): security is on where `ROS_SECURITY_ENABLE` is exactly `true`; the
//! enclave is `/`, or what `--enclave` says, or what `ROS_SECURITY_ENCLAVE_OVERRIDE` says before it; its keys are in
//! `$ROS_SECURITY_KEYSTORE/enclaves/...`; where they cannot be used, `ROS_SECURITY_STRATEGY=Enforce` ends the process,
//! and any other strategy lets it take part in the clear. Unlike there, nothing that asks for security and gets none
//! passes without a warning, and a file that this node would not honour counts as one that cannot be used.

use std::path::PathBuf;

use super::RosArgumentError;
#[cfg(feature = "security")]
use super::enclave;

/// The enclave of a process that names none.
pub(super) const ROOT: &str = "/";

/// The environment's request for DDS security, as typed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SecurityRequest {
    /// `ROS_SECURITY_ENABLE`: on if exactly `true`.
    pub enable: Option<String>,
    /// `ROS_SECURITY_STRATEGY`: enforced if exactly `Enforce`.
    pub strategy: Option<String>,
    /// `ROS_SECURITY_KEYSTORE`, a folder.
    pub keystore: Option<PathBuf>,
    /// `ROS_SECURITY_ENCLAVE_OVERRIDE`, before `--enclave`.
    pub enclave: Option<String>,
}

/// How a process takes part; the default is in the clear, with no request for anything else.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Security {
    /// The folder of the enclave whose keys are used; none in the clear, as always without the feature `security`.
    pub enclave: Option<PathBuf>,
    /// The request that is not met.
    pub warnings: Vec<String>,
}

/// Why the keys of an enclave are not used, or not as their files ask.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {reason}")]
pub(super) struct Fault {
    /// File, folder or variable.
    pub place: String,
    pub reason: String,
    pub help: &'static str,
    pub gravity: Gravity,
}

/// How much a fault matters; the gravest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Gravity {
    /// It leaves no keys to use.
    Unusable,
    /// The keys are usable, but not as their files ask.
    #[cfg_attr(not(feature = "security"), expect(dead_code, reason = "of the files of an enclave"))]
    Dishonoured,
    /// The files are honoured, and protect less than they might.
    Weak,
}

impl SecurityRequest {
    pub(super) fn read(variable: &dyn Fn(&str) -> Option<String>) -> Self {
        Self {
            enable: variable("ROS_SECURITY_ENABLE"),
            strategy: variable("ROS_SECURITY_STRATEGY"),
            keystore: variable("ROS_SECURITY_KEYSTORE").map(PathBuf::from),
            enclave: variable("ROS_SECURITY_ENCLAVE_OVERRIDE"),
        }
    }

    fn is_enabled(&self) -> bool {
        self.enable.as_deref() == Some("true")
    }

    fn is_enforced(&self) -> bool {
        self.strategy.as_deref() == Some("Enforce")
    }

    /// How a process takes part that was started with this `--enclave`, if with any.
    ///
    /// # Errors
    /// Security that is enforced and cannot be had.
    pub(super) fn settle(&self, argument: Option<&str>) -> Result<Security, RosArgumentError> {
        if !self.is_enabled() {
            let warnings = self.unheeded(argument).map(in_the_clear).into_iter().collect();
            return Ok(Security { enclave: None, warnings });
        }
        let (folder, faults) = self.keys(argument);
        let refused = faults.iter().find(|fault| fault.gravity < Gravity::Weak);
        if self.is_enforced()
            && let Some(Fault { place, reason, help, .. }) = refused.cloned()
        {
            return Err(RosArgumentError::Security { place, reason, help });
        }
        let enclave = folder.filter(|_| faults.iter().all(|fault| fault.gravity > Gravity::Unusable));
        let mut warnings: Vec<String> = faults.iter().map(Fault::to_string).collect();
        match &enclave {
            None => warnings = vec![in_the_clear(warnings.join("; "))],
            Some(_) => warnings.extend(self.odd_strategy()),
        }
        Ok(Security { enclave, warnings })
    }

    /// The folder of the enclave, if its name leads to one, and what is wrong with it.
    #[cfg(feature = "security")]
    fn keys(&self, argument: Option<&str>) -> (Option<PathBuf>, Vec<Fault>) {
        let name = self.enclave.as_deref().or(argument).unwrap_or(ROOT);
        match enclave::folder(self.keystore.as_deref(), name) {
            Ok(folder) => {
                let faults = enclave::faults(&folder);
                (Some(folder), faults)
            }
            Err(fault) => (None, vec![fault]),
        }
    }

    #[cfg(not(feature = "security"))]
    fn keys(&self, _: Option<&str>) -> (Option<PathBuf>, Vec<Fault>) {
        let fault = Fault {
            place: "ROS_SECURITY_ENABLE=true".into(),
            reason: "this program was built without the feature `security` and speaks unsecured DDS".into(),
            help: "build it with `--features security`, or set ROS_SECURITY_ENABLE=false for this process",
            gravity: Gravity::Unusable,
        };
        (None, vec![fault])
    }

    /// Requests for security though it is not on.
    fn unheeded(&self, argument: Option<&str>) -> Option<String> {
        let asked = [
            self.enable
                .as_ref()
                .filter(|value| *value != "false")
                .map(|value| format!("ROS_SECURITY_ENABLE={value}")),
            self.is_enforced().then(|| "ROS_SECURITY_STRATEGY=Enforce".to_owned()),
            self.enclave.as_ref().map(|name| format!("ROS_SECURITY_ENCLAVE_OVERRIDE={name}")),
            argument.filter(|name| *name != ROOT).map(|name| format!("--enclave {name}")),
        ];
        let asked: Vec<String> = asked.into_iter().flatten().collect();
        (!asked.is_empty())
            .then(|| format!("{} without ROS_SECURITY_ENABLE=true does nothing", asked.join(", ")))
    }

    /// A strategy that reads like one and is none.
    fn odd_strategy(&self) -> Option<String> {
        let value = self.strategy.as_deref().filter(|value| !matches!(*value, "Enforce" | "Permissive"))?;
        Some(format!("ROS_SECURITY_STRATEGY={value} is not `Enforce`: security is permissive"))
    }
}

fn in_the_clear(reason: impl std::fmt::Display) -> String {
    format!("no DDS security: everything is sent and taken in the clear ({reason})")
}

/// Why this is no name of an enclave; none where it is one (rcl validates them as namespaces).
pub(super) fn fault_of_name(name: &str) -> Option<&'static str> {
    let is_word = |word: &str| {
        !word.is_empty()
            && !word.starts_with(|c: char| c.is_ascii_digit())
            && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    match name.strip_prefix('/') {
        None => Some("an enclave's name begins with a slash"),
        Some("") => None,
        Some(rest) if rest.split('/').all(is_word) => None,
        Some(_) => Some("an enclave's name has letters, digits and underscores between single slashes"),
    }
}
