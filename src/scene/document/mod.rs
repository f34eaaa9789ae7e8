//! Scene text with its `--set` overrides, every value knowing the line or override it came from.

mod overrides;
pub mod problem;
mod schema_check;
mod schema_rule;

use std::io::ErrorKind;
use std::thread::ScopedJoinHandle;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use serde_json::Value;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

use overrides::Segment;
pub(crate) use overrides::{find, split_assignment};
use problem::{Place, Problem, SceneError};

/// Tables and lists may nest this deep, so that recursion over a document cannot exhaust the stack.
pub(crate) const MAX_DEPTH: usize = 64;

/// Room for the parser to build, and drop, what it does not itself keep from nesting deeply: up to eighty
/// inline tables, each under a dotted key of up to eighty steps.
///
/// Where there are no threads, as in a browser, the parser has the stack of its caller. Optimised, the deepest such
/// document takes about half of the 1 MiB usual there; a build that needs more for it ends in a trap.
const PARSER_STACK_BYTES: usize = 64 << 20;

/// The JSON Schema of a kind of file.
pub fn schema_of<Raw: JsonSchema>() -> Value {
    // A key that may be left out of a group with defaults is absent then: TOML has no null.
    let without_null = RecursiveTransform(|schema: &mut Schema| {
        if schema.get("default").is_some_and(Value::is_null) {
            schema.remove("default");
        }
    });
    let settings = SchemaSettings::draft2020_12().with_transform(without_null);
    settings.into_generator().into_root_schema_for::<Raw>().into()
}

/// Values longer than this are abbreviated in messages.
const SHOWN_CHARACTERS: usize = 60;

/// A parsed scene and its overrides, not yet checked against a schema.
#[derive(Debug, Clone)]
pub struct Document {
    file: String,
    overrides: Vec<String>,
    root: Node,
}

/// A value and where it came from.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub(crate) origin: Origin,
    pub(crate) content: Content,
}

/// Where a node came from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Origin {
    /// The file as a whole.
    File,
    /// A line of the file, counted from one.
    Line(usize),
    /// An override, by its position among them.
    Override(usize),
}

/// The content of a node.
#[derive(Debug, Clone)]
pub(crate) enum Content {
    Boolean(bool),
    /// Always within the range of `i64` or `u64`.
    Integer(i128),
    /// Always finite.
    Float(f64),
    Text(String),
    List(Vec<Node>),
    /// In the order of the file.
    Table(Vec<(String, Node)>),
    /// Valid TOML that no scene can use, whatever the schema says.
    Unusable {
        text: String,
        why: &'static str,
    },
}

/// Whether an override sets what stands at a key or below it, so that one of that key after it leaves nothing of it.
pub fn is_lost_to(text: &str, key: &str) -> bool {
    overrides::split_assignment(text).is_some_and(|(path, _)| is_within(path, key))
}

/// Whether a key path, however it is spelt, is that of a key or of what stands below it.
pub(crate) fn is_within(path: &str, key: &str) -> bool {
    let [Ok(path), Ok(key)] = [path, key].map(overrides::parse_path) else { return false };
    let is_same = |(a, b): (&Segment, &Segment)| a == b || a.index().is_some() && a.index() == b.index();
    path.len() >= key.len() && path.iter().zip(&key).all(is_same)
}

impl Document {
    /// Parses the text of `file` and lays the overrides, such as `roles\[1\].speed=0.6`, over it in order.
    ///
    /// An override's value is TOML; text that is not is taken as a bare string.
    ///
    /// # Errors
    /// The first syntax error of the text, or else every override that is malformed or cannot be placed.
    pub fn parse(file: &str, text: &str, overrides: &[String]) -> Result<Document, SceneError> {
        let parse = || Document::parse_here(file, text, overrides);
        std::thread::scope(|scope| {
            let parser = std::thread::Builder::new().stack_size(PARSER_STACK_BYTES);
            match parser.spawn_scoped(scope, parse).map(ScopedJoinHandle::join) {
                Ok(Ok(outcome)) => outcome,
                Ok(Err(panic)) => std::panic::resume_unwind(panic),
                // No threads on this platform at all.
                Err(error) if error.kind() == ErrorKind::Unsupported => parse(),
                Err(error) => {
                    let message = format!("cannot be parsed, since no thread can be started: {error}");
                    Err(Problem::of_file(file, message, None).into())
                }
            }
        })
    }

    fn parse_here(file: &str, text: &str, overrides: &[String]) -> Result<Document, SceneError> {
        let parsed = DeTable::parse(text).map_err(|error| syntax_problem(file, text, &error))?;
        let lines = Lines::of(text);
        let content = table(parsed.into_inner(), &|offset| Origin::Line(lines.line_of(offset)), 0);
        let root = Node { origin: Origin::File, content };
        Document { file: file.to_owned(), overrides: Vec::new(), root }.overridden(overrides)
    }

    /// The document with more overrides after its own.
    ///
    /// # Errors
    /// Every override that is malformed or cannot be placed.
    pub(crate) fn with(&self, more: &[String]) -> Result<Document, SceneError> {
        self.clone().overridden(more)
    }

    fn overridden(mut self, more: &[String]) -> Result<Document, SceneError> {
        let mut refused = SceneError::default();
        for text in more {
            let origin = Origin::Override(self.overrides.len());
            self.overrides.push(text.clone());
            if let Err(problem) = overrides::apply(&mut self.root, text, origin) {
                refused.push(*problem);
            }
        }
        refused.into_result(self)
    }

    /// The document as a value that fits `schema`, which is a JSON Schema as schemars derives it.
    ///
    /// # Errors
    /// Every place where the document does not fit: unknown and missing keys, wrong types, values out of
    /// range, unknown choices, numbers that are not finite.
    pub fn check(&self, schema: &Value) -> Result<Value, SceneError> {
        schema_check::check(self, &self.root, schema)
    }

    /// The document as `T`, whose schema this is.
    ///
    /// # Errors
    /// As [`Document::check`].
    pub fn read<T: DeserializeOwned>(&self, schema: &Value) -> Result<T, SceneError> {
        serde_json::from_value(self.check(schema)?)
            .map_err(|error| SceneError::from(self.problem("", error.to_string(), None)))
    }

    /// A problem with the value at `key_path`, for checks that no schema can express.
    ///
    /// It is placed at that value or, where there is none, at the nearest table that would hold it.
    pub fn problem(&self, key_path: &str, message: impl Into<String>, help: Option<String>) -> Problem {
        let segments = overrides::parse_path(key_path).unwrap_or_default();
        let mut nearest = &self.root;
        let mut reached = 0;
        while let Some(child) = segments.get(reached).and_then(|segment| nearest.child(segment)) {
            nearest = child;
            reached += 1;
        }
        let exact = reached > 0 && reached == segments.len();
        Problem {
            place: self.place(nearest.origin),
            key: key_path.to_owned(),
            found: exact.then(|| nearest.shown()),
            message: message.into(),
            help,
        }
    }

    pub(crate) fn place(&self, origin: Origin) -> Place {
        match origin {
            Origin::File => Place::File { file: self.file.clone() },
            Origin::Line(line) => Place::Line { file: self.file.clone(), line },
            Origin::Override(index) => Place::Override { text: self.overrides[index].clone() },
        }
    }
}

impl Node {
    fn child(&self, segment: &Segment) -> Option<&Node> {
        match (&self.content, segment) {
            (Content::Table(entries), Segment::Key(key)) => entry(entries, key),
            (Content::List(items), _) => items.get(segment.index()?),
            _ => None,
        }
    }

    /// The value as TOML on one line, abbreviated to fit a message.
    pub(crate) fn shown(&self) -> String {
        let mut text = String::new();
        self.write(&mut text);
        match text.char_indices().nth(SHOWN_CHARACTERS) {
            Some((end, _)) => format!("{}...", &text[..end]),
            None => text,
        }
    }

    fn write(&self, out: &mut String) {
        match &self.content {
            Content::Boolean(value) => out.push_str(&value.to_string()),
            Content::Integer(value) => out.push_str(&value.to_string()),
            Content::Float(value) => out.push_str(&format!("{value:?}")),
            Content::Text(value) => out.push_str(&format!("{value:?}")),
            Content::Unusable { text, .. } => out.push_str(text),
            Content::List(items) => write_all(out, ["[", "]"], items, |out, item| item.write(out)),
            Content::Table(entries) => write_all(out, ["{ ", " }"], entries, |out, (key, node)| {
                out.push_str(&format!("{} = ", quoted_unless_bare(key)));
                node.write(out);
            }),
        }
    }
}

/// Writes the items between the brackets, stopping early once there is more than a message will show.
fn write_all<T>(out: &mut String, brackets: [&str; 2], items: &[T], write: impl Fn(&mut String, &T)) {
    out.push_str(brackets[0]);
    for (index, item) in items.iter().enumerate() {
        if out.len() > 4 * SHOWN_CHARACTERS {
            return;
        }
        out.push_str(if index == 0 { "" } else { ", " });
        write(out, item);
    }
    out.push_str(brackets[1]);
}

/// The node under `key`.
pub(crate) fn entry<'a>(entries: &'a [(String, Node)], key: &str) -> Option<&'a Node> {
    entries.iter().find(|(name, _)| name == key).map(|(_, node)| node)
}

/// The path of `key` within the table at `path`.
pub(crate) fn child_path(path: &str, key: &str) -> String {
    let key = quoted_unless_bare(key);
    if path.is_empty() { key } else { format!("{path}.{key}") }
}

fn quoted_unless_bare(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(bare) { key.to_owned() } else { format!("{key:?}") }
}

/// Turns a parsed TOML value into a node, asking `origin_at` where a byte offset lies.
pub(crate) fn node(value: Spanned<DeValue<'_>>, origin_at: &dyn Fn(usize) -> Origin, depth: usize) -> Node {
    let origin = origin_at(value.span().start);
    let content = match value.into_inner() {
        DeValue::String(text) => Content::Text(text.into_owned()),
        DeValue::Boolean(flag) => Content::Boolean(flag),
        DeValue::Integer(integer) => match i128::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(value) if fits_64_bits(value) => Content::Integer(value),
            _ => unusable(integer.to_string(), "must be an integer that fits in 64 bits"),
        },
        DeValue::Float(float) => match float.as_str().parse() {
            Ok(value) if f64::is_finite(value) => Content::Float(value),
            _ => unusable(float.to_string(), "must be a finite number"),
        },
        DeValue::Datetime(datetime) => {
            unusable(datetime.to_string(), "must not be a date or a time; as a string it needs quotes")
        }
        DeValue::Array(_) | DeValue::Table(_) if depth >= MAX_DEPTH => {
            unusable("...".to_owned(), "must not nest more than 64 levels deep")
        }
        DeValue::Array(items) => {
            Content::List(items.into_iter().map(|item| node(item, origin_at, depth + 1)).collect())
        }
        DeValue::Table(entries) => table(entries, origin_at, depth + 1),
    };
    Node { origin, content }
}

fn table(entries: DeTable<'_>, origin_at: &dyn Fn(usize) -> Origin, depth: usize) -> Content {
    let mut entries: Vec<_> = entries.into_iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let named = |(key, value): (Spanned<_>, _)| {
        let name = std::borrow::Cow::into_owned(key.into_inner());
        (name, node(value, origin_at, depth))
    };
    Content::Table(entries.into_iter().map(named).collect())
}

fn unusable(text: String, why: &'static str) -> Content {
    Content::Unusable { text, why }
}

fn fits_64_bits(value: i128) -> bool {
    i64::try_from(value).is_ok() || u64::try_from(value).is_ok()
}

fn syntax_problem(file: &str, text: &str, error: &Error) -> Problem {
    let line = error.span().map(|span| Lines::of(text).line_of(span.start));
    let reads = line.and_then(|line| text.lines().nth(line - 1)).map(str::trim);
    let help = reads.filter(|reads| !reads.is_empty()).map(|reads| {
        let shown: String = reads.chars().take(SHOWN_CHARACTERS).collect();
        format!("the line reads `{shown}`")
    });
    let mut problem = Problem::of_file(file, format!("not valid TOML: {}", error.message()), help);
    if let Some(line) = line {
        problem.place = Place::Line { file: file.to_owned(), line };
    }
    problem
}

/// The offsets at which lines end, to turn byte offsets into line numbers.
struct Lines {
    ends: Vec<usize>,
}

impl Lines {
    fn of(text: &str) -> Lines {
        Lines { ends: text.match_indices('\n').map(|(at, _)| at).collect() }
    }

    fn line_of(&self, offset: usize) -> usize {
        1 + self.ends.partition_point(|end| *end < offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Document {
        Document::parse("s.toml", text, &[]).unwrap()
    }

    fn syntax_report(text: &str) -> String {
        Document::parse("s.toml", text, &[]).unwrap_err().to_string()
    }

    fn unchecked(text: &str) -> Result<Value, SceneError> {
        parsed(text).check(&Value::Bool(true))
    }

    #[test]
    fn a_syntax_error_names_the_line_and_shows_it() {
        let report = syntax_report("a = 1\r\n\r\nb = mirror\r\n");
        assert!(report.starts_with("s.toml:3: not valid TOML: "), "{report}");
        assert!(report.ends_with("help: the line reads `b = mirror`"), "{report}");
        assert!(syntax_report("a = 1\na = 2").starts_with("s.toml:2: not valid TOML: duplicate key"));
    }

    #[test]
    fn a_later_check_is_placed_at_the_value_or_the_nearest_table_that_holds_it() {
        let document =
            parsed("a = 1\n\n[[roles]]\n\n[[roles]]\nmotion = { kind = \"still\",\n speed = 2.0 }\n");
        let line = |key: &str| document.problem(key, "is odd", None).to_string();
        assert_eq!(line("roles[1].motion.speed"), "s.toml:7: roles[1].motion.speed = 2.0: is odd");
        assert_eq!(line("roles[1].motion.phase"), "s.toml:6: roles[1].motion.phase: is odd");
        assert_eq!(line("roles[7].motion"), "s.toml:3: roles[7].motion: is odd");
        assert_eq!(line("frame"), "s.toml: frame: is odd");
        assert_eq!(line("..["), "s.toml: ..[: is odd");
    }

    #[test]
    fn a_value_set_by_an_override_is_placed_at_the_override() {
        let document = Document::parse("s.toml", "a = 1", &["b.c=2".into(), "b.d=x".into()]).unwrap();
        assert_eq!(document.problem("b.d", "is odd", None).to_string(), "--set b.d=x: b.d = \"x\": is odd");
        assert_eq!(document.problem("b.e", "is odd", None).to_string(), "--set b.c=2: b.e: is odd");
    }

    #[test]
    fn keys_keep_the_order_of_the_file() {
        let value = unchecked("z = 1\na = 2\n[m]\ny = 1\nb = 2\n").unwrap();
        assert_eq!(value.to_string(), r#"{"z":1,"a":2,"m":{"y":1,"b":2}}"#);
    }

    #[test]
    fn values_that_no_scene_can_use_are_refused_whatever_the_schema() {
        let text = "a = nan\nb = [1, -inf]\nc = 1e999\nd = 2024-01-01\ne = 99999999999999999999\n";
        let report = unchecked(text).unwrap_err().to_string();
        for expected in [
            "s.toml:1: a = nan: must be a finite number",
            "s.toml:2: b[1] = -inf: must be a finite number",
            "s.toml:3: c = 1e999: must be a finite number",
            "s.toml:4: d = 2024-01-01: must not be a date or a time",
            "s.toml:5: e = 99999999999999999999: must be an integer that fits in 64 bits",
        ] {
            assert!(report.contains(expected), "{expected} is not in {report}");
        }
    }

    #[test]
    fn the_full_64_bit_range_of_integers_is_kept() {
        let value = unchecked("a = 0xffff_ffff_ffff_ffff\nb = -9223372036854775808").unwrap();
        assert_eq!((value["a"].as_u64(), value["b"].as_i64()), (Some(u64::MAX), Some(i64::MIN)));
    }

    #[test]
    fn deep_nesting_is_refused_without_exhausting_the_stack() {
        assert!(syntax_report(&format!("a = {}", "[".repeat(100_000))).contains("recurs"));
        assert!(syntax_report(&format!("a{} = 1", ".a".repeat(100_000))).contains("recurs"));
        // Dotted keys and inline tables multiply, and so get past the parser's own limit.
        let step = format!("{{ a{} = ", ".a".repeat(70));
        let deepest = format!("a = {}1{}", step.repeat(70), " }".repeat(70));
        let report = unchecked(&deepest).unwrap_err().to_string();
        assert!(report.contains("must not nest more than 64 levels deep"), "{report}");
    }

    #[test]
    fn long_values_are_abbreviated_in_messages() {
        let text = format!("a = [{}]\nb = \"{}\"", "1234, ".repeat(5000), "é".repeat(500));
        for key in ["a", "b"] {
            let found = parsed(&text).problem(key, "is odd", None).found.unwrap();
            assert_eq!(found.chars().count(), SHOWN_CHARACTERS + 3, "{found}");
        }
    }
}
