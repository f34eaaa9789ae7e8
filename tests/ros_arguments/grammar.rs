//! Which arguments are ROS ones, what they say, and what is refused.

use flockform::ros::arguments::{RosArgumentError, RosArguments, Severity};

use crate::{parse, refusal, ros, words};

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

#[cfg(unix)]
#[test]
fn arguments_that_are_not_utf_8_stay_as_they_are_and_are_no_rules() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let odd = OsStr::from_bytes(b"o\xff");
    let read = |line: &[&'static str]| {
        let all = line.iter().map(|word| if *word == "ODD" { odd } else { OsStr::new(*word) });
        RosArguments::parse(all, &|_| None)
    };
    let (rest, ros) = read(&["node", "ODD", "--ros-args", "-r", "a:=b"]).expect("read");
    assert_eq!((rest, ros.remaps.len()), (vec![OsStr::new("node"), odd], 1));
    for flag in ["-r", "-p", "--log-level", "-e"] {
        let error = read(&["--ros-args", flag, "ODD"]).expect_err("no rule").to_string();
        assert!(error.contains(flag) && error.contains("not UTF-8"), "{error}");
    }
    let error = read(&["--ros-args", "--params-file", "ODD"]).expect_err("not there");
    assert!(matches!(&error, RosArgumentError::ReadFile { path, .. } if path.as_os_str() == odd), "{error}");
}

#[test]
fn several_sets_of_ros_arguments_add_up() {
    let (_, ros) =
        parse(&words("--ros-args -r a:=b -r c:=d -- node --ros-args -r e:=f -p g:=1")).expect("valid");
    assert_eq!((ros.remaps.len(), ros.assignments.len()), (3, 1));
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
fn logging_is_read_and_the_last_word_counts() {
    let logging = ros("--log-level debug --log-level WARN --log-level a.b:=ERROR --log-level a.b:=fatal \
                       --disable-rosout-logs --disable-stdout-logs --enable-stdout-logs \
                       --disable-external-lib-logs")
    .logging;
    assert_eq!(logging.level, Some(Severity::Warn));
    assert_eq!(logging.level_of("a.b"), Some(Severity::Fatal));
    assert_eq!(logging.level_of("other"), Some(Severity::Warn));
    assert!(logging.stdout && !logging.rosout);
    assert!(ros("--disable-rosout-logs --enable-rosout-logs").logging.rosout && ros("").logging.rosout);
    assert!(!ros("--disable-stdout-logs -e /").logging.stdout);
    assert_eq!(ros("").logging.level, None);
}

#[test]
fn an_enclave_has_a_name_like_a_namespace_and_the_last_counts() {
    assert_eq!(ros("-e /").enclave.as_deref(), Some("/"));
    assert_eq!(ros("-e /one --enclave /fleet/robot_7").enclave.as_deref(), Some("/fleet/robot_7"));
    for name in ["talker", "/../etc", "/a//b", "/a/", "//", "/a b", "/7", "/a/./b", "./a"] {
        let arguments = ["--ros-args", "-e", name].map(String::from);
        let message = crate::parse(&arguments).expect_err(name).to_string();
        assert!(message.contains(name) && message.contains("help: name it as"), "{message}");
    }
}

#[test]
fn what_this_node_does_not_have_is_refused_and_not_ignored() {
    for line in ["--log-config-file log.config", "--log-file-name run", "--enable-external-lib-logs"] {
        let message = refusal(line);
        assert!(message.contains(line) && message.contains("leave it out"), "{line}: {message}");
    }
}
