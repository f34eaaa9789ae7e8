//! Whatever is typed or written is read or refused.

use flockform::ros::arguments::RosArguments;
use proptest::prelude::*;

use crate::parameters::files;
use crate::parse;

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
        let _ = RosArguments::parse::<String>([], &|_| Some(value.clone()));
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
