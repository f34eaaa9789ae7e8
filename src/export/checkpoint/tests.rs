use super::*;
use crate::continuum::digest::digest;
use crate::continuum::plan::Plan;
use crate::continuum::record::{ProbeSeries, Snapshot};
use crate::engine::Engine;
use crate::scene::bundled;

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    bundled("tension").expect("bundled").load(&sets).expect("valid")
}

fn written(folder: &Path) -> (Engine, Vec<u8>) {
    let scene = scene(&[]);
    let plan = Plan::new(&scene).expect("fits");
    let sum = digest(&plan);
    let mut engine = Engine::new(plan.setup);
    let mut probe = ProbeSeries::new(66);
    for _ in 0..25 {
        engine.advance();
        probe.record(&engine);
    }
    let asked = RunRequest { scene: "tension".into(), set: vec!["a.b=1".into()], force: false };
    let records =
        Records { snapshots: vec![Snapshot::of(&engine)], probes: vec![probe], ..Records::default() };
    let checkpoint = Checkpoint::new(
        (&asked, &scene, sum),
        (EngineState::of(&engine), f64::INFINITY),
        (Cow::Borrowed(&records), None),
        Duration::from_millis(1500),
    );
    checkpoint.write(folder).expect("written");
    let bytes = fs::read(folder.join(FILE)).expect("there");
    (engine, bytes)
}

#[test]
fn a_checkpoint_is_read_back_to_the_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(Checkpoint::read(folder.path()).expect("readable").is_none());
    let (engine, _) = written(folder.path());
    let read = Checkpoint::read(folder.path()).expect("readable").expect("there");
    assert_eq!(read.engine, EngineState::of(&engine));
    assert_eq!(read.residual, f64::INFINITY);
    assert_eq!(read.stepping, Duration::from_millis(1500));
    let mut other = read.clone();
    assert_eq!(other.fingerprint(), read.fingerprint());
    other.residual = 1.0;
    assert_ne!(other.fingerprint(), read.fingerprint());
    assert_eq!((read.records.snapshots.len(), read.records.probes[0].pe1.len()), (1, 25));
    assert_eq!(read.records.snapshots[0].step, 25);
    let left: Vec<_> = fs::read_dir(folder.path()).expect("readable").flatten().collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

#[test]
fn every_truncation_and_every_flipped_bit_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, bytes) = written(folder.path());
    let path = folder.path().join(FILE);
    for length in (0..bytes.len()).step_by(97).chain(0..40) {
        let error = Checkpoint::of_bytes(&path, &bytes[..length]).expect_err("truncated");
        assert!(error.to_string().contains("is truncated: it has"), "{length}: {error}");
    }
    for at in (0..bytes.len()).step_by(61).chain(0..40) {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0x10;
        let error = Checkpoint::of_bytes(&path, &bytes).expect_err("corrupted").to_string();
        let expected = match at {
            0..8 => "is no checkpoint of flockform",
            8..12 => "layout",
            12..20 => "",
            _ => "is corrupted: its checksum differs",
        };
        assert!(error.contains(expected) && error.contains("help:"), "byte {at}: {error}");
    }
    let longer = [&bytes[..], &[0]].concat();
    let error = Checkpoint::of_bytes(&path, &longer).expect_err("too long").to_string();
    assert!(error.contains("bytes follow its end"), "{error}");
}

#[test]
fn another_program_s_checkpoint_is_refused_by_its_version() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, mut bytes) = written(folder.path());
    // The payload begins with the length of the version and the version.
    assert_eq!(&bytes[HEADER + 1..HEADER + 1 + PROGRAM_VERSION.len()], PROGRAM_VERSION.as_bytes());
    bytes[HEADER + 1] = b'9';
    let sum = crc32fast::hash(&bytes[HEADER..]);
    bytes[20..24].copy_from_slice(&sum.to_le_bytes());
    let error = Checkpoint::of_bytes(&folder.path().join(FILE), &bytes).expect_err("other").to_string();
    assert!(error.contains("flockform 9.") && error.contains(PROGRAM_VERSION), "{error}");
}

#[test]
fn a_foreign_scene_is_refused_by_its_key() {
    let folder = tempfile::tempdir().expect("a folder");
    written(folder.path());
    let read = Checkpoint::read(folder.path()).expect("readable").expect("there");
    let held = |sets: &[&str]| {
        let scene = scene(sets);
        read.require_of(folder.path(), &scene, digest(&Plan::new(&scene).expect("fits")))
    };
    held(&[]).expect("the same");
    let error = held(&["lattice.spacing=2.0"]).expect_err("another").to_string();
    assert!(error.contains("`lattice.spacing` was 1.0, is 2.0"), "{error}");
    let error = held(&["roles[1].motion.per_step=[0.5, 0.0]"]).expect_err("another").to_string();
    assert!(error.contains("`roles[1].motion.per_step[0]` was 0.6, is 0.5"), "{error}");
    let error = read.require_of(folder.path(), &scene(&[]), 0).expect_err("changed file").to_string();
    assert!(error.contains("a file that the scene names"), "{error}");
}
