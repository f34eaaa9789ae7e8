//! Names of nodes, topics and services, expanded and remapped.

use crate::ros;

#[test]
fn node_names_and_namespaces_follow_the_first_rule_that_matches() {
    for (rules, node, namespace, full) in [
        ("", "talker", "", "/talker"),
        ("", "talker", "/", "/talker"),
        ("", "talker", "ns", "/ns/talker"),
        ("-r __node:=foo", "talker", "/ns", "/ns/foo"),
        ("-r __name:=foo", "talker", "/ns", "/ns/foo"),
        ("--remap __ns:=/foo/bar", "talker", "/ns", "/foo/bar/talker"),
        ("-r __ns:=/", "talker", "/ns", "/talker"),
        ("-r __ns:=/new -r __node:=foo", "talker", "/ns", "/new/foo"),
        ("-r talker:__ns:=/foo -r __ns:=/bar", "talker", "/", "/foo/talker"),
        ("-r __ns:=/bar -r talker:__ns:=/foo", "talker", "/", "/bar/talker"),
        ("-r talker:__ns:=/my_namespace -r talker:__node:=foo", "talker", "/", "/foo"),
        ("-r foo:__ns:=/my_namespace -r talker:__node:=foo", "talker", "/", "/my_namespace/foo"),
        ("-r camera:__node:=left", "talker", "/", "/talker"),
        ("-r camera:__name:=left_camera", "camera", "/", "/left_camera"),
        ("-r __node:=a -r __node:=b", "talker", "/", "/a"),
    ] {
        let names = ros(rules).names(node, namespace).expect(rules);
        assert_eq!(names.fully_qualified(), full, "{rules}");
    }
}

#[test]
fn topics_and_services_are_expanded_and_remapped_by_the_first_rule_that_matches() {
    let node = "nodename";
    for (rules, namespace, name, topic, service) in [
        ("", "/", "foo", "/foo", "/foo"),
        ("", "/ns", "foo/bar", "/ns/foo/bar", "/ns/foo/bar"),
        ("", "/ns", "/foo", "/foo", "/foo"),
        ("", "/ns", "~/foo", "/ns/nodename/foo", "/ns/nodename/foo"),
        ("", "/ns", "~", "/ns/nodename", "/ns/nodename"),
        ("", "/", "~/foo", "/nodename/foo", "/nodename/foo"),
        ("", "/ns", "{node}/bar", "/ns/nodename/bar", "/ns/nodename/bar"),
        ("", "/ns", "{ns}/bar", "/ns/bar", "/ns/bar"),
        ("", "/", "{namespace}/bar", "/bar", "/bar"),
        ("-r foo:=bar", "/", "foo", "/bar", "/bar"),
        ("-r foo:=bar", "/ns", "foo", "/ns/bar", "/ns/bar"),
        ("-r foo:=bar", "/ns", "/foo", "/foo", "/foo"),
        ("-r foo:=bar", "/ns", "/ns/foo", "/ns/bar", "/ns/bar"),
        ("-r foo:=/foo/bar", "/ns", "foo", "/foo/bar", "/foo/bar"),
        ("-r /foo/bar:=foo", "/ns", "/foo/bar", "/ns/foo", "/ns/foo"),
        ("-r /ns/bar:=/ns/foo", "/ns", "barista", "/ns/barista", "/ns/barista"),
        ("-r /foo/bar:=fiz/buzz", "/", "/foo/bar", "/fiz/buzz", "/fiz/buzz"),
        ("-r nodename:~/foo:=foo", "/ns", "~/foo", "/ns/foo", "/ns/foo"),
        ("-r ~/foo:=~/bar", "/ns", "~/foo", "/ns/nodename/bar", "/ns/nodename/bar"),
        ("-r nodename:scan:=filtered", "/", "scan", "/filtered", "/filtered"),
        ("-r other:scan:=filtered", "/", "scan", "/scan", "/scan"),
        ("-r rostopic://map:=map_stream", "/", "map", "/map_stream", "/map"),
        ("-r rosservice:///foo/bar:=/bar/foo", "/", "/foo/bar", "/foo/bar", "/bar/foo"),
        ("-r rostopic://foo/bar:=bar/foo", "/", "foo/bar", "/bar/foo", "/foo/bar"),
        ("-r nodename:rosservice://~/left:=~/right", "/", "~/left", "/nodename/left", "/nodename/right"),
        ("-r a:=b -r a:=c", "/", "a", "/b", "/b"),
        ("-r a:=b -r b:=c", "/", "a", "/b", "/b"),
        ("-r other:a:=b -r a:=c", "/", "a", "/c", "/c"),
        ("-r rostopic:a:=b", "/", "a", "/a", "/a"),
        ("", "/", "A/b2/c_d", "/A/b2/c_d", "/A/b2/c_d"),
        ("-r __ns:=/foo", "/ns", "bar", "/foo/bar", "/foo/bar"),
        ("-r __ns:=/foo -r bar:=baz", "/ns", "bar", "/foo/baz", "/foo/baz"),
        ("-r __ns:=/foo", "/ns", "/ns/bar", "/ns/bar", "/ns/bar"),
        ("-r __node:=left -r ~/info:=info", "/ns", "~/info", "/ns/info", "/ns/info"),
        ("-r __node:=left -r nodename:info:=x", "/ns", "info", "/ns/info", "/ns/info"),
        ("-r __node:=left -r left:info:=x", "/ns", "info", "/ns/x", "/ns/x"),
    ] {
        let names = ros(rules).names(node, namespace).expect(rules);
        assert_eq!(names.topic(name).expect(name), topic, "topic {name} by {rules}");
        assert_eq!(names.service(name).expect(name), service, "service {name} by {rules}");
    }
}

#[test]
fn topics_of_a_fleet_are_in_its_namespace_for_the_node_of_one_robot_too() {
    let fleet = "-r __ns:=/fleet";
    for (rules, robot, name, topic) in [
        ("", None, "robot_3/pose", "/robot_3/pose"),
        ("", Some("robot_7"), "robot_3/pose", "/robot_3/pose"),
        ("", Some("robot_7"), "~/stop", "/robot_7/node/stop"),
        (fleet, None, "robot_3/pose", "/fleet/robot_3/pose"),
        (fleet, None, "/robot_3/pose", "/robot_3/pose"),
        (fleet, None, "{ns}/pose", "/fleet/pose"),
        (fleet, Some("robot_7"), "robot_3/pose", "/fleet/robot_3/pose"),
        (fleet, Some("robot_7"), "{node}/pose", "/fleet/node/pose"),
        (fleet, Some("robot_7"), "/robot_3/pose", "/robot_3/pose"),
        (fleet, Some("robot_7"), "~/stop", "/fleet/robot_7/node/stop"),
        ("-r __ns:=/fleet -r robot_3/pose:=mocap", None, "robot_3/pose", "/fleet/mocap"),
        ("-r __ns:=/fleet -r /fleet/robot_3/pose:=/mocap", Some("robot_7"), "robot_3/pose", "/mocap"),
        ("-r __ns:=/fleet -r pose:=here", Some("robot_7"), "robot_7/pose", "/fleet/robot_7/here"),
    ] {
        let names = ros(rules).names("node", "/").expect(rules);
        let names = robot.map_or(Ok(names.clone()), |robot| names.of_robot(robot)).expect(rules);
        assert_eq!(names.fleet_topic(name).expect(name), topic, "{name} by {rules} for {robot:?}");
    }
    let error = ros("").names("node", "/").expect("valid").of_robot("7").expect_err("a digit").to_string();
    assert!(error.contains("namespace `/7`: `7` begins with a digit"), "{error}");
}

#[test]
fn names_that_ros_does_not_allow_are_refused_with_place_and_remedy() {
    let names = ros("").names("node", "/ns").expect("valid");
    for (name, reason) in [
        ("", "ends in `/`"),
        ("/", "ends in `/`"),
        ("foo/", "ends in `/`"),
        ("foo//bar", "two `/` in a row"),
        ("foo bar", "`foo bar` contains ` `"),
        ("foo-bar", "contains `-`"),
        ("7foo", "`7foo` begins with a digit"),
        ("foo/7bar", "`7bar` begins with a digit"),
        ("foo__bar", "two underscores in a row"),
        ("~foo", "`~` is not followed by `/`"),
        ("foo/~", "contains `~`"),
        ("{nod}/foo", "`{nod}` stands for nothing"),
        ("{node/foo", "never closed"),
        ("größe", "contains `\\u{f6}`"),
        (&"x".repeat(248), "has 252 characters, more than 247"),
    ] {
        let error = names.topic(name).expect_err(name).to_string();
        assert!(error.contains(reason) && error.contains("help: "), "{name}: {error}");
        assert!(error.starts_with("topic name"), "{error}");
    }
    for (node, namespace, reason) in [
        ("", "/", "node name ``: is empty"),
        ("a/b", "/", "contains `/`"),
        ("9a", "/", "begins with a digit"),
        ("a", "/b/", "namespace `/b/`: ends in `/`"),
        ("a", "/b//c", "two `/` in a row"),
        ("a", "/b-c", "contains `-`"),
    ] {
        let error = ros("").names(node, namespace).expect_err(reason).to_string();
        assert!(error.contains(reason), "{error}");
    }
}
