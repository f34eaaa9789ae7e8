//! `--ros-args` and the environment, held against the rules of the ROS 2 design articles "ROS Command
//! Line Arguments" and "Remapping Names", and against what `rcl` implements of them.

use std::path::PathBuf;

use flockform::ros::arguments::{
    DiscoveryRange, Environment, Origin, RosArgumentError, RosArguments, Severity, Value,
};
use proptest::prelude::*;

fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(String::from).collect()
}

fn parse(arguments: &[String]) -> Result<(Vec<String>, RosArguments), RosArgumentError> {
    RosArguments::parse(arguments.iter().cloned(), &|_| None)
}

/// The ROS arguments of `--ros-args LINE`.
fn ros(line: &str) -> RosArguments {
    parse(&words(&format!("--ros-args {line}"))).unwrap_or_else(|error| panic!("{line}: {error}")).1
}

fn refusal(line: &str) -> String {
    match parse(&words(&format!("--ros-args {line}"))) {
        Ok(_) => panic!("{line} is accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn ordinary_arguments_stay_and_keep_their_order() {
    for (line, rest) in [
        ("", ""),
        ("node square.toml", "node square.toml"),
        ("node --ros-args", "node"),
        ("node --ros-args --", "node"),
        ("node --ros-args -- square.toml", "node square.toml"),
        ("node --ros-args -r a:=b -- square.toml", "node square.toml"),
        ("--ros-args -r a:=b -- node --ros-args -p c:=1", "node"),
        ("node --ros-args --ros-args -r a:=b", "node"),
        ("node -- --ros-args -r a:=b -- --member", "node -- --member"),
        ("node -r a:=b", "node -r a:=b"),
        ("node a:=b", "node a:=b"),
    ] {
        assert_eq!(parse(&words(line)).expect(line).0, words(rest), "{line}");
    }
}

#[test]
fn several_sets_of_ros_arguments_add_up() {
    let (_, ros) =
        parse(&words("--ros-args -r a:=b -r c:=d -- node --ros-args -r e:=f -p g:=1")).expect("valid");
    assert_eq!((ros.remaps.len(), ros.assignments.len()), (3, 1));
}

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

#[test]
fn what_ros_does_not_understand_is_refused_by_name_with_a_remedy() {
    for (line, reason) in [
        ("-r", "`-r` is the last argument and needs a rule FROM:=TO"),
        ("--param", "needs an assignment NAME:=VALUE"),
        ("--params-file", "needs the path of a YAML file"),
        ("--log-level", "needs a level or LOGGER:=LEVEL"),
        ("-e", "needs a security enclave"),
        ("-r foo", "has no `:=`"),
        ("-r foo:bar", "has no `:=`"),
        ("-r :=bar", "the left side: `` has an empty token"),
        ("-r foo:=", "the right side: `` has an empty token"),
        ("-r foo:=bar:=baz", "contains `:`"),
        ("-r */foo:=bar", "the left side has a wildcard"),
        ("-r **/foo:=bar", "the left side has a wildcard"),
        (r"-r foo:=\1/bar", "the right side refers to a wildcard"),
        ("-r foo:=rostopic://bar", "the right side has a scheme"),
        ("-r rostopic://__ns:=/foo", "`__ns` has a scheme before it"),
        ("-r rosservice://node:foo:=bar", "contains `:`"),
        ("-r __ns:=foo", "namespace `foo`: does not begin with `/`"),
        ("-r __node:=/foo", "node name `/foo`: contains `/`"),
        ("-r __node:=", "node name ``: is empty"),
        ("-r foo__bar:=a", "two underscores in a row"),
        ("-r foo/:=bar", "empty token"),
        ("-r 2:a:=b", "the node prefix `2` begins with a digit"),
        ("-r --", "has no `:=`"),
        ("-p foo", "has no `:=`"),
        ("-p foo:=", "has no value"),
        ("-p :=1", "empty part"),
        ("-p a..b:=1", "empty part"),
        ("-p a-b:=1", "contains `-`"),
        ("-p a.2:=1", "begins with a digit"),
        ("-p foo:=[1,2.0]", "mixes integer and double in one list"),
        ("-p foo:=[]", "empty list"),
        ("-p foo:=[[1]]", "list or a mapping inside a list"),
        ("-p foo:={a:1}", "is a mapping"),
        ("-p foo:=[1", "is no YAML"),
        ("-p foo:=*a", "is no YAML"),
        ("--params-file /no/such/file.yaml", "--params-file /no/such/file.yaml: "),
        ("--log-level LOUD", "`LOUD` is no log level"),
        ("--log-level a:=LOUD", "`LOUD` is no log level"),
        ("--log-level :=DEBUG", "the name of the logger is empty"),
        ("--remapp a:=b", "did you mean `--remap`?"),
        ("--disable-rosout-log", "did you mean `--disable-rosout-logs`?"),
        ("--verbose", "unknown flag `--verbose`"),
        ("-v", "unknown flag `-v`"),
        ("square.toml", "`square.toml` belongs to no flag"),
        ("a:=b", "write `--remap a:=b`"),
    ] {
        let message = refusal(line);
        assert!(message.contains(reason), "{line}: {message}");
    }
}

#[test]
fn values_have_the_types_that_rcl_gives_them() {
    let text = |text: &str| Value::Text(text.into());
    for (yaml, value) in [
        ("true", Value::Bool(true)),
        ("Yes", Value::Bool(true)),
        ("on", Value::Bool(true)),
        ("n", Value::Bool(false)),
        ("OFF", Value::Bool(false)),
        ("tRue", text("tRue")),
        ("1", Value::Integer(1)),
        ("-12", Value::Integer(-12)),
        ("+3", Value::Integer(3)),
        ("0x1F", Value::Integer(31)),
        ("010", Value::Integer(8)),
        ("9223372036854775807", Value::Integer(i64::MAX)),
        ("-9223372036854775808", Value::Integer(i64::MIN)),
        ("9223372036854775808", Value::Double(9_223_372_036_854_775_808.0)),
        ("1.", Value::Double(1.0)),
        (".5", Value::Double(0.5)),
        ("1e-3", Value::Double(1e-3)),
        ("08", Value::Double(8.0)),
        ("-.inf", Value::Double(f64::NEG_INFINITY)),
        ("1e999", text("1e999")),
        ("'1'", text("1")),
        ("\"true\"", text("true")),
        ("''", text("")),
        ("!!str 1", text("1")),
        ("word", text("word")),
        ("1.0.0", text("1.0.0")),
        ("null", text("null")),
        ("a:b", text("a:b")),
        ("[true, no]", Value::Bools(vec![true, false])),
        ("[1, 2]", Value::Integers(vec![1, 2])),
        ("[1.0, 2.5]", Value::Doubles(vec![1.0, 2.5])),
        ("[a, 'b c']", Value::Texts(vec!["a".into(), "b c".into()])),
    ] {
        let arguments = ["--ros-args".into(), "-p".into(), format!("name:={yaml}")];
        let (_, ros) = parse(&arguments).unwrap_or_else(|error| panic!("{yaml}: {error}"));
        let parameters = ros.parameters_for("/any/node");
        assert_eq!(parameters[0].value, value, "{yaml}");
        assert_eq!(parameters[0].origin, Origin::CommandLine(format!("name:={yaml}")));
    }
    let Value::Double(nan) = ros("-p a:=.nan").parameters_for("/n")[0].value else { panic!("a double") };
    assert!(nan.is_nan());
}

/// Writes parameter files into a folder that lives as long as the test.
fn files(texts: &[&str]) -> (tempfile::TempDir, Vec<PathBuf>) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |(index, text): (usize, &&str)| {
        let path = folder.path().join(format!("{index}.yaml"));
        std::fs::write(&path, text).expect("writable");
        path
    };
    let paths = texts.iter().enumerate().map(write).collect();
    (folder, paths)
}

/// NAME=VALUE for each parameter of the node, values as text.
fn given(ros: &RosArguments, node: &str) -> Vec<String> {
    let show = |value: &Value| match value {
        Value::Integer(number) => number.to_string(),
        Value::Text(text) => text.clone(),
        other => format!("{other:?}"),
    };
    ros.parameters_for(node).iter().map(|p| format!("{}={}", p.name, show(&p.value))).collect()
}

#[test]
fn parameter_files_name_nodes_nested_flattened_and_by_wildcards() {
    let every = "/**: {ros__parameters: {a: 1}}";
    for (yaml, node, parameters) in [
        ("", "/n", vec![]),
        ("n: {ros__parameters: {a: 1}}", "/n", vec!["a=1"]),
        ("n: {ros__parameters: {a: 1}}", "/ns/n", vec![]),
        ("/n: {ros__parameters: {a: 1}}", "/n", vec!["a=1"]),
        ("/ns/n: {ros__parameters: {a: 1}}", "/ns/n", vec!["a=1"]),
        ("/ns: {n: {ros__parameters: {a: 1}}}", "/ns/n", vec!["a=1"]),
        ("ns: {sub: {n: {ros__parameters: {a: 1}}}}", "/ns/sub/n", vec!["a=1"]),
        ("/: {n: {ros__parameters: {a: 1}}}", "/n", vec!["a=1"]),
        (every, "/n", vec!["a=1"]),
        (every, "/a/b/n", vec!["a=1"]),
        ("/*: {ros__parameters: {a: 1}}", "/n", vec!["a=1"]),
        ("'*': {ros__parameters: {a: 1}}", "/n", vec!["a=1"]),
        ("/*: {ros__parameters: {a: 1}}", "/ns/n", vec![]),
        ("/foo/*: {ros__parameters: {a: 1}}", "/foo/n", vec!["a=1"]),
        ("/foo/*: {ros__parameters: {a: 1}}", "/foo/bar/n", vec![]),
        ("/**/n: {ros__parameters: {a: 1}}", "/n", vec!["a=1"]),
        ("/**/n: {ros__parameters: {a: 1}}", "/x/y/n", vec!["a=1"]),
        ("/**/n: {ros__parameters: {a: 1}}", "/x/y/m", vec![]),
        ("/a/**/b/*: {ros__parameters: {a: 1}}", "/a/x/b/n", vec!["a=1"]),
        ("/ns: {'*': {ros__parameters: {a: 1}}}", "/ns/n", vec!["a=1"]),
        ("n: {ros__parameters: {a: {b: 1, c.d: 2}}}", "/n", vec!["a.b=1", "a.c.d=2"]),
        ("n: {ros__parameters: {b: 1, a: 2, b: 3}}", "/n", vec!["b=3", "a=2"]),
        ("n: {ros__parameters: {a: 1}}\n/**: {ros__parameters: {a: 2}}", "/n", vec!["a=2"]),
        ("m: {ros__parameters: {a: 1}}\nn: {ros__parameters: {a: 2}}", "/n", vec!["a=2"]),
        ("n: {ros__parameters: {}}", "/n", vec![]),
    ] {
        let (_folder, paths) = files(&[yaml]);
        let ros = ros(&format!("--params-file {}", paths[0].display()));
        assert_eq!(given(&ros, node), parameters, "{yaml} for {node}");
    }
}

#[test]
fn of_several_values_the_one_given_last_counts_whether_in_a_file_or_not() {
    let (_folder, paths) =
        files(&["/**: {ros__parameters: {a: 1, b: 1}}", "/ns/n: {ros__parameters: {b: 2, c: 2}}"]);
    let [first, second] = [paths[0].display(), paths[1].display()];
    for (line, parameters) in [
        (format!("--params-file {first} --params-file {second}"), ["a=1", "b=2", "c=2"]),
        (format!("--params-file {second} --params-file {first}"), ["b=1", "c=2", "a=1"]),
        (format!("--params-file {first} --params-file {second} -p b:=3"), ["a=1", "b=3", "c=2"]),
        (format!("-p b:=3 --params-file {first} --params-file {second}"), ["b=2", "a=1", "c=2"]),
        (format!("-p n:c:=4 -p m:c:=5 --params-file {first} -p n:a:=6"), ["c=4", "a=6", "b=1"]),
    ] {
        assert_eq!(given(&ros(&line), "/ns/n"), parameters, "{line}");
    }
}

#[test]
fn the_parameter_file_of_the_launch_files_is_for_every_node() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/launch-configs/parameters/formation.yaml");
    let parameters = ros(&format!("--params-file {file}")).parameters_for("/team/formation");
    assert_eq!(parameters[0].name, "autostart");
    assert_eq!(parameters[0].value, Value::Bool(true));
}

#[test]
fn a_wrong_parameter_file_is_refused_with_its_line() {
    for (yaml, line, reason) in [
        ("- a", 1, "is no mapping of node names"),
        ("a: 1", 1, "`a` has a value before `ros__parameters`"),
        ("ros__parameters: {a: 1}", 1, "has no node above it"),
        ("n:\n  ros__parameters:", 2, "holds no NAME: VALUE lines"),
        ("n:\n  ros__parameters:\n    a:", 3, "parameter `a` has no value"),
        ("n:\n  ros__parameters:\n    a: [1, b]", 3, "mixes integer and string"),
        ("n:\n  ros__parameters:\n    a: &x 1\n    b: *x", 4, "alias"),
        ("foo*:\n  ros__parameters: {a: 1}", 2, "node `foo*`: `foo*` contains `*`"),
        ("n: {ros__parameters: {a: 1}}\n---\nm: {ros__parameters: {a: 1}}", 2, "second document"),
        ("n: {ros__parameters: {? [a] : 1}}", 1, "as a key"),
        ("n:\n  - {", 3, "is no YAML"),
    ] {
        let (_folder, paths) = files(&[yaml]);
        let message = refusal(&format!("--params-file {}", paths[0].display()));
        let place = format!("{}, line {line}: ", paths[0].display());
        assert!(message.contains(&place) && message.contains(reason), "{yaml}: {message}");
        assert!(message.contains("help: "), "{message}");
    }
}

#[test]
fn logging_and_enclave_are_read_and_the_last_word_counts() {
    let logging = ros("--log-level debug --log-level WARN --log-level a.b:=ERROR --log-level a.b:=fatal \
                       --disable-rosout-logs --disable-stdout-logs --enable-stdout-logs \
                       --disable-external-lib-logs --log-config-file log.config --log-file-name run")
    .logging;
    assert_eq!(logging.level, Some(Severity::Warn));
    assert_eq!(logging.level_of("a.b"), Some(Severity::Fatal));
    assert_eq!(logging.level_of("other"), Some(Severity::Warn));
    assert_eq!((logging.rosout, logging.stdout, logging.external_library), (false, true, false));
    assert_eq!(logging.config_file, Some("log.config".into()));
    assert_eq!(logging.file_name, Some("run".into()));
    assert_eq!(ros("-e /a --enclave /b").enclave, Some("/b".into()));
    assert_eq!(ros("").logging.level, None);
    assert!(ros("").logging.rosout);
}

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
        ("OFF", DiscoveryRange::Off),
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
    let more = environment(&[("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"), ("ROS_STATIC_PEERS", "a;b;")]);
    let more = more.expect("valid");
    assert_eq!(more.middleware.as_deref(), Some("rmw_cyclonedds_cpp"));
    assert_eq!(more.static_peers, ["a", "b"]);
}

#[test]
fn enforced_security_is_refused_rather_than_ignored() {
    let enabled = ("ROS_SECURITY_ENABLE", "true");
    assert!(environment(&[enabled, ("ROS_SECURITY_STRATEGY", "Enforce")]).is_err());
    assert!(environment(&[enabled, ("ROS_SECURITY_STRATEGY", "Permissive")]).is_ok());
    assert!(environment(&[("ROS_SECURITY_STRATEGY", "Enforce")]).is_ok());
}

/// Words that come close to ROS arguments.
fn word() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<String>(),
        "(-r|-p|-e|--|--ros-args|--remap|--param|--params-file|--log-level|--enable-rosout-logs)",
        "[a-z_~/{}*:=.0-9]{0,12}",
        "([a-z_0-9]{0,3}:)?(rostopic://)?[~/]{0,2}[a-z_0-9/{}*]{0,6}:=[\\[\\]{}a-z0-9_/,.'\"&*!|>~ -]{0,12}",
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn any_words_after_ros_args_are_read_or_refused(
        words in proptest::collection::vec(word(), 0..8),
        name in "[a-z_~/{}0-9]{0,12}",
    ) {
        let arguments = std::iter::once("--ros-args".to_string()).chain(words);
        if let Ok((_, ros)) = RosArguments::parse(arguments, &|_| None)
            && let Ok(names) = ros.names("node", "/ns")
        {
            let _ = (names.topic(&name), names.service(&name));
            let _ = ros.parameters_for(&names.fully_qualified());
        }
    }

    #[test]
    fn any_environment_is_read_or_refused(value in any::<String>()) {
        let _ = RosArguments::parse([], &|_| Some(value.clone()));
    }

    #[test]
    fn a_resolved_name_is_one_that_ros_allows(name in "[a-z_~/{}0-9]{0,12}", rule in "[a-z~/_]{1,6}:=[a-z~/_]{1,6}") {
        let Ok((_, ros)) = parse(&["--ros-args".into(), "-r".into(), rule]) else { return Ok(()) };
        if let Ok(full) = ros.names("node", "/ns").expect("valid").topic(&name) {
            prop_assert!(full.starts_with('/') && !full.ends_with('/') && !full.contains("//"));
            let leftover = full.contains(['~', '{', '}']) || full.contains("__");
            prop_assert!(!leftover, "{full}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_a_parameter_file_or_refused(
        text in prop_oneof![
            any::<String>(),
            "([ ]{0,4}(/\\*\\*|n|ros__parameters|a|-|\\?)?:?[ ]?[\\[\\]{}a-z0-9,.'\"&*!|>~#%@` -]{0,8}\n){0,12}",
            "[\\[{]{0,300}",
            "([ ]{0,3}- ){0,40}",
        ],
    ) {
        let (_folder, paths) = files(&[&text]);
        let _ = parse(&["--ros-args".into(), "--params-file".into(), paths[0].display().to_string()]);
    }
}

#[test]
fn very_deep_yaml_is_refused_and_does_not_overflow_the_stack() {
    for text in ["[".repeat(100_000), "{a: ".repeat(100_000), "- ".repeat(100_000), "? ".repeat(100_000)] {
        let (_folder, paths) = files(&[&text]);
        let message = refusal(&format!("--params-file {}", paths[0].display()));
        assert!(message.contains("nested") || message.contains("no YAML"), "{message}");
    }
}
