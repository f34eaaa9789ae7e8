#![allow(dead_code, reason = "the fixtures exist for their schema; few of their fields are read")]

use std::collections::BTreeMap;

use proptest::prelude::*;
use schemars::{JsonSchema, schema_for};
use serde::Deserialize;

use crate::scene::{Document, Place};

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Scene {
    lattice: Lattice,
    #[serde(default)]
    roles: Vec<Role>,
    frame: Option<Frame>,
    plain: Option<Plain>,
    gravity: Option<[f64; 2]>,
    #[serde(default)]
    names: BTreeMap<String, f64>,
    extent: Option<Extent>,
    pair: Option<(f64, String)>,
    inner: Option<Box<Scene>>,
    form: Option<External>,
    tuning: Option<Tuning>,
    step: Option<Only>,
    loose: Option<Loose>,
    open: Option<serde_json::Value>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Lattice {
    /// Distance between neighbours [length].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    spacing: f64,
    #[schemars(range(min = 1, max = 9))]
    rows: Option<i64>,
    #[serde(default)]
    seed: u64,
    count: Option<u32>,
    offset: Option<i64>,
    /// A share in the interval [0, 1]
    #[schemars(range(min = 0.0, max = 1.0))]
    share: Option<f64>,
    #[schemars(length(min = 1))]
    title: Option<String>,
    #[schemars(length(min = 1))]
    weights: Option<Vec<f64>>,
    width: Option<Length>,
    periodic: Option<bool>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(extend("x-unit" = "length", "minimum" = 0.0))]
struct Length(f64);

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Role {
    motion: Motion,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum Motion {
    /// Equal sides.
    Square {
        a: f64,
    },
    Rectangular {
        a: f64,
        b: f64,
    },
    Disc(Disc),
    HeldFixed,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Disc {
    radius: f64,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Frame {
    /// At rest.
    Lab,
    MirrorImage,
    Free,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Plain {
    Fast,
    Slow,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Extent {
    Same(f64),
    Each([f64; 2]),
    Named(Plain),
    Disc(Disc),
    Ring(Ring),
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Ring {
    outer: f64,
    inner: f64,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum External {
    None,
    Wedge { angle: f64 },
    Ball(f64),
}

#[derive(Debug, Deserialize, JsonSchema)]
struct Tuning {
    gain: f64,
    #[serde(flatten)]
    motion: Motion,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum Only {
    Steady { rate: f64 },
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum Loose {
    Solid(Solid),
    Void,
}

#[derive(Debug, Deserialize, JsonSchema)]
struct Solid {
    mass: f64,
}

fn schema() -> serde_json::Value {
    serde_json::to_value(schema_for!(Scene)).unwrap()
}

fn checked(text: &str, overrides: &[String]) -> Result<serde_json::Value, crate::scene::SceneError> {
    Document::parse("s.toml", text, overrides)?.check(&schema())
}

/// The scene that the lines give, following a valid lattice on the first line.
fn scene(lines: &str) -> Scene {
    let text = format!("lattice = {{ spacing = 1 }}\n{lines}");
    serde_json::from_value(checked(&text, &[]).unwrap_or_else(|error| panic!("{error}"))).unwrap()
}

/// The problems of a scene that, following a valid lattice on the first line, has these lines.
fn report(lines: &str) -> String {
    checked(&format!("lattice = {{ spacing = 1 }}\n{lines}"), &[]).unwrap_err().to_string()
}

/// The problems of a scene whose lattice, on the first line, also has `entry`.
fn lattice_report(entry: &str) -> String {
    checked(&format!("lattice = {{ spacing = 1, {entry} }}"), &[]).unwrap_err().to_string()
}

#[test]
fn a_valid_scene_deserialises() {
    let scene = scene(
        "frame = 'mirror-image'\ngravity = [0, -9.81]\nnames = { a = 1 }\nopen = { x = [1, 'y'] }\n\
         inner = { lattice = { spacing = 2 } }\n[[roles]]\nmotion = { kind = 'disc', radius = 3 }\n\
         [[roles]]\nmotion = { kind = 'held-fixed' }\n",
    );
    assert_eq!(scene.lattice.spacing, 1.0);
    assert_eq!(scene.gravity, Some([0.0, -9.81]));
    assert_eq!(scene.inner.unwrap().lattice.spacing, 2.0);
    assert!(matches!(scene.roles[0].motion, Motion::Disc(Disc { radius: 3.0 })));
    assert!(matches!(scene.frame, Some(Frame::MirrorImage)));
}

#[test]
fn an_integer_where_a_number_is_wanted_becomes_a_float() {
    let value = checked("lattice = { spacing = 1, rows = 2 }", &[]).unwrap();
    assert!(value["lattice"]["spacing"].is_f64());
    assert!(value["lattice"]["rows"].is_i64());
}

#[test]
fn a_misspelt_key_suggests_the_nearest_and_does_not_report_it_missing_as_well() {
    let error = checked("\n[lattice]\nspaicng = 1.0\n", &[]).unwrap_err().to_string();
    assert_eq!(error, "s.toml:3: lattice.spaicng = 1.0: is not a known key\n  help: did you mean `spacing`?");
}

#[test]
fn a_key_like_no_other_lists_the_known_ones() {
    let error = report("roles = [{ motion = { kind = 'square', a = 1 }, colour = 'red' }]");
    assert_eq!(
        error,
        "s.toml:2: roles[0].colour = \"red\": is not a known key\n  help: known keys: `motion`"
    );
    assert!(report("zzzzzz = 1").contains("`lattice`, `roles`, "));
    assert!(report("zzzzzz = 1").ends_with(", ..."));
}

#[test]
fn a_key_that_is_already_there_is_not_suggested() {
    let report = lattice_report("spacings = 2");
    assert!(
        !report.contains("did you mean `spacing`") && report.contains("known keys: `spacing`, "),
        "{report}"
    );
}

#[test]
fn a_missing_key_is_placed_at_its_table_and_described() {
    let error = checked("\n\n[lattice]\nrows = 2\n", &[]).unwrap_err().to_string();
    let help = "add `spacing`, which is a number [length]: Distance between neighbours.";
    assert_eq!(error, format!("s.toml:3: lattice.spacing: is missing\n  help: {help}"));
    assert!(checked("", &[]).unwrap_err().to_string().starts_with("s.toml: lattice: is missing"));
}

#[test]
fn a_value_out_of_range_names_the_range_and_the_unit() {
    let error = checked("[lattice]\nspacing = -1.0\n", &[]).unwrap_err().to_string();
    assert_eq!(error, "s.toml:2: lattice.spacing = -1.0: must be greater than 0 [length]");
    assert!(checked("lattice.spacing = 0", &[]).unwrap_err().to_string().contains("greater than 0"));
    assert!(lattice_report("rows = 10").contains("lattice.rows = 10: must be between 1 and 9"));
    assert!(lattice_report("width = -0.5").contains("must be at least 0 [length]"));
    assert!(lattice_report("share = 1.5").ends_with("must be between 0 and 1"));
}

#[test]
fn integers_beyond_their_format_are_refused() {
    assert!(lattice_report("count = 4294967296").contains("must be between 0 and 4294967295"));
    assert!(lattice_report("seed = -1").contains("must be at least 0"));
    let wide = checked("lattice = { spacing = 1, seed = 18446744073709551615 }", &[]).unwrap();
    assert_eq!(wide["lattice"]["seed"], u64::MAX);
    assert!(lattice_report("offset = 9223372036854775808").ends_with("must be at most 9223372036854775807"));
}

#[test]
fn a_wrong_type_says_what_is_wanted_and_what_is_there() {
    assert!(
        lattice_report("rows = 'two'")
            .contains("lattice.rows = \"two\": must be a whole number, not a string")
    );
    assert!(lattice_report("rows = 2.5").contains("must be a whole number, not a decimal number"));
    assert!(lattice_report("periodic = 1").contains("must be true or false, not an integer"));
    assert!(lattice_report("width = true").contains("must be a number [length], not a boolean"));
    assert!(report("roles = 5").contains("roles = 5: must be a list of tables, not an integer"));
    assert!(report("gravity = 5").contains("must be a list of 2 numbers, not an integer"));
}

#[test]
fn a_value_that_is_nearly_of_the_right_type_is_shown_rewritten() {
    assert!(lattice_report("width = '.5'").contains("help: write 0.5, without quotes"));
    assert!(lattice_report("rows = 2.0").contains("help: write 2, without a decimal point"));
    assert!(lattice_report("title = 12").contains("help: put it in quotes: \"12\""));
}

#[test]
fn lengths_of_lists_and_strings_are_checked() {
    assert!(report("gravity = [1, 2, 3]").contains("gravity = [1, 2, 3]: must have 2 elements, not 3"));
    assert!(lattice_report("weights = []").contains("must have at least 1 element, not 0"));
    assert!(lattice_report("title = ''").contains("must have at least 1 character, not 0"));
    assert!(report("gravity = [1, 'x']").contains("gravity[1] = \"x\": must be a number"));
}

#[test]
fn tuples_are_checked_element_by_element() {
    assert_eq!(scene("pair = [1, 'x']").pair, Some((1.0, "x".to_owned())));
    assert!(report("pair = ['x', 'x']").contains("pair[0] = \"x\": must be a number"));
}

#[test]
fn values_of_a_map_are_checked_under_any_key() {
    assert!(report("names = { 'a b' = 'x' }").contains("names.\"a b\" = \"x\": must be a number"));
}

#[test]
fn an_unknown_choice_suggests_the_nearest() {
    let error = report("frame = 'miror-image'");
    assert!(error.contains("must be one of"), "{error}");
    assert!(error.contains("\"lab\"") && error.ends_with("help: did you mean \"mirror-image\"?"), "{error}");
    assert!(report("plain = 'qqqq'").ends_with("must be one of \"fast\", \"slow\""));
    assert!(report("plain = 3").ends_with("must be one of \"fast\", \"slow\", not an integer"));
}

#[test]
fn a_missing_tag_lists_the_choices() {
    let error = report("[[roles]]\n\nmotion = { a = 1 }");
    let help = "set `kind` to one of \"square\", \"rectangular\", \"disc\", \"held-fixed\"";
    assert_eq!(error, format!("s.toml:4: roles[0].motion.kind: is missing\n  help: {help}"));
}

#[test]
fn a_misspelt_tag_suggests_the_nearest() {
    let error = report("roles = [{ motion = { kind = 'sqare', a = 1 } }]");
    assert!(
        error.starts_with("s.toml:2: roles[0].motion.kind = \"sqare\": must be one of \"square\""),
        "{error}"
    );
    assert!(error.ends_with("help: did you mean \"square\"?"), "{error}");
}

#[test]
fn a_key_of_another_variant_is_distinguished_from_an_unknown_one() {
    let error = report("roles = [{ motion = { kind = 'square', a = 1, b = 2 } }]");
    assert!(error.contains("motion.b = 2: belongs to kind \"rectangular\", not to \"square\""), "{error}");
    let error = report("roles = [{ motion = { kind = 'disc', radius = 1, radios = 2 } }]");
    assert!(error.contains("motion.radios = 2: is not a known key"), "{error}");
}

#[test]
fn a_tagged_enum_given_as_a_string_shows_the_table() {
    let error = report("roles = [{ motion = 'held-fixed' }]");
    assert!(error.contains("must be a table with `kind`, not a string"), "{error}");
    assert!(error.ends_with("help: write { kind = \"held-fixed\" }"), "{error}");
}

#[test]
fn a_tagged_enum_with_one_variant_is_checked_like_any_other() {
    assert!(scene("step = { kind = 'steady', rate = 1 }").step.is_some());
    assert!(report("step = { kind = 'stead', rate = 1 }").contains("did you mean \"steady\""));
    assert!(report("step = { rate = 1 }").contains("step.kind: is missing"));
}

#[test]
fn a_variant_that_only_refers_to_its_fields_is_followed() {
    assert!(scene("loose = { kind = 'solid', mass = 1, colour = 'unchecked' }").loose.is_some());
    assert!(report("loose = { kind = 'solid' }").contains("loose.mass: is missing"));
}

#[test]
fn a_flattened_enum_is_checked_with_the_struct_around_it() {
    assert!(scene("tuning = { gain = 1, kind = 'square', a = 1 }").tuning.is_some());
    assert!(report("tuning = { kind = 'square', a = 'x' }").contains("tuning.gain: is missing"));
    assert!(
        report("tuning = { gain = 1, kind = 'square', a = 'x' }")
            .contains("tuning.a = \"x\": must be a number")
    );
}

#[test]
fn an_untagged_enum_takes_the_branch_whose_shape_matches() {
    assert!(matches!(scene("extent = 2").extent, Some(Extent::Same(2.0))));
    assert!(matches!(scene("extent = [2, 3]").extent, Some(Extent::Each([2.0, 3.0]))));
    assert!(matches!(scene("extent = 'slow'").extent, Some(Extent::Named(Plain::Slow))));
    assert!(matches!(scene("extent = { outer = 2, inner = 1 }").extent, Some(Extent::Ring(_))));
    assert!(report("extent = [2]").contains("extent = [2]: must have 2 elements, not 1"));
    assert!(report("extent = 'slwo'").contains("did you mean \"slow\"?"));
    assert!(report("extent = { outer = 2, inner = 'x' }").contains("extent.inner = \"x\": must be a number"));
}

#[test]
fn an_untagged_enum_that_no_branch_fits_says_what_was_expected() {
    let error = report("extent = true");
    let forms = "a number or a list of 2 numbers or one of \"fast\", \"slow\" or a table with `radius` \
                 or a table with `outer`, `inner`";
    assert!(error.contains(&format!("extent = true: must be {forms}, not a boolean")), "{error}");
}

#[test]
fn an_externally_tagged_enum_is_checked_by_its_key() {
    assert!(matches!(scene("form = 'none'").form, Some(External::None)));
    assert!(matches!(scene("form = { wedge = { angle = 1 } }").form, Some(External::Wedge { angle: 1.0 })));
    assert!(report("form = { wegde = { angle = 1 } }").contains("did you mean `wedge`?"));
    assert!(
        report("form = { wedge = { angle = 'x' } }").contains("form.wedge.angle = \"x\": must be a number")
    );
}

#[test]
fn all_problems_are_reported_in_the_order_of_the_file() {
    let error = checked("frame = 'lab '\nx_y = 1\n[lattice]\nrows = 0\nspacing = 'x'\n", &[]).unwrap_err();
    let keys: Vec<&str> = error.problems().iter().map(|problem| problem.key.as_str()).collect();
    assert_eq!(keys, ["frame", "x_y", "lattice.rows", "lattice.spacing"]);
}

#[test]
fn a_problem_with_an_override_is_placed_at_the_override() {
    let error = checked("[lattice]\nspacing = 1\n", &["lattice.spacing=-2".into()]).unwrap_err();
    assert_eq!(error.problems()[0].place, Place::Override { text: "lattice.spacing=-2".into() });
    let value = checked("[lattice]\nspacing = -1\n", &["lattice.spacing=2".into()]).unwrap();
    assert_eq!(value["lattice"]["spacing"], 2.0);
}

#[test]
fn a_recursive_untagged_enum_neither_hangs_nor_refuses_what_is_valid() {
    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(untagged)]
    enum Sum {
        Number(f64),
        Plus { plus: Vec<Sum> },
        Times { times: Vec<Sum> },
        Same(Box<Sum>),
    }
    let schema = serde_json::to_value(schema_for!(Sum)).unwrap();
    let inner = format!("{}1{}", "{ times = [{ plus = [".repeat(12), "] }] }".repeat(12));
    let valid = Document::parse("s.toml", &format!("plus = [{inner}]"), &[]).unwrap();
    let value = valid.check(&schema).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(value["plus"][0]["times"][0]["plus"][0]["times"].as_array().map(Vec::len), Some(1));
    let invalid = Document::parse("s.toml", &format!("plus = [{}]", inner.replace('1', "'x'")), &[]).unwrap();
    assert!(invalid.check(&schema).is_err());
}

const VALID: &str = "frame = 'lab'\ngravity = [0, 1.5]\nextent = { radius = 1 }\nform = { ball = 2 }\n\
    [lattice]\nspacing = 0.5\nrows = 3\n[[roles]]\nmotion = { kind = 'rectangular', a = 1, b = 2 }\n\
    [names]\nx = 1.0\n";

/// Characters that TOML and key paths give a meaning to, and some that they do not.
fn loaded_text() -> impl Strategy<Value = String> {
    proptest::collection::vec(
        prop_oneof![
            Just("[".to_owned()),
            Just("]".to_owned()),
            Just("{ ".to_owned()),
            Just(" }".to_owned()),
            Just(" = ".to_owned()),
            Just("\n".to_owned()),
            Just("lattice.".to_owned()),
            Just("roles[0].".to_owned()),
            Just("kind = 'square'".to_owned()),
            Just("spacing".to_owned()),
            "[-+_.0-9a-fxe:'\"é,]{0,6}",
            ".{0,3}",
        ],
        0..12,
    )
    .prop_map(|parts| parts.concat())
}

/// A scene that passes the check must be one that serde accepts.
fn never_panics_and_agrees_with_serde(text: &str, overrides: &[String]) {
    match checked(text, overrides) {
        Ok(value) => assert!(serde_json::from_value::<Scene>(value.clone()).is_ok(), "serde refuses {value}"),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn any_text() -> impl Strategy<Value = String> {
    let decoded = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    prop_oneof![loaded_text(), any::<String>(), any::<Vec<u8>>().prop_map(decoded)]
}

fn any_value_text() -> impl Strategy<Value = String> {
    let integers = prop_oneof![any::<i64>().prop_map(i128::from), any::<u64>().prop_map(i128::from)];
    prop_oneof![
        loaded_text(),
        integers.prop_map(|integer| integer.to_string()),
        any::<f64>().prop_map(|number| format!("{number:?}")),
    ]
}

const PLACES: [&str; 11] = [
    "extent",
    "lattice.seed",
    "lattice.offset",
    "lattice.count",
    "roles[0].motion",
    "roles[0].motion.kind",
    "form",
    "tuning",
    "inner",
    "pair",
    "gravity[1]",
];

proptest! {
    // Failures are kept as unit tests above, not as seed files beside the crate.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text_and_any_override_are_checked_without_panic(text in any_text(), set in any_text()) {
        never_panics_and_agrees_with_serde(&text, std::slice::from_ref(&set));
        never_panics_and_agrees_with_serde(VALID, &[set]);
        let document = Document::parse("s.toml", VALID, &[]).unwrap();
        prop_assert_eq!(&document.problem(&text, "is odd", None).key, &text);
    }

    #[test]
    fn a_mutated_scene_is_checked_without_panic(
        at in 0..VALID.len(),
        cut in 0..12usize,
        insert in loaded_text(),
    ) {
        let end = (at + cut).min(VALID.len());
        let mutated = format!("{}{insert}{}", &VALID[..at], &VALID[end..]);
        never_panics_and_agrees_with_serde(&mutated, &[]);
    }

    #[test]
    fn any_value_in_any_place_is_checked_without_panic(
        place in proptest::sample::select(&PLACES),
        value in any_value_text(),
    ) {
        never_panics_and_agrees_with_serde(VALID, &[format!("{place}={value}")]);
    }
}
