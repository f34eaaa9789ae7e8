//! `--set KEY.PATH=VALUE`: reading an override and laying it over a document.

use toml::de::DeValue;

use crate::scene::document::problem::{Place, Problem};
use crate::scene::document::{Content, MAX_DEPTH, Node, Origin, child_path, node};
use crate::scene::text::counted;

/// One step of a key path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Segment {
    /// `.key`, which also reaches into a list where it is a number.
    Key(String),
    /// `[index]`.
    Index(usize),
}

impl Segment {
    pub(crate) fn index(&self) -> Option<usize> {
        match self {
            Segment::Key(key) => key.parse().ok(),
            Segment::Index(index) => Some(*index),
        }
    }
}

/// Lays the override `text` over `root`, creating the tables on its way that do not exist yet.
pub(crate) fn apply(root: &mut Node, text: &str, origin: Origin) -> Result<(), Box<Problem>> {
    let problem = |key: &str, message: String, help: Option<&str>| {
        let place = Place::Override { text: text.to_owned() };
        Box::new(Problem { place, key: key.to_owned(), found: None, message, help: help.map(str::to_owned) })
    };
    let Some((path, value)) = split_assignment(text) else {
        return Err(problem("", "an override has the form KEY.PATH=VALUE".to_owned(), None));
    };
    let segments = parse_path(path).map_err(|message| problem("", message, Some(PATH_HELP)))?;
    let value = parse_value(value, origin).map_err(|message| problem(path, message, None))?;
    set(root, &segments, value).map_err(|(key, message)| problem(&key, message, None))
}

const PATH_HELP: &str = "key paths look like `lattice.spacing` or `roles[1].motion.kind`";

/// Splits at the first `=` that is not inside a quoted key.
pub(crate) fn split_assignment(text: &str) -> Option<(&str, &str)> {
    let mut quoted = false;
    let is_assignment = |c: char| {
        quoted ^= c == '"';
        c == '=' && !quoted
    };
    let at = text.find(is_assignment)?;
    Some((text[..at].trim(), text[at + 1..].trim()))
}

/// The value at a path, as a document that was read has it.
pub(crate) fn find<'a>(value: &'a serde_json::Value, path: &str) -> Option<&'a serde_json::Value> {
    parse_path(path).ok()?.iter().try_fold(value, |value, segment| match segment {
        Segment::Key(key) if value.is_object() => value.get(key),
        segment => value.get(segment.index()?),
    })
}

/// Reads a path such as `roles\[1\].motion`, `roles.1.motion` or `names."a.b"`.
pub(crate) fn parse_path(path: &str) -> Result<Vec<Segment>, String> {
    let mut segments = Vec::new();
    let mut rest = path;
    loop {
        let (segment, after) = key_segment(rest)?;
        segments.push(segment);
        rest = after;
        while let Some(bracketed) = rest.strip_prefix('[') {
            let (index, after) = bracketed.split_once(']').ok_or("a `[` in the key path is not closed")?;
            let index = index.parse().map_err(|_| format!("the list index `{index}` is not a number"))?;
            segments.push(Segment::Index(index));
            rest = after;
        }
        if segments.len() > MAX_DEPTH {
            return Err(format!("the key path has more than {MAX_DEPTH} steps"));
        }
        if rest.is_empty() {
            return Ok(segments);
        }
        rest =
            rest.strip_prefix('.').ok_or_else(|| format!("expected `.` before `{rest}` in the key path"))?;
    }
}

fn key_segment(path: &str) -> Result<(Segment, &str), String> {
    if let Some(quoted) = path.strip_prefix('"') {
        let (key, after) = quoted.split_once('"').ok_or("a quote in the key path is not closed")?;
        return Ok((Segment::Key(key.to_owned()), after));
    }
    let (key, after) = path.split_at(path.find(['.', '[']).unwrap_or(path.len()));
    match key.trim() {
        "" => Err("the key path has an empty key".to_owned()),
        key => Ok((Segment::Key(key.to_owned()), after)),
    }
}

/// Reads a TOML value; what is not TOML is a bare string, unless it set out to be something else.
fn parse_value(text: &str, origin: Origin) -> Result<Node, String> {
    match DeValue::parse(text) {
        Ok(value) => Ok(node(value, &|_| origin, 0)),
        Err(_) if text.is_empty() => Err("no value after `=`; empty text is \"\"".to_owned()),
        Err(error) if text.starts_with(['[', '{', '"', '\'']) => {
            Err(format!("the value is not valid TOML: {}", error.message()))
        }
        Err(_) => Ok(Node { origin, content: Content::Text(text.to_owned()) }),
    }
}

/// Puts `value` at `path`; on failure gives the path that could not be reached, and why.
fn set(root: &mut Node, path: &[Segment], value: Node) -> Result<(), (String, String)> {
    let mut target = root;
    let mut reached = String::new();
    for (step, segment) in path.iter().enumerate() {
        let blank = match path.get(step + 1) {
            Some(Segment::Index(_)) => Content::List(Vec::new()),
            _ => Content::Table(Vec::new()),
        };
        let blank = Node { origin: value.origin, content: blank };
        let below = path_below(&reached, segment);
        target = descend(target, segment, blank).map_err(|why| (below.clone(), why))?;
        reached = below;
    }
    *target = value;
    Ok(())
}

fn path_below(path: &str, segment: &Segment) -> String {
    match segment {
        Segment::Key(key) => child_path(path, key),
        Segment::Index(index) => format!("{path}[{index}]"),
    }
}

/// The child of `parent` at `segment`, which is `blank` if it has to be made.
fn descend<'a>(parent: &'a mut Node, segment: &Segment, blank: Node) -> Result<&'a mut Node, String> {
    if !matches!(parent.content, Content::Table(_) | Content::List(_)) {
        return Err(format!("nothing can be set inside the value {}", parent.shown()));
    }
    match (&mut parent.content, segment) {
        (Content::Table(entries), Segment::Key(key)) => {
            let found = entries.iter().position(|(name, _)| name == key);
            let position = found.unwrap_or_else(|| {
                entries.push((key.clone(), blank));
                entries.len() - 1
            });
            Ok(&mut entries[position].1)
        }
        (Content::List(items), segment) => {
            let index = segment.index().ok_or("a list is entered by a number, such as `[0]`")?;
            if index == items.len() {
                items.push(blank);
            }
            let length = items.len();
            items.get_mut(index).ok_or_else(|| {
                let elements = counted(length, "element");
                format!("the list has {elements}, so an index is at most {length}, which appends one")
            })
        }
        _ => Err("a table is entered by a key, not by an index".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Document;

    const SCENE: &str = "n = 1\n[lattice]\nspacing = 0.5\n[[roles]]\nspeed = 1.0\n[[roles]]\nspeed = 2.0\n";

    fn overridden(overrides: &[&str]) -> Result<serde_json::Value, String> {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let document = Document::parse("s.toml", SCENE, &overrides).map_err(|error| error.to_string())?;
        document.check(&serde_json::Value::Bool(true)).map_err(|error| error.to_string())
    }

    fn value_at(pointer: &str, text: &str) -> serde_json::Value {
        overridden(&[text]).unwrap().pointer(pointer).cloned().unwrap_or_default()
    }

    fn refusal(text: &str) -> String {
        overridden(&[text]).unwrap_err()
    }

    #[test]
    fn both_index_notations_reach_into_a_list() {
        assert_eq!(value_at("/roles/1/speed", "roles[1].speed = 3.5"), 3.5);
        assert_eq!(value_at("/roles/1/speed", "roles.1.speed=3.5"), 3.5);
        assert_eq!(value_at("/roles/0/speed", "roles[1].speed=3.5"), 1.0);
    }

    #[test]
    fn values_are_toml_and_otherwise_bare_strings() {
        assert_eq!(value_at("/v", "v=[0.6, 0]"), serde_json::json!([0.6, 0]));
        assert_eq!(value_at("/v", "v=\"a = b\""), "a = b");
        assert_eq!(value_at("/v/k", "v={ k = true }"), true);
        assert_eq!(value_at("/v", "v=mirror"), "mirror");
        assert_eq!(value_at("/v", "v=a=b"), "a=b");
    }

    #[test]
    fn missing_tables_and_lists_are_created_on_the_way() {
        assert_eq!(value_at("/a/b/0/c", "a.b[0].c=7"), 7);
        assert_eq!(value_at("/roles/2/speed", "roles[2].speed=7"), 7);
        assert_eq!(value_at("/names/a.b", "names.\"a.b\"=7"), 7);
    }

    #[test]
    fn later_overrides_see_earlier_ones() {
        let value = overridden(&["roles[2].speed=7", "roles[3].speed=8", "roles[2].speed=9"]).unwrap();
        assert_eq!(value["roles"][2]["speed"], 9);
        assert_eq!(value["roles"][3]["speed"], 8);
    }

    #[test]
    fn an_index_beyond_the_list_names_its_length() {
        let expected = "--set roles[5].speed=1: roles[5]: the list has 2 elements, \
                        so an index is at most 2, which appends one";
        assert_eq!(refusal("roles[5].speed=1"), expected);
        let one = overridden(&["m=[7]", "m[5]=1"]).unwrap_err();
        assert!(one.contains("the list has 1 element, so"), "{one}");
    }

    #[test]
    fn nothing_is_set_inside_a_scalar() {
        assert!(refusal("n.deep=1").contains("n.deep: nothing can be set inside the value 1"));
        assert!(refusal("lattice[0]=1").contains("lattice[0]: a table is entered by a key"));
        assert!(refusal("roles.first=1").contains("roles.first: a list is entered by a number"));
    }

    #[test]
    fn malformed_overrides_are_all_reported() {
        let malformed = ["n", "=1", "a..b=1", "a[x]=1", "a[0=1", "a[0]b=1", "n=", "n=[1", "n=\"x", "\"n=1"];
        let report = overridden(&malformed).unwrap_err();
        for text in malformed {
            assert!(report.contains(&format!("--set {text}: ")), "{text} is not in {report}");
        }
    }

    #[test]
    fn an_override_path_can_only_be_so_deep() {
        let deep = format!("a{}=1", ".a".repeat(100_000));
        assert!(refusal(&deep).contains("more than 64 steps"));
    }
}
