//! Peers on Fast DDS, compiled here from their sources beside this file.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use super::support::Running;

/// A program of this name with these arguments, and the lines that it prints.
pub fn started(name: &str, arguments: &[String], folder: &Path) -> (Running, Receiver<String>) {
    let program = folder.join(name);
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/interop/{name}.cpp"));
    let compiled = Command::new("g++")
        .args(["-std=c++17", "-o"])
        .arg(&program)
        .arg(source)
        .args(["-lfastrtps", "-lfastcdr"])
        .status()
        .expect("g++ is there");
    assert!(compiled.success(), "the peer is compiled with Debian's libfastrtps-dev");
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let output = BufReader::new(child.stdout.take().expect("piped"));
    let (say, lines) = channel();
    std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| say.send(line)));
    (Running(child), lines)
}

/// The milliseconds that a call of `fastdds_client` took, and the length of its reply.
pub fn called(line: &str) -> (f64, usize) {
    let (took, length) = line.split_once(' ').expect("two numbers");
    (took.parse().expect("milliseconds"), length.parse().expect("bytes"))
}
