//! `diagnostic_msgs`: what `/diagnostics` carries.

use super::messages;
use super::std_msgs::Header;

messages! { "diagnostic_msgs";
    KeyValue { key: String, value: String }

    DiagnosticStatus {
        /// One of the constants.
        level: u8,
        /// Component this is about.
        name: String,
        message: String,
        hardware_id: String,
        values: Vec<KeyValue>,
    }

    DiagnosticArray { header: Header, status: Vec<DiagnosticStatus> }
}

impl DiagnosticStatus {
    pub const OK: u8 = 0;
    pub const WARN: u8 = 1;
    pub const ERROR: u8 = 2;
    pub const STALE: u8 = 3;
}
