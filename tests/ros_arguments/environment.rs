//! What the environment says.

use flockform::ros::arguments::{DiscoveryRange, Environment, RosArgumentError, RosArguments, Security};

/// The environment in which exactly these variables are set.
fn environment(set: &[(&str, &str)]) -> Result<Environment, RosArgumentError> {
    let look_up = |name: &str| set.iter().find(|(key, _)| *key == name).map(|(_, value)| value.to_string());
    RosArguments::parse::<String>([], &look_up).map(|(_, ros)| ros.environment)
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
        ("ROS_DISCOVERY_SERVER", ";10.0.0.7:11811", "for its peers"),
        ("RMW_IMPLEMENTATION", "rmw_zenoh_cpp", "rmw_cyclonedds_cpp"),
        ("RMW_IMPLEMENTATION", "rmw_iceoryx_cpp", "rmw_fastrtps_cpp"),
    ] {
        let error = environment(&[(variable, value)]).expect_err(value).to_string();
        assert!(error.contains(&format!("{variable}={value}")) && error.contains(remedy), "{error}");
    }
}

#[test]
fn settings_of_another_middleware_are_a_warning() {
    for (variable, middleware) in [
        ("CYCLONEDDS_URI", "Cyclone DDS"),
        ("FASTRTPS_DEFAULT_PROFILES_FILE", "Fast DDS"),
        ("FASTDDS_DEFAULT_PROFILES_FILE", "Fast DDS"),
        ("FASTDDS_BUILTIN_TRANSPORTS", "Fast DDS"),
        ("NDDS_QOS_PROFILES", "Connext"),
        ("NDDS_DISCOVERY_PEERS", "Connext"),
    ] {
        let warnings = environment(&[(variable, "file:///profile.xml")]).expect("no fault").warnings;
        let is_named = |warning: &String| warning.contains(variable) && warning.contains(middleware);
        assert!(warnings.len() == 1 && warnings.iter().all(is_named), "{variable}: {warnings:?}");
        assert_eq!(environment(&[(variable, "")]).expect("as if unset"), Environment::default());
    }
}

/// How a process takes part in which these variables are set, with this `--enclave`.
fn security(set: &[(&str, &str)], enclave: &str) -> Result<Security, RosArgumentError> {
    let look_up = |name: &str| set.iter().find(|(key, _)| *key == name).map(|(_, value)| value.to_string());
    let arguments = ["--ros-args", "-e", enclave].map(String::from);
    RosArguments::parse(arguments, &look_up).map(|(_, ros)| ros.security)
}

const ENABLED: (&str, &str) = ("ROS_SECURITY_ENABLE", "true");
const ENFORCED: (&str, &str) = ("ROS_SECURITY_STRATEGY", "Enforce");

#[test]
fn what_asks_for_security_and_gets_none_is_a_warning() {
    for variables in [&[][..], &[("ROS_SECURITY_ENABLE", "false")], &[("ROS_SECURITY_KEYSTORE", "/keys")]] {
        assert_eq!(security(variables, "/").expect("nothing is enforced"), Security::default());
    }
    let one = [("ROS_SECURITY_ENCLAVE_OVERRIDE", "/talker")];
    for (variables, enclave, words) in [
        (&[("ROS_SECURITY_ENABLE", "True")][..], "/", "ROS_SECURITY_ENABLE=True"),
        (&[ENFORCED], "/", "ROS_SECURITY_STRATEGY=Enforce"),
        (&one, "/", "ROS_SECURITY_ENCLAVE_OVERRIDE=/talker"),
        (&[], "/talker", "--enclave /talker"),
        (&[ENABLED], "/", "in the clear"),
        (&[ENABLED, ("ROS_SECURITY_STRATEGY", "Permissive")], "/", "in the clear"),
        (&[ENABLED, ("ROS_SECURITY_STRATEGY", "enforce")], "/", "in the clear"),
    ] {
        let Security { enclave, warnings } = security(variables, enclave).expect(words);
        assert_eq!(enclave, None);
        assert!(warnings.len() == 1 && warnings[0].contains(words), "{words}: {warnings:?}");
        assert!(warnings[0].contains("everything is sent and taken in the clear"), "{warnings:?}");
    }
}

#[test]
fn enforced_security_that_cannot_be_had_is_refused_rather_than_ignored() {
    let missing = if cfg!(feature = "security") { "ROS_SECURITY_KEYSTORE" } else { "feature `security`" };
    let error = security(&[ENABLED, ENFORCED], "/").expect_err("no keystore").to_string();
    assert!(error.contains(missing) && error.contains("help: "), "{error}");
    let keystore = ("ROS_SECURITY_KEYSTORE", "/nowhere");
    let error = security(&[ENABLED, ENFORCED, keystore], "/talker").expect_err("no enclave").to_string();
    let missing = if cfg!(feature = "security") { "/nowhere/enclaves/talker" } else { missing };
    assert!(error.contains(missing), "{error}");
}
