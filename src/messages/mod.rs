//! Messages: their structs, one file per interface package, their encoding, and the names of the topics they travel on.
//!
//! A message on the wire (CDR) has no field names: **the order of the fields of each struct is the
//! format**. `tests/ros_messages` holds every struct here against its `.msg` text, and against a
//! reference encoder byte for byte. Names, units and frames are those of the packages (REP 103: SI,
//! right-handed; REP 105: frames).
//!
//! * [`wire`]: the encoding. [`interface`]: what a struct needs to be a message or a service.
//! * [`names`], [`remap`]: names of nodes and topics, and what a user makes of them.
//! * [`formation`]: what a formation's loop publishes and accepts; [`recorder`]: copies of it.
//! * [`said()`]: text from the network, fit to be shown.
//!
//! Nothing here opens a socket or a file.

pub mod builtin_interfaces;
pub mod definitions;
pub mod diagnostic_msgs;
pub mod flockform_msgs;
pub mod formation;
pub mod geometry_msgs;
pub mod interface;
pub mod lifecycle_msgs;
pub mod names;
pub mod nav_msgs;
pub mod rcl_interfaces;
pub mod recorder;
pub mod remap;
pub mod rosgraph_msgs;
mod said;
pub mod sensor_msgs;
pub mod std_msgs;
pub mod std_srvs;
pub mod tf2_msgs;
pub mod type_description_interfaces;
pub mod visualization_msgs;
pub mod wire;

pub use interface::{Message, ServiceType};
pub use said::{escaped, said};

/// Structs with all that a message needs besides its name; the attributes of each may derive more.
macro_rules! structs {
    ($($(#[$about:meta])* $name:ident { $($(#[$of:meta])* $field:ident: $kind:ty),* $(,)? })+) => {$(
        $(#[$about])*
        #[derive(Clone, Debug, Default, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        pub struct $name { $($(#[$of])* pub $field: $kind,)* }
    )+};
}
use structs;

/// The messages of one package, each with all fields of its `.msg` file in their order; or names for structs that are
/// written out elsewhere.
macro_rules! messages {
    ($package:literal; $($(#[$about:meta])* $name:ident { $($fields:tt)* })+) => {$(
        $crate::messages::structs! {
            #[doc = concat!("`", $package, "/msg/", stringify!($name), "`.")]
            $(#[$about])*
            $name { $($fields)* }
        }
        $crate::messages::messages!($package: $name);
    )+};
    ($package:literal: $($message:ident),+) => {$(
        impl $crate::messages::Message for $message {
            const PACKAGE: &'static str = $package;
            const NAME: &'static str = stringify!($message);
        }
    )+};
}
use messages;

/// The services of one package, each by the structs of its request and response.
macro_rules! services {
    ($package:literal; $($(#[$about:meta])* $name:ident: $request:ident => $response:ident;)+) => {$(
        #[doc = concat!("`", $package, "/srv/", stringify!($name), "`.")]
        $(#[$about])*
        pub struct $name;

        impl $crate::messages::ServiceType for $name {
            const PACKAGE: &'static str = $package;
            const NAME: &'static str = stringify!($name);
            type Request = $request;
            type Response = $response;
        }
    )+};
}
use services;
