//! What the environment says.

use flockform::ros::arguments::{DiscoveryRange, Environment, RosArgumentError, RosArguments};

/// The environment in which exactly these variables are set.
fn environment(set: &[(&str, &str)]) -> Result<Environment, RosArgumentError> {
    let look_up = |name: &str| set.iter().find(|(key, _)| *key == name).map(|(_, value)| value.to_string());
    RosArguments::parse([], &look_up).map(|(_, ros)| ros.environment)
}

#[test]
fn the_environment_gives_domain_range_and_middleware() {
    assert_eq!(environment(&[]).expect("valid"), Environment::default());
    for (value, domain) in [("0", 0), ("42", 42), ("232", 232), ("0x10", 16), ("", 0)] {
        assert_eq!(environment(&[("ROS_DOMAIN_ID", value)]).expect(value).domain, domain);
    }
    for value in ["233", "-1", "1.5", "ten", "65536", "99999999999999999999", " 1"] {
        let error = environment(&[("ROS_DOMAIN_ID", value)]).expect_err(value).to_string();
        assert!(error.contains(&format!("ROS_DOMAIN_ID={value}")) && error.contains("0 to 232"), "{error}");
    }
    for (value, range) in [
        ("LOCALHOST", DiscoveryRange::Localhost),
        ("SUBNET", DiscoveryRange::Subnet),
        ("SYSTEM_DEFAULT", DiscoveryRange::SystemDefault),
        ("", DiscoveryRange::Subnet),
    ] {
        let variables = [("ROS_AUTOMATIC_DISCOVERY_RANGE", value)];
        assert_eq!(environment(&variables).expect(value).discovery, range);
    }
    let range = ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET");
    let localhost_only =
        |value| environment(&[("ROS_LOCALHOST_ONLY", value), range]).expect("valid").discovery;
    assert_eq!(localhost_only("1"), DiscoveryRange::Localhost);
    assert_eq!(localhost_only("0"), DiscoveryRange::Subnet);
    let wrong = environment(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "localhost")]).expect_err("wrong case");
    assert!(wrong.to_string().contains("LOCALHOST, SUBNET or SYSTEM_DEFAULT"), "{wrong}");
    let more = environment(&[("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"), ("ROS_STATIC_PEERS", ";")]);
    assert_eq!(more.expect("valid").middleware.as_deref(), Some("rmw_cyclonedds_cpp"));
}

#[test]
fn what_cannot_be_honoured_is_refused_with_a_remedy() {
    for (variable, value, remedy) in [
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", "LOCALHOST"),
        ("ROS_STATIC_PEERS", "10.0.0.7;robot", "unset it"),
    ] {
        let error = environment(&[(variable, value)]).expect_err(value).to_string();
        assert!(error.contains(&format!("{variable}={value}")) && error.contains(remedy), "{error}");
    }
}

#[test]
fn enforced_security_is_refused_rather_than_ignored() {
    let enabled = ("ROS_SECURITY_ENABLE", "true");
    assert!(environment(&[enabled, ("ROS_SECURITY_STRATEGY", "Enforce")]).is_err());
    assert!(environment(&[enabled, ("ROS_SECURITY_STRATEGY", "Permissive")]).is_ok());
    assert!(environment(&[("ROS_SECURITY_STRATEGY", "Enforce")]).is_ok());
}
