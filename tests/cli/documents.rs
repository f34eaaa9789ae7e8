//! README, guides and help: what they promise, the program keeps.

use std::collections::BTreeMap;
use std::path::Path;

use crate::program::*;

/// Commands with a command of their own after them.
const NESTED: [&str; 1] = ["bench"];

/// Words of the help of a command line's commands, such as `["bench", "sweep"]`.
fn help(commands: &[&str]) -> String {
    done(&[commands, &["--help"]].concat(), Path::new("."))
}

/// Commands that a help lists.
fn listed(help: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = lines.take_while(|line| line.starts_with("  ")).filter(|line| !line.starts_with("   "));
    names.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

/// Every help, by the command line before `--help`.
fn helps() -> BTreeMap<Vec<String>, String> {
    let mut all = BTreeMap::from([(Vec::new(), help(&[]))]);
    let mut open = vec![Vec::new()];
    while let Some(parent) = open.pop() {
        for name in listed(&all[&parent]).into_iter().filter(|name| name != "help") {
            let line = [parent.clone(), vec![name]].concat();
            let words: Vec<&str> = line.iter().map(String::as_str).collect();
            all.insert(line.clone(), help(&words));
            open.push(line);
        }
    }
    all
}

/// README and guides with their paths.
fn documents() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let guides = files(&root.join("src/guide")).into_iter().filter(|path| path.extension().unwrap() == "md");
    let paths: Vec<_> = guides.chain([root.join("README.md")]).collect();
    assert_eq!(paths.len(), 15, "{paths:?}");
    let read = |path: &std::path::PathBuf| std::fs::read_to_string(path).expect("readable");
    paths.iter().map(|path| (path.display().to_string(), read(path))).collect()
}

/// Command lines in `sh` blocks, and in code spans, without comments.
fn command_lines(document: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut fence = None;
    for line in document.lines() {
        match (line.strip_prefix("```"), fence) {
            (Some(language), None) => fence = Some(language),
            (Some(_), Some(_)) => fence = None,
            (None, Some("sh")) => lines.push(line.split(" #").next().unwrap_or_default().to_owned()),
            (None, Some(_)) => {}
            (None, None) => lines.extend(line.split('`').skip(1).step_by(2).map(str::to_owned)),
        }
    }
    lines
        .iter()
        .flat_map(|line| line.split("&&"))
        .map(|line| line.trim_end_matches(" &").to_owned())
        .collect()
}

#[test]
fn every_command_line_of_readme_and_guides_is_one_of_the_program() {
    let helps = helps();
    let knows = |help: &str, flag: &str| {
        help.split(|c: char| c.is_whitespace() || ",[]=`".contains(c)).any(|word| word == flag)
    };
    let mut checked = 0;
    for (path, document) in documents() {
        for line in command_lines(&document) {
            let words: Vec<&str> = line.split_whitespace().take_while(|word| *word != "--ros-args").collect();
            let flags = || words.iter().filter(|word| word.starts_with("--") && word.len() > 2);
            match words.as_slice() {
                ["flockform", command, rest @ ..] if !command.starts_with('-') => {
                    let depth = if NESTED.contains(command) && !rest.is_empty() { 3 } else { 2 };
                    let key: Vec<String> = words[1..depth].iter().map(|&word| word.to_owned()).collect();
                    let help = helps.get(&key).unwrap_or_else(|| panic!("{path}: no command in `{line}`"));
                    for flag in flags() {
                        let flag = flag.split('=').next().unwrap_or_default();
                        assert!(knows(help, flag), "{path}: {key:?} has no {flag}: `{line}`");
                    }
                    checked += 1;
                }
                // An option by itself, in a sentence.
                [flag, ..] if flag.starts_with("--") && *flag != "--ignored" => {
                    assert!(helps.values().any(|help| knows(help, flag)), "{path}: no command has `{line}`");
                    checked += 1;
                }
                _ => {}
            }
        }
    }
    assert!(checked > 60, "{checked} command lines were found");
}

/// Those of other guides take long, or need peers; the exit code is 1 where the guide says so.
#[test]
fn the_command_lines_of_the_guide_to_swarms_end_as_it_says() {
    let guide = include_str!("../../src/guide/swarms.md");
    let folder = temporary();
    let mut ran = 0;
    for line in command_lines(guide) {
        let line = line.replace("/tmp/", "");
        let is_quick = ["swarm ", "plan ", "new ", "list "]
            .iter()
            .any(|command| line.strip_prefix("flockform ").is_some_and(|rest| rest.starts_with(command)));
        if !is_quick || line.contains("FILE") {
            continue;
        }
        let shell = line.replacen("flockform", concat!("'", env!("CARGO_BIN_EXE_flockform"), "'"), 1);
        let output =
            std::process::Command::new("sh").args(["-c", &shell]).current_dir(folder.path()).output();
        let output = output.expect("a shell");
        let expected = if line.contains("ranges=") { 1 } else { 0 };
        assert_eq!(
            output.status.code(),
            Some(expected),
            "`{line}`: {}{}",
            text(&output.stdout),
            text(&output.stderr)
        );
        ran += 1;
    }
    assert!(ran >= 7, "{ran} were run");
}

#[test]
fn no_help_has_an_escape_of_its_source() {
    let helps = helps();
    assert!(helps.len() > 15, "{:?}", helps.keys());
    for (command, help) in helps {
        assert!(!help.contains('\\'), "{command:?}:\n{help}");
    }
}

#[test]
fn neighbours_are_taken_in_every_form_that_the_help_names() {
    let help = help(&["material"]).split_whitespace().collect::<Vec<_>>().join(" ");
    let forms = help.split("Neighbours of a particle: ").nth(1).expect("described");
    let forms: Vec<&str> = forms.split(", or offsets").next().expect("listed").split(", ").collect();
    assert!(forms.len() >= 6, "{forms:?}");
    for form in forms {
        let output = flockform(&["material", "--lattice", "square", "--neighbours", form], Path::new("."));
        // A form that leaves the rule without a material is refused for that.
        assert!(!text(&output.stderr).contains("is no neighbourhood"), "{form}: {}", text(&output.stderr));
    }
}

#[test]
fn the_readme_stays_short() {
    let (_, readme) = documents().pop().expect("the last one");
    assert!(readme.starts_with("# flockform") && readme.lines().count() <= 150, "{}", readme.lines().count());
}

#[test]
fn every_file_that_names_the_version_names_this_one() {
    let version = env!("CARGO_PKG_VERSION");
    for (file, line) in [
        ("package.xml", format!("  <version>{version}</version>")),
        (".github/CITATION.cff", format!("version: {version}")),
    ] {
        let text =
            std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("readable");
        assert!(text.lines().any(|one| one == line), "{file} lacks `{line}`");
    }
    let changes = include_str!("../../.github/CHANGELOG.md");
    assert!(changes.contains(&format!("\n## {version}, ")), "CHANGELOG.md lacks {version}");
}
