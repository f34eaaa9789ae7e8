//! Names as ROS 2 writes them, and what becomes of them on the wire.

use super::EdgeError;

/// Checks a fully qualified topic or service name: `/a/b`, tokens of letters, digits and underscores that
/// do not begin with a digit.
pub fn check(kind: &'static str, name: &str) -> Result<(), EdgeError> {
    let refuse = |reason| Err(EdgeError::Name { kind, name: name.to_owned(), reason });
    let Some(tokens) = name.strip_prefix('/') else {
        return refuse("it must be fully qualified, beginning with a slash");
    };
    for token in tokens.split('/') {
        if token.is_empty() {
            return refuse("an empty token (a doubled or trailing slash)");
        }
        if token.starts_with(|c: char| c.is_ascii_digit()) {
            return refuse("a token begins with a digit");
        }
        if !token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return refuse("only letters, digits, underscores and slashes are allowed");
        }
        if token.contains("__") {
            return refuse("doubled underscores are reserved");
        }
    }
    Ok(())
}

/// DDS topic of a ROS 2 topic.
pub(super) fn dds_topic(name: &str) -> String {
    format!("rt{name}")
}

/// DDS topics of a service: requests, replies.
pub(super) fn dds_service(name: &str) -> [String; 2] {
    [format!("rq{name}Request"), format!("rr{name}Reply")]
}

/// DDS type of a message.
pub(super) fn dds_message(package: &str, name: &str) -> String {
    format!("{package}::msg::dds_::{name}_")
}

/// DDS types of a service: request, response.
pub(super) fn dds_service_types(package: &str, name: &str) -> [String; 2] {
    [format!("{package}::srv::dds_::{name}_Request_"), format!("{package}::srv::dds_::{name}_Response_")]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_fully_qualified_names_pass() {
        for good in ["/a", "/robot_1/pose", "/A/b2/c_d"] {
            assert_eq!(check("topic", good), Ok(()), "{good}");
        }
        for bad in ["", "/", "a", "/a/", "//a", "/a//b", "/1a", "/a b", "/a-b", "~/a", "/{a}", "/a__b", "/é"]
        {
            assert!(check("topic", bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn wire_names_are_those_of_the_ros_2_design() {
        assert_eq!(dds_topic("/robot_1/pose"), "rt/robot_1/pose");
        assert_eq!(dds_service("/n/get_state"), ["rq/n/get_stateRequest", "rr/n/get_stateReply"]);
        assert_eq!(dds_message("geometry_msgs", "PoseStamped"), "geometry_msgs::msg::dds_::PoseStamped_");
        assert_eq!(
            dds_service_types("std_srvs", "Trigger"),
            ["std_srvs::srv::dds_::Trigger_Request_", "std_srvs::srv::dds_::Trigger_Response_"]
        );
    }
}
