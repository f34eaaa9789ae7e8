//! `flockform completions`: scripts that complete commands, options, and names of bundled files beside paths.

use std::fmt::Write;

use clap::CommandFactory;
use clap_complete::{Shell, generate};

use super::Arguments;

/// The script for a shell.
pub fn script(shell: Shell) -> String {
    let mut script = Vec::new();
    generate(shell, &mut Arguments::command(), "flockform", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    match shell {
        Shell::Zsh => with_paths_in_zsh(script),
        Shell::Fish => script + &names_in_fish(),
        _ => script,
    }
}

/// The names that each command completes at its first place, without those of enumerations.
fn names() -> Vec<(String, Vec<String>)> {
    let root = Arguments::command();
    let of = |command: &clap::Command| {
        let argument = command.get_positionals().find(|one| one.is_hide_possible_values_set())?;
        let names = argument.get_possible_values().iter().map(|value| value.get_name().to_owned()).collect();
        Some((command.get_name().to_owned(), names))
    };
    root.get_subcommands().filter_map(of).collect()
}

/// Zsh takes the values of an argument for all there are; these may be paths as well.
fn with_paths_in_zsh(mut script: String) -> String {
    let mut all: Vec<String> = names().into_iter().map(|(_, names)| names.join(" ")).collect();
    all.sort_unstable();
    all.dedup();
    for names in all {
        let action =
            format!(":{{_alternative \"names\\:bundled file\\:({names})\" \"files\\:file\\:_files\"}}'");
        script = script.replace(&format!(":({names})'"), &action);
    }
    script
}

/// Fish completes paths by itself; the generated script has no values of arguments without a flag.
fn names_in_fish() -> String {
    names().iter().fold(String::new(), |mut lines, (command, names)| {
        let condition = format!("__fish_seen_subcommand_from {command}");
        let _ = writeln!(lines, "complete -c flockform -n \"{condition}\" -a \"{}\"", names.join(" "));
        lines
    })
}
