//! The bytes on the wire against an encoder that others wrote: `rosbags` from PyPI.

use std::io::Write;
use std::process::{Command, Stdio};

use crate::structs::{every_struct, package};

/// Bytes as the reference encoder writes them, for each `{"type": .., "value": ..}` line.
fn reference_bytes(lines: &str) -> Vec<Vec<u8>> {
    let python = std::env::var("FLOCKFORM_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros_messages/reference_cdr.py");
    let mut encoder = Command::new(&python)
        .arg(script)
        .arg(package())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{python}: {error}"));
    encoder.stdin.take().expect("piped").write_all(lines.as_bytes()).expect("the encoder reads all");
    let output = encoder.wait_with_output().expect("the encoder ends");
    assert!(output.status.success(), "{python} {script} failed: is rosbags installed for it?");
    let text = String::from_utf8(output.stdout).expect("hexadecimal digits");
    let byte = |pair: &[u8]| u8::from_str_radix(str::from_utf8(pair).expect("ASCII"), 16).expect("digits");
    text.lines().map(|line| line.as_bytes().chunks(2).map(byte).collect()).collect()
}

#[test]
#[ignore = "needs rosbags: python3 -m venv V; V/bin/pip install rosbags; FLOCKFORM_PYTHON=V/bin/python cargo test --test ros_messages -- --ignored"]
fn every_message_has_the_bytes_of_the_reference_encoder() {
    let structs = every_struct();
    let lines: String = structs
        .iter()
        .map(|filled| format!("{}\n", serde_json::json!({"type": filled.name, "value": filled.json})))
        .collect();
    let reference = reference_bytes(&lines);
    assert_eq!(reference.len(), structs.len());
    for (ours, reference) in structs.iter().zip(reference) {
        assert_eq!(reference[..4], [0, 1, 0, 0], "{}: little-endian CDR", ours.name);
        assert_eq!(ours.bytes, reference[4..], "{}", ours.name);
    }
}
