//! Package `type_description_interfaces`: what a type is made of, for peers that do not have its files.
//!
//! [`TypeDescription::of`] reads it from the definitions here; [`TypeDescription::hash`] is what ROS 2 distinguishes types by
//! (REP 2016, RIHS01).

use std::fmt::Write as _;

use sha2::{Digest, Sha256};

use super::definitions::{all_contained, definition, trimmed};
use super::diagnostic_msgs::KeyValue;
use super::{messages, services, structs};

messages! { "type_description_interfaces";
    FieldType {
        /// Of the element; 48 more for an array of fixed length, 96 for a bounded sequence, 144 for one without a bound.
        type_id: u8,
        /// Length of an array, bound of a sequence.
        capacity: u64,
        /// Bound of a string.
        string_capacity: u64,
        /// `package/msg/Name`; empty where the element is no message.
        nested_type_name: String,
    }

    Field {
        name: String,
        #[serde(rename = "type")]
        kind: FieldType,
        /// As text; empty where there is none.
        #[serde(default)]
        default_value: String,
    }

    IndividualTypeDescription {
        /// `package/msg/Name`.
        type_name: String,
        fields: Vec<Field>,
    }

    TypeDescription {
        type_description: IndividualTypeDescription,
        /// All that it contains, by ascending name.
        referenced_type_descriptions: Vec<IndividualTypeDescription>,
    }

    TypeSource {
        type_name: String,
        /// Kind of the file: its ending.
        encoding: String,
        raw_file_contents: String,
    }
}

services! { "type_description_interfaces";
    GetTypeDescription: GetTypeDescriptionRequest => GetTypeDescriptionResponse;
}

structs! {
    /// Request of [`GetTypeDescription`].
    GetTypeDescriptionRequest {
        /// `package/msg/Name`.
        type_name: String,
        /// As `RIHS01_` and 64 digits.
        type_hash: String,
        include_type_sources: bool,
    }

    /// Response of [`GetTypeDescription`].
    GetTypeDescriptionResponse {
        successful: bool,
        failure_reason: String,
        type_description: TypeDescription,
        type_sources: Vec<TypeSource>,
        extra_information: Vec<KeyValue>,
    }
}

impl TypeDescription {
    /// The description of a message, `package/Name`; `None` for one without a definition here.
    pub fn of(name: &str) -> Option<Self> {
        let mut names = all_contained(name);
        names.sort();
        Some(Self {
            type_description: individual(name)?,
            referenced_type_descriptions: names.iter().map(|name| individual(name)).collect::<Option<_>>()?,
        })
    }

    /// The texts of the message and of all that it contains.
    pub fn sources(&self) -> Vec<TypeSource> {
        let all = [&self.type_description].into_iter().chain(&self.referenced_type_descriptions);
        let source = |one: &IndividualTypeDescription| TypeSource {
            type_name: one.type_name.clone(),
            encoding: "msg".into(),
            raw_file_contents: trimmed(definition(&one.type_name.replace("/msg/", "/")).unwrap_or_default()),
        };
        all.map(source).collect()
    }

    /// `RIHS01_` and the SHA-256 of the description as JSON in ROS 2's spelling, without default values.
    pub fn hash(&self) -> String {
        let digest = Sha256::digest(self.hashed());
        digest.iter().fold("RIHS01_".to_owned(), |mut hash, byte| {
            let _ = write!(hash, "{byte:02x}");
            hash
        })
    }

    /// Written by hand since the spaces count. Names are of letters, digits, `_` and `/`: nothing is to be escaped.
    fn hashed(&self) -> String {
        let field = |Field { name, kind, .. }: &Field| {
            let FieldType { type_id, capacity, string_capacity, nested_type_name } = kind;
            format!(
                "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {type_id}, \"capacity\": {capacity}, \
                 \"string_capacity\": {string_capacity}, \"nested_type_name\": \"{nested_type_name}\"}}}}"
            )
        };
        let individual = |IndividualTypeDescription { type_name, fields }: &IndividualTypeDescription| {
            let fields: Vec<String> = fields.iter().map(field).collect();
            format!("{{\"type_name\": \"{type_name}\", \"fields\": [{}]}}", fields.join(", "))
        };
        let others: Vec<String> = self.referenced_type_descriptions.iter().map(individual).collect();
        format!(
            "{{\"type_description\": {}, \"referenced_type_descriptions\": [{}]}}",
            individual(&self.type_description),
            others.join(", ")
        )
    }
}

fn individual(name: &str) -> Option<IndividualTypeDescription> {
    let package = name.split('/').next().unwrap_or_default();
    let fields = definition(name)?.lines().filter_map(|line| field(line, package)).collect();
    Some(IndividualTypeDescription { type_name: name.replace('/', "/msg/"), fields })
}

/// The field of a line; constants, comments and empty lines have none.
fn field(line: &str, package: &str) -> Option<Field> {
    let mut words = line.split('#').next()?.split_whitespace();
    let (kind, name, default) = (words.next()?, words.next()?, words.next().unwrap_or_default());
    let is_constant = name.contains('=') || default.starts_with('=');
    let kind = || field_type(kind, package);
    (!is_constant).then(|| Field { name: name.into(), kind: kind(), default_value: default.into() })
}

fn field_type(kind: &str, package: &str) -> FieldType {
    let (element, brackets) = kind.split_once('[').unwrap_or((kind, ""));
    let length = brackets.trim_end_matches(']');
    let number = |text: &str| text.parse::<u64>().unwrap_or(0);
    let (offset, capacity) = match (length, brackets) {
        (_, "") => (0, 0),
        ("", _) => (144, 0),
        _ => length.strip_prefix("<=").map_or((48, number(length)), |bound| (96, number(bound))),
    };
    let (element, bound) = element.split_once("<=").unwrap_or((element, ""));
    let plain = match element {
        "int8" => 2,
        "uint8" | "char" => 3,
        "int16" => 4,
        "uint16" => 5,
        "int32" => 6,
        "uint32" => 7,
        "int64" => 8,
        "uint64" => 9,
        "float32" => 10,
        "float64" => 11,
        "bool" => 15,
        "byte" => 16,
        "string" if bound.is_empty() => 17,
        "string" => 21,
        _ => NESTED,
    };
    let nested_type_name = match element.split_once('/') {
        _ if plain != NESTED => String::new(),
        Some((package, name)) => format!("{package}/msg/{name}"),
        None => format!("{package}/msg/{element}"),
    };
    FieldType { type_id: plain + offset, capacity, string_capacity: number(bound), nested_type_name }
}

/// A field that is a message.
const NESTED: u8 = 1;

#[cfg(test)]
mod tests {
    use super::*;

    /// As Jazzy's packages have them in their `.json` files.
    #[test]
    fn hashes_are_those_of_ros_2() {
        let known = [
            ("builtin_interfaces/Time", "b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"),
            ("std_msgs/Header", "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"),
            ("geometry_msgs/PoseStamped", "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"),
        ];
        for (name, digits) in known {
            let description = TypeDescription::of(name).expect("known");
            assert_eq!(description.hash(), format!("RIHS01_{digits}"), "{name}\n{}", description.hashed());
        }
    }

    #[test]
    fn fields_of_every_kind_are_read() {
        let of = |line: &str| {
            let Field { name, kind, default_value } = field(line, "own").expect("a field");
            let FieldType { type_id, capacity, string_capacity, nested_type_name } = kind;
            (name, type_id, capacity, string_capacity, nested_type_name, default_value)
        };
        let none = String::new;
        assert_eq!(of("float64[36] covariance"), ("covariance".into(), 59, 36, 0, none(), none()));
        assert_eq!(of("uint8[] data  # bytes"), ("data".into(), 147, 0, 0, none(), none()));
        assert_eq!(of("string<=5[<=3] names"), ("names".into(), 117, 3, 5, none(), none()));
        assert_eq!(of("Pose[] poses"), ("poses".into(), 145, 0, 0, "own/msg/Pose".into(), none()));
        assert_eq!(of("std_msgs/Header h"), ("h".into(), 1, 0, 0, "std_msgs/msg/Header".into(), none()));
        assert_eq!(of("bool on true"), ("on".into(), 15, 0, 0, none(), "true".into()));
        for line in ["", "# only words", "byte OK=0", "byte OK = 0"] {
            assert_eq!(field(line, "own"), None, "{line}");
        }
    }
}
