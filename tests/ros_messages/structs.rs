//! Every struct against its definition.

use std::path::PathBuf;

use flockform::messages::builtin_interfaces::{Duration, Time};
use flockform::messages::definitions;
use flockform::messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use flockform::messages::flockform_msgs::{
    FormationState, LoopEvent, MemberState, Ranges, SetFormationRequest, SetFormationResponse,
};
use flockform::messages::geometry_msgs::*;
use flockform::messages::nav_msgs::Odometry;
use flockform::messages::rcl_interfaces::Log;
use flockform::messages::rosgraph_msgs::Clock;
use flockform::messages::sensor_msgs::CompressedImage;
use flockform::messages::std_msgs::{ColorRGBA, Header};
use flockform::messages::tf2_msgs::TFMessage;
use flockform::messages::visualization_msgs::{Marker, MarkerArray, MeshFile, UVCoordinate};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::definition;
use crate::sample::{Shape, sample};
use crate::wire::{decode, encode};

/// A struct of the crate, filled: what there is to hold against its definition.
pub struct Filled {
    /// `package/Name`; services have `_Request` and `_Response` at the end.
    pub name: String,
    pub shape: Shape,
    /// The sample, for the reference encoder.
    pub json: serde_json::Value,
    /// The sample as this crate sends it.
    pub bytes: Vec<u8>,
    /// Tries to read bytes as this type; whether it could.
    pub decodes: fn(&[u8]) -> bool,
}

pub fn filled<T>(name: String) -> Filled
where
    T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug,
{
    let (sample, shape) = sample::<T>();
    let bytes = encode(&sample);
    assert_eq!(decode::<T>(&bytes).expect("our own bytes"), sample, "{name}");
    let json = serde_json::to_value(&sample).expect("plain data");
    Filled { name, shape, json, bytes, decodes: |bytes| decode::<T>(bytes).is_ok() }
}

macro_rules! all {
    ($($message:ident),+ $(,)?) => {{
        use flockform::messages::Message;
        vec![$(filled::<$message>(format!("{}/{}", $message::PACKAGE, $message::NAME))),+]
    }};
}

/// Every message and both halves of every service.
pub fn every_struct() -> Vec<Filled> {
    let mut all = all![
        Time,
        Duration,
        Header,
        ColorRGBA,
        Point,
        Vector3,
        Quaternion,
        Pose,
        PoseStamped,
        PoseWithCovariance,
        PoseWithCovarianceStamped,
        PoseArray,
        Twist,
        TwistStamped,
        TwistWithCovariance,
        Transform,
        TransformStamped,
        Odometry,
        Clock,
        TFMessage,
        CompressedImage,
        KeyValue,
        DiagnosticStatus,
        DiagnosticArray,
        Log,
        UVCoordinate,
        MeshFile,
        Marker,
        MarkerArray,
        MemberState,
        FormationState,
        LoopEvent,
        Ranges,
    ];
    all.push(filled::<SetFormationRequest>("flockform_msgs/SetFormation_Request".into()));
    all.push(filled::<SetFormationResponse>("flockform_msgs/SetFormation_Response".into()));
    all
}

/// The interface package in the checkout.
pub fn package() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("msgs/flockform_msgs")
}

/// The names of the files in a folder of the package.
pub fn files(folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(package().join(folder)).expect("part of the checkout");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

pub fn text(file: &str) -> String {
    std::fs::read_to_string(package().join(file)).expect("part of the checkout")
}

/// Every definition there is a struct for, by `package/Name`.
fn every_definition() -> Vec<(String, definition::Definition)> {
    let mut all: Vec<_> = definitions::STANDARD
        .iter()
        .map(|(name, text)| (name.to_string(), definition::parse(text)))
        .collect();
    for file in files("msg") {
        let name = file.strip_suffix(".msg").expect("a message");
        all.push((format!("flockform_msgs/{name}"), definition::parse(&text(&format!("msg/{file}")))));
    }
    for file in files("srv") {
        let name = file.strip_suffix(".srv").expect("a service");
        let [request, response] = definition::parse_service(&text(&format!("srv/{file}")));
        all.push((format!("flockform_msgs/{name}_Request"), request));
        all.push((format!("flockform_msgs/{name}_Response"), response));
    }
    all
}

#[test]
fn every_struct_has_the_fields_of_its_definition_in_their_order() {
    let definitions = every_definition();
    let structs = every_struct();
    for Filled { name, shape, .. } in &structs {
        let (_, definition) = definitions
            .iter()
            .find(|(defined, _)| defined == name)
            .unwrap_or_else(|| panic!("{name}: no definition"));
        assert_eq!(shape.fields, definition.fields, "{name}");
        let (_, plain) = name.split_once('/').expect("package/Name");
        assert_eq!(shape.name, plain.replace('_', ""), "{name}");
    }
    for (name, _) in &definitions {
        assert!(structs.iter().any(|filled| filled.name == *name), "{name} has no struct");
    }
}

#[test]
fn every_constant_has_the_value_of_its_definition() {
    macro_rules! constants {
        ($message:ident: $($constant:ident),+ $(,)?) => {
            vec![$((stringify!($constant).to_string(), i64::from($message::$constant))),+]
        };
    }
    let expected = [
        ("rcl_interfaces/Log", constants![Log: DEBUG, INFO, WARN, ERROR, FATAL]),
        ("diagnostic_msgs/DiagnosticStatus", constants![DiagnosticStatus: OK, WARN, ERROR, STALE]),
        (
            "visualization_msgs/Marker",
            constants![Marker: ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, CUBE_LIST, SPHERE_LIST,
                POINTS, TEXT_VIEW_FACING, MESH_RESOURCE, TRIANGLE_LIST, ARROW_STRIP, ADD, MODIFY, DELETE,
                DELETEALL],
        ),
        (
            "flockform_msgs/MemberState",
            constants![MemberState: LEADER, FOLLOWER, WAITING, FRESH, HELD, DEGRADED, STOPPED, SPEED_LIMITED,
                ACCELERATION_LIMITED, GEOFENCED, SEPARATED, OBSTRUCTED, RESOLVING_DEADLOCK, NEIGHBOUR_LOST,
                TRIMMED, POSE_REJECTED],
        ),
        (
            "flockform_msgs/FormationState",
            constants![FormationState: RUNNING, HOLDING, EMERGENCY_STOPPED, INACTIVE],
        ),
        (
            "flockform_msgs/LoopEvent",
            constants![LoopEvent: TICK, ACTIVE, INACTIVE, EMERGENCY_STOP, RESUME, MANOEUVRE, POSTURE, PARAMETER, CONFIGURE],
        ),
    ];
    for (name, definition) in every_definition() {
        let ours = expected.iter().find(|(with, _)| *with == name).map_or(&[][..], |(_, ours)| ours);
        assert_eq!(definition.constants, ours, "{name}");
    }
}
