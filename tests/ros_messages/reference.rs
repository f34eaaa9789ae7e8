//! The bytes on the wire against an encoder that others wrote: `rosbags` from PyPI.

use std::io::Write;
use std::process::{Command, Stdio};

use flockform::messages::definitions::{OWN, STANDARD};
use flockform::messages::type_description_interfaces::{TypeDescription, TypeSource};

use crate::structs::{every_struct, filled, package};

/// What the reference prints for each line.
fn reference(lines: &str) -> Vec<String> {
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
    String::from_utf8(output.stdout).expect("text").lines().map(str::to_owned).collect()
}

fn bytes(digits: &str) -> Vec<u8> {
    let byte = |pair: &[u8]| u8::from_str_radix(str::from_utf8(pair).expect("ASCII"), 16).expect("digits");
    digits.as_bytes().chunks(2).map(byte).collect()
}

#[test]
#[ignore = "needs rosbags: python3 -m venv V; V/bin/pip install rosbags; FLOCKFORM_PYTHON=V/bin/python cargo test --test ros_messages -- --ignored"]
fn every_message_has_the_bytes_of_the_reference_encoder() {
    let mut structs = every_struct();
    structs.push(filled::<TypeDescription>("type_description_interfaces/TypeDescription".into()));
    structs.push(filled::<TypeSource>("type_description_interfaces/TypeSource".into()));
    let lines: String = structs
        .iter()
        .map(|filled| format!("{}\n", serde_json::json!({"type": filled.name, "value": filled.json})))
        .collect();
    let reference: Vec<Vec<u8>> = reference(&lines).iter().map(|digits| bytes(digits)).collect();
    assert_eq!(reference.len(), structs.len());
    for (ours, reference) in structs.iter().zip(reference) {
        assert_eq!(reference[..4], [0, 1, 0, 0], "{}: little-endian CDR", ours.name);
        assert_eq!(ours.bytes, reference[4..], "{}", ours.name);
    }
}

#[test]
#[ignore = "needs rosbags: python3 -m venv V; V/bin/pip install rosbags; FLOCKFORM_PYTHON=V/bin/python cargo test --test ros_messages -- --ignored"]
fn every_type_has_the_hash_of_the_reference() {
    let names = || STANDARD.iter().chain(OWN).map(|(name, _)| *name);
    let lines: String = names().map(|name| format!("{}\n", serde_json::json!({"type": name}))).collect();
    let hashes = names().map(|name| TypeDescription::of(name).expect("defined").hash());
    assert!(names().count() > 30);
    for ((name, ours), reference) in names().zip(hashes).zip(reference(&lines)) {
        assert_eq!(ours, reference, "{name}");
    }
}
