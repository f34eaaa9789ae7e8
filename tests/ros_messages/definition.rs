//! Reads `.msg` and `.srv` text.

/// A message as its definition has it.
#[derive(Debug, Default, PartialEq)]
pub struct Definition {
    /// Type and name of each field; types as in the text, but without packages and aliases.
    pub fields: Vec<(String, String)>,
    /// Names and values.
    pub constants: Vec<(String, i64)>,
    /// Packages that field types name.
    pub packages: Vec<String>,
}

pub fn parse(text: &str) -> Definition {
    let mut definition = Definition::default();
    for line in text.lines() {
        let line = line.split('#').next().expect("the first part").trim();
        let Some((kind, rest)) = line.split_once(char::is_whitespace) else {
            assert!(line.is_empty(), "`{line}` is no field");
            continue;
        };
        if let Some((package, _)) = kind.split_once('/') {
            definition.packages.push(package.into());
        }
        match rest.split_once('=') {
            Some((name, value)) => {
                let value = value.trim().parse().unwrap_or_else(|_| panic!("`{line}` has no whole number"));
                definition.constants.push((name.trim().into(), value));
            }
            None => definition.fields.push((plain(kind), rest.trim().into())),
        }
    }
    definition
}

/// The two halves of a service definition.
pub fn parse_service(text: &str) -> [Definition; 2] {
    let (request, response) = text.split_once("\n---\n").expect("a service has two halves");
    [parse(request), parse(response)]
}

/// A type without its package; `byte` is the old name of `uint8`.
fn plain(kind: &str) -> String {
    let name = kind.rsplit('/').next().expect("the last part");
    match name.strip_prefix("byte") {
        Some(array) => format!("uint8{array}"),
        None => name.into(),
    }
}

#[test]
fn fields_constants_and_comments_are_told_apart() {
    let text =
        "# a comment\nuint8 A=1 # one\n\nstd_msgs/Header header\nfloat64[36] c  # row by row\nbyte[] d\n";
    let definition = parse(text);
    let field = |kind: &str, name: &str| (kind.to_string(), name.to_string());
    assert_eq!(
        definition.fields,
        [field("Header", "header"), field("float64[36]", "c"), field("uint8[]", "d")]
    );
    assert_eq!(definition.constants, [("A".to_string(), 1)]);
    assert_eq!(definition.packages, ["std_msgs"]);
}
