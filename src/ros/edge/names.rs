//! What becomes of names on the wire.

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
