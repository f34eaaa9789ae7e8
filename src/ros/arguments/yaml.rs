//! The part of YAML that parameters are written in: one document of scalars, lists and mappings.

use saphyr_parser::{Event, Parser, ScalarStyle, Span, Tag};

/// How deep lists and mappings may be nested; what parameters need is a handful.
const DEEPEST: usize = 32;

#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    Scalar(Scalar),
    Sequence(Vec<Node>),
    Mapping(Vec<Entry>),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Scalar {
    pub text: String,
    /// Quoted or tagged `!!str`: never a number or a truth value.
    pub is_text: bool,
}

/// A key of a mapping, and what it holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub key: String,
    /// Line of the key, from 1.
    pub line: usize,
    pub node: Node,
}

/// Why a text is no YAML, or not of this part of it.
#[derive(Debug)]
pub struct YamlError {
    /// Line, from 1.
    pub line: usize,
    pub reason: String,
    pub help: &'static str,
}

/// A list or mapping that has begun.
enum Open {
    Sequence(Vec<Node>),
    Mapping { entries: Vec<Entry>, key: Option<(String, usize)> },
}

/// The document in `text`; `None` where there is nothing.
pub fn parse(text: &str) -> Result<Option<Node>, YamlError> {
    let mut open: Vec<Open> = Vec::new();
    let mut document = None;
    for event in Parser::new_from_str(text) {
        let (event, span) = event.map_err(|error| YamlError {
            line: error.marker().line(),
            reason: format!("is no YAML: {}", error.info()),
            help: "check indentation, brackets and quotes near this line",
        })?;
        let finished = match event {
            Event::Scalar(text, style, _, tag) => Some(scalar(text.into_owned(), style, tag.as_deref())),
            Event::SequenceStart(..) => begin(&mut open, Open::Sequence(Vec::new()), span)?,
            Event::MappingStart(..) => {
                begin(&mut open, Open::Mapping { entries: Vec::new(), key: None }, span)?
            }
            Event::SequenceEnd | Event::MappingEnd => open.pop().map(Open::close),
            Event::Alias(_) => {
                return Err(refuse(
                    span,
                    "has an alias (`*name`)",
                    "write the value out: ROS reads no aliases",
                ));
            }
            Event::DocumentStart(_) if document.is_some() => {
                return Err(refuse(span, "has a second document", "write one document in a file"));
            }
            _ => None,
        };
        let Some(node) = finished else { continue };
        match open.last_mut() {
            Some(parent) => parent.take(node, span)?,
            None => document = Some(node),
        }
    }
    Ok(document)
}

fn begin(open: &mut Vec<Open>, begun: Open, span: Span) -> Result<Option<Node>, YamlError> {
    if open.len() == DEEPEST {
        return Err(refuse(span, "is nested more than 32 deep", "flatten it: a.b.c is one parameter name"));
    }
    open.push(begun);
    Ok(None)
}

fn scalar(text: String, style: ScalarStyle, tag: Option<&Tag>) -> Node {
    let quoted = matches!(style, ScalarStyle::SingleQuoted | ScalarStyle::DoubleQuoted);
    let tagged = tag.is_some_and(|tag| tag.is_yaml_core_schema() && tag.suffix == "str");
    Node::Scalar(Scalar { text, is_text: quoted || tagged })
}

fn refuse(span: Span, reason: &str, help: &'static str) -> YamlError {
    YamlError { line: span.start.line(), reason: reason.into(), help }
}

impl Open {
    fn close(self) -> Node {
        match self {
            Self::Sequence(items) => Node::Sequence(items),
            Self::Mapping { entries, .. } => Node::Mapping(entries),
        }
    }

    fn take(&mut self, node: Node, span: Span) -> Result<(), YamlError> {
        match self {
            Self::Sequence(items) => items.push(node),
            Self::Mapping { entries, key } => match (key.take(), node) {
                (Some((key, line)), node) => entries.push(Entry { key, line, node }),
                (None, Node::Scalar(Scalar { text, .. })) if !text.is_empty() => {
                    *key = Some((text, span.start.line()));
                }
                (None, Node::Scalar(_)) => return Err(refuse(span, "has an empty key", "name the key")),
                (None, _) => {
                    return Err(refuse(span, "has a list or mapping as a key", "write keys as plain words"));
                }
            },
        }
        Ok(())
    }
}
