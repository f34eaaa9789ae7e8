//! Parameters on the command line and in files.

use std::path::PathBuf;

use flockform::ros::arguments::{Origin, RosArguments, Value};

use crate::{parse, refusal, ros};

#[test]
fn values_have_the_types_that_rcl_gives_them() {
    let text = |text: &str| Value::String(text.into());
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
        ("[a, 'b c']", Value::Strings(vec!["a".into(), "b c".into()])),
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
pub fn files(texts: &[&str]) -> (tempfile::TempDir, Vec<PathBuf>) {
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
        Value::String(text) => text.clone(),
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
fn very_deep_yaml_is_refused_and_does_not_overflow_the_stack() {
    for text in ["[".repeat(100_000), "{a: ".repeat(100_000), "- ".repeat(100_000), "? ".repeat(100_000)] {
        let (_folder, paths) = files(&[&text]);
        let message = refusal(&format!("--params-file {}", paths[0].display()));
        assert!(message.contains("nested") || message.contains("no YAML"), "{message}");
    }
}
