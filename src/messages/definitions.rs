//! The definitions of the messages as text: recordings carry them, so that readers can decode the payloads.

use std::collections::VecDeque;

/// Of the standard messages (ROS 2 Jazzy), without their comments, by `package/Name`.
pub const STANDARD: &[(&str, &str)] = &[
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id"),
    ("std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
    ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"),
    ("geometry_msgs/Pose", "Point position\nQuaternion orientation"),
    ("geometry_msgs/PoseStamped", "std_msgs/Header header\nPose pose"),
    ("geometry_msgs/PoseWithCovariance", "Pose pose\nfloat64[36] covariance"),
    ("geometry_msgs/PoseWithCovarianceStamped", "std_msgs/Header header\nPoseWithCovariance pose"),
    ("geometry_msgs/PoseArray", "std_msgs/Header header\nPose[] poses"),
    ("geometry_msgs/Twist", "Vector3 linear\nVector3 angular"),
    ("geometry_msgs/TwistStamped", "std_msgs/Header header\nTwist twist"),
    ("geometry_msgs/TwistWithCovariance", "Twist twist\nfloat64[36] covariance"),
    ("geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation"),
    ("geometry_msgs/TransformStamped", "std_msgs/Header header\nstring child_frame_id\nTransform transform"),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header
         string child_frame_id
         geometry_msgs/PoseWithCovariance pose
         geometry_msgs/TwistWithCovariance twist",
    ),
    ("rosgraph_msgs/Clock", "builtin_interfaces/Time clock"),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms"),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data"),
    ("diagnostic_msgs/KeyValue", "string key\nstring value"),
    (
        "diagnostic_msgs/DiagnosticStatus",
        "byte OK=0
         byte WARN=1
         byte ERROR=2
         byte STALE=3
         byte level
         string name
         string message
         string hardware_id
         KeyValue[] values",
    ),
    ("diagnostic_msgs/DiagnosticArray", "std_msgs/Header header\nDiagnosticStatus[] status"),
    (
        "rcl_interfaces/Log",
        "byte DEBUG=10
         byte INFO=20
         byte WARN=30
         byte ERROR=40
         byte FATAL=50
         builtin_interfaces/Time stamp
         uint8 level
         string name
         string msg
         string file
         string function
         uint32 line",
    ),
    ("visualization_msgs/UVCoordinate", "float32 u\nfloat32 v"),
    ("visualization_msgs/MeshFile", "string filename\nuint8[] data"),
    (
        "visualization_msgs/Marker",
        "int32 ARROW=0
         int32 CUBE=1
         int32 SPHERE=2
         int32 CYLINDER=3
         int32 LINE_STRIP=4
         int32 LINE_LIST=5
         int32 CUBE_LIST=6
         int32 SPHERE_LIST=7
         int32 POINTS=8
         int32 TEXT_VIEW_FACING=9
         int32 MESH_RESOURCE=10
         int32 TRIANGLE_LIST=11
         int32 ARROW_STRIP=12
         int32 ADD=0
         int32 MODIFY=0
         int32 DELETE=2
         int32 DELETEALL=3
         std_msgs/Header header
         string ns
         int32 id
         int32 type
         int32 action
         geometry_msgs/Pose pose
         geometry_msgs/Vector3 scale
         std_msgs/ColorRGBA color
         builtin_interfaces/Duration lifetime
         bool frame_locked
         geometry_msgs/Point[] points
         std_msgs/ColorRGBA[] colors
         string texture_resource
         sensor_msgs/CompressedImage texture
         UVCoordinate[] uv_coordinates
         string text
         string mesh_resource
         MeshFile mesh_file
         bool mesh_use_embedded_materials",
    ),
    ("visualization_msgs/MarkerArray", "Marker[] markers"),
];

/// Of our own messages.
pub const OWN: &[(&str, &str)] = &[
    ("flockform_msgs/FormationState", include_str!("../../msgs/flockform_msgs/msg/FormationState.msg")),
    ("flockform_msgs/LoopEvent", include_str!("../../msgs/flockform_msgs/msg/LoopEvent.msg")),
    ("flockform_msgs/MemberState", include_str!("../../msgs/flockform_msgs/msg/MemberState.msg")),
    ("flockform_msgs/Ranges", include_str!("../../msgs/flockform_msgs/msg/Ranges.msg")),
];

/// A message's definition followed by those of all messages that it contains, each after a line of equal signs
/// and one that names it, as rosbag2 and Foxglove expect it (the encoding `ros2msg`). `None` for a message that
/// has no definition here.
pub fn concatenated(name: &str) -> Option<String> {
    let mut text = trimmed(definition(name)?);
    for part in all_contained(name) {
        text += &format!("{}\nMSG: {part}\n{}", "=".repeat(80), trimmed(definition(&part)?));
    }
    Some(text)
}

/// All messages that a message contains, each once: its own fields before those of fields.
pub(super) fn all_contained(name: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = VecDeque::from(contained(name));
    while let Some(next) = open.pop_front() {
        if !found.contains(&next) {
            open.extend(contained(&next));
            found.push(next);
        }
    }
    found
}

pub(super) fn definition(name: &str) -> Option<&'static str> {
    STANDARD.iter().chain(OWN).find(|(one, _)| *one == name).map(|(_, text)| *text)
}

pub(super) fn trimmed(text: &str) -> String {
    text.trim_end().lines().map(|line| format!("{}\n", line.trim())).collect()
}

/// The messages that are fields of a message; types without a package are of its own.
fn contained(name: &str) -> Vec<String> {
    let own = name.split('/').next().unwrap_or_default();
    let kind = |line: &str| {
        let kind = line.split('#').next()?.split_whitespace().next()?;
        let kind = kind.split(['[', '<']).next()?.to_owned();
        // Messages begin with a capital, numbers and texts do not.
        let is_message = kind.rsplit('/').next()?.starts_with(|c: char| c.is_ascii_uppercase());
        is_message.then(|| if kind.contains('/') { kind } else { format!("{own}/{kind}") })
    };
    definition(name).unwrap_or_default().lines().filter_map(kind).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_brings_all_that_it_contains_and_each_once() {
        let text = concatenated("geometry_msgs/PoseStamped").expect("known");
        let parts: Vec<&str> = text.split(&"=".repeat(80)).collect();
        assert!(parts[0].starts_with("std_msgs/Header header\nPose pose\n"), "{text}");
        let named: Vec<&str> =
            parts[1..].iter().map(|part| part.trim().lines().next().expect("a name")).collect();
        assert_eq!(
            named,
            [
                "MSG: std_msgs/Header",
                "MSG: geometry_msgs/Pose",
                "MSG: builtin_interfaces/Time",
                "MSG: geometry_msgs/Point",
                "MSG: geometry_msgs/Quaternion",
            ]
        );
    }

    #[test]
    fn every_message_has_all_its_parts() {
        for (name, _) in STANDARD.iter().chain(OWN) {
            assert!(concatenated(name).is_some(), "{name}");
        }
        assert_eq!(concatenated("geometry_msgs/Wrench"), None);
    }
}
