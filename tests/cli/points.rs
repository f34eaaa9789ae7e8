//! Bodies given as points: what is written of them speaks of them as their file does, and what is wrong with them.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flockform::messages::flockform_msgs::FormationState;
use flockform::messages::geometry_msgs::PoseArray;
use flockform::record::Reader;

use crate::cloud::{shuffled, table};
use crate::program::*;

type Row = (usize, [f64; 2]);

/// Two dozen by ten particles about a spacing apart, on no lattice.
fn cloud() -> Vec<Row> {
    let shift = |seed: f64| 0.3 * ((78.233 * seed).sin() * 43_758.545_3).fract();
    (0..24 * 10)
        .map(|i| {
            let seed = f64::from(i);
            let place = [f64::from(i / 10) + shift(seed), f64::from(i % 10) + shift(seed + 0.5)];
            (3 * i as usize + 5001, place)
        })
        .collect()
}

const SCENE: &str = r#"
title = "A cloud is torn"
neighbours = { kind = "within", radius = 1.6 }
fracture = { stretch = 1.5 }
record = { probes = [5301, 5016], vtk_every = 100 }
stop = { steps = 200 }

[body]
shape = { kind = "points", file = "points/cloud.csv" }

[[roles]]
region = { kind = "edge", side = "left", depth = 0.9 }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right", depth = 0.9 }
role = "leader"
motion = { kind = "velocity", per_step = [0.05, 0.0] }
"#;

fn write(folder: &Path, scene: &str, table: &str) {
    std::fs::create_dir_all(folder.join("points")).expect("a folder");
    std::fs::write(folder.join("points/cloud.csv"), table).expect("written");
    std::fs::write(folder.join("cloud.toml"), scene).expect("written");
}

fn run(folder: &Path, more: &[&str]) {
    done(&[&["run", "cloud.toml", "-q", "--out", "o"][..], more].concat(), folder);
}

fn records(path: &Path) -> Vec<csv::StringRecord> {
    csv::Reader::from_path(path).expect("written").records().map(|row| row.expect("a row")).collect()
}

/// The numbers of an array of a ParaView file, each of 8 bytes.
fn array(frame: &str, name: &str) -> Vec<[u8; 8]> {
    let (_, rest) = frame.split_once(&format!("Name=\"{name}\"")).expect("there");
    let (text, _) = rest.split_once('>').expect("opened").1.split_once('<').expect("closed");
    let bytes = STANDARD.decode(text.trim()).expect("base64");
    bytes[8..].as_chunks().0.to_vec()
}

fn number(text: &str) -> f64 {
    text.parse().expect("a number")
}

#[test]
fn tables_and_frames_have_the_ids_and_the_order_of_the_file() {
    let (folder, rows) = (temporary(), shuffled(&cloud(), 1));
    write(folder.path(), SCENE, &table(&rows));
    run(folder.path(), &[]);
    let out = folder.path().join("o");
    let place = |id: usize| rows.iter().find(|row| row.0 == id).expect("in the file").1;

    let last = records(&out.join("final.csv"));
    assert_eq!(last.len(), rows.len());
    for (row, (id, [x, y])) in last.iter().zip(&rows) {
        assert_eq!((&row[0], &row[1], &row[2]), (&*id.to_string(), "", ""), "no columns without a lattice");
        assert_eq!([number(&row[4]), number(&row[5])], [*x, *y]);
    }

    let probes = records(&out.join("probes.csv"));
    for (row, id) in probes.iter().zip([5301, 5016]) {
        assert_eq!((&row[0], &row[1]), ("0", &*id.to_string()));
        assert_eq!([number(&row[2]), number(&row[3])], place(id));
    }

    let drawn = std::fs::read_to_string(out.join("probes.svg")).expect("written");
    assert!(drawn.contains(">5301<") && drawn.contains(">5016<"));

    let breaks = records(&out.join("breaks.csv"));
    assert!(!breaks.is_empty());
    for row in &breaks {
        let [a, b] = [1, 2].map(|column| row[column].parse::<usize>().expect("an id"));
        assert!(a < b, "{a} {b}");
        for k in 0..2 {
            assert_eq!(number(&row[3 + k]), (place(a)[k] + place(b)[k]) / 2.0, "{a} {b}");
        }
    }
    let summary = json_in(&out.join("summary.json"));
    let pair = [1, 2].map(|column| breaks[0][column].parse::<usize>().expect("an id"));
    assert_eq!(summary["broken_bonds"]["first"]["pair"], serde_json::json!(pair));

    let frame = std::fs::read_to_string(out.join("steps/step_000000.vtu")).expect("written");
    let ids: Vec<usize> = array(&frame, "id").into_iter().map(|id| i64::from_le_bytes(id) as usize).collect();
    assert!(ids.iter().eq(rows.iter().map(|row| &row.0)), "{ids:?}");
    let points: Vec<f64> = array(&frame, "Points").into_iter().map(f64::from_le_bytes).collect();
    assert!(points.chunks(3).zip(&rows).all(|(point, row)| point[..2] == row.1));
    let connected = array(&frame, "connectivity");
    let ends: Vec<usize> =
        connected[rows.len()..].iter().map(|&end| i64::from_le_bytes(end) as usize).collect();
    assert!(ends.len() > 4 * rows.len());
    for pair in ends.chunks(2) {
        let [[ax, ay], [bx, by]] = [rows[pair[0]].1, rows[pair[1]].1];
        assert!((ax - bx).hypot(ay - by) <= 1.6, "{pair:?}");
    }
    let frame = std::fs::read_to_string(out.join("steps/step_000200.vtu")).expect("written");
    for (name, column) in [("pe1", 8), ("pe2", 9)] {
        let values = array(&frame, name).into_iter().map(f64::from_le_bytes);
        assert!(values.eq(last.iter().map(|row| number(&row[column]))), "{name}");
    }
}

#[test]
fn two_orders_of_the_same_points_end_in_the_same_table() {
    let ended = |seed| {
        let folder = temporary();
        write(folder.path(), SCENE, &table(&shuffled(&cloud(), seed)));
        run(folder.path(), &[]);
        let text = std::fs::read_to_string(folder.path().join("o/final.csv")).expect("written");
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let ids: Vec<String> =
            lines.iter().map(|line| line.split(',').next().expect("an id").into()).collect();
        lines.sort();
        (lines, ids)
    };
    let (here, there) = (ended(1), ended(2));
    assert_eq!(here.0, there.0);
    assert_ne!(here.1, there.1, "each in the order of its file");
}

#[test]
fn the_report_knows_the_particles_by_their_ids() {
    let (folder, rows) = (temporary(), shuffled(&cloud(), 4));
    write(folder.path(), SCENE, &table(&rows));
    run(folder.path(), &[]);
    let page = std::fs::read_to_string(folder.path().join("o/report.html")).expect("written");
    let numbers = |name: &str| {
        let (_, rest) = page.split_once(&format!("id=\"s0-{name}\"")).expect("there");
        let (text, _) = rest.split_once('>').expect("opened").1.split_once('<').expect("closed");
        let packed = STANDARD.decode(text.trim()).expect("base64");
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut flate2::read::ZlibDecoder::new(&packed[..]), &mut bytes)
            .expect("deflate");
        bytes
    };
    // Byte planes; ids as differences with the sign in the lowest bit, doubles as they are.
    let (ids, x) = (numbers("ids"), numbers("X"));
    let count = rows.len();
    let mut last = 0u32;
    for i in 0..count {
        let coded = (0..4).fold(0, |z, plane| z | u32::from(ids[plane * count + i]) << (8 * plane));
        last = last.wrapping_add((coded >> 1) ^ 0u32.wrapping_sub(coded & 1));
        let place = f64::from_le_bytes(std::array::from_fn(|plane| x[plane * count + i]));
        let row = rows.iter().find(|row| row.0 == last as usize).expect("an id of the file");
        assert_eq!(place, row.1[0], "particle {last}");
    }
    assert!(page.contains("\"name\":\"5301\"") && page.contains("\"name\":\"5016\""), "the probes' lines");
}

#[test]
fn a_recording_has_the_particles_in_the_order_of_the_file() {
    let (folder, rows) = (temporary(), shuffled(&cloud(), 5));
    write(folder.path(), SCENE, &table(&rows));
    run(folder.path(), &["--record", "r.mcap"]);
    let (mut poses, mut members) = (None, None);
    let damage = Reader::open(&folder.path().join("r.mcap")).expect("readable").each(&mut |entry| {
        if let Some(message) = entry.decode::<PoseArray>() {
            poses.get_or_insert(message);
        }
        if let Some(message) = entry.decode::<FormationState>() {
            members.get_or_insert(message);
        }
    });
    assert_eq!(damage, None);
    let (poses, state) = (poses.expect("poses"), members.expect("members"));
    assert_eq!((poses.poses.len(), state.members.len()), (rows.len(), rows.len()));
    for (n, (id, [x, y])) in rows.iter().enumerate() {
        let (pose, member) = (&poses.poses[n].position, &state.members[n]);
        assert_eq!(([pose.x, pose.y], &*member.name), ([*x, *y], &*id.to_string()));
        assert_eq!([member.position.x, member.position.y], [*x, *y]);
    }
}

#[test]
fn a_body_that_diverges_names_the_particle_as_its_file_does() {
    let folder = temporary();
    write(folder.path(), SCENE, &table(&shuffled(&cloud(), 6)));
    let grown = ["--set", "rule.feedback={factor=1.0}", "--set", "fracture={}", "--set", "stop.steps=5000"];
    let said = failed(&[&["run", "cloud.toml", "--out", "o"][..], &grown].concat(), folder.path());
    let (_, after) = said.split_once(": particle ").expect("it says who");
    let id: usize = after.split_once(' ').expect("and what").0.parse().expect("an id");
    assert!(cloud().iter().any(|row| row.0 == id), "{said}");
}

#[cfg(unix)]
#[test]
fn a_killed_run_of_points_goes_on_to_the_same_end_unless_its_file_was_sorted_meanwhile() {
    let (folder, rows) = (temporary(), shuffled(&cloud(), 7));
    let scene = SCENE.replace("steps = 200", "steps = 30000").replace("vtk_every = 100", "vtk_every = 10000");
    write(folder.path(), &scene, &table(&rows));
    run(folder.path(), &[]);
    let whole = |name: &str| std::fs::read(folder.path().join("o").join(name)).expect("written");
    let names = ["final.csv", "probes.csv", "breaks.csv", "steps/step_010000.vtu", "steps/step_030000.vtu"];
    let expected = names.map(whole);

    let run = ["run", "cloud.toml", "-q", "--out", "o", "--checkpoint-every", "5ms"];
    let unfinished = folder.path().join("o.unfinished");
    // On a busy machine the run may be over before it is seen and killed: another try.
    for _ in 0..20 {
        std::fs::remove_dir_all(folder.path().join("o")).expect("removed");
        let mut child = command(&run, folder.path()).spawn().expect("starts");
        while !unfinished.exists() && child.try_wait().expect("a child").is_none() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        child.kill().expect("killed");
        child.wait().expect("ended");
        if unfinished.exists() {
            break;
        }
    }
    let mut sorted = rows.clone();
    sorted.sort_by_key(|row| row.0);
    write(folder.path(), &scene, &table(&sorted));
    refused_in(&["run", "--resume", "o", "-q"], folder.path(), &["a file that the scene names"]);
    write(folder.path(), &scene, &table(&rows));
    done(&["run", "--resume", "o", "-q"], folder.path());
    for (name, expected) in names.iter().zip(&expected) {
        assert!(whole(name) == *expected, "{name} differs");
    }
}

/// Exit code 2, these words, and nothing but what was there.
fn refused(arguments: &[&str], scene: &str, table: &str, words: &[&str]) {
    let folder = temporary();
    write(folder.path(), scene, table);
    refused_in(arguments, folder.path(), &[words, &["help:"]].concat());
    let left = files(folder.path());
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
fn a_file_that_is_no_body_is_refused_by_line_and_remedy() {
    let run = ["run", "cloud.toml"];
    let of = |table: &str, words: &[&str]| refused(&run, SCENE, table, words);
    let missing = SCENE.replace("points/cloud.csv", "points/clud.csv");
    let words = ["cloud.toml:9", "body.shape.file", "clud.csv", "relative to the scene file"];
    refused(&run, &missing, "x,y\n", &words);
    of("a,b\n1,2\n", &["body.shape.file", "line 1", "the header is `a,b`", "`id,x,y`"]);
    of("x,y\n1,2\nNaN,3\n", &["line 3", "`x` = `NaN`", "finite"]);
    of("x,y\n1,2\n2,2\n1.0,2.0\n", &["lines 2 and 4", "both are at (1, 2)"]);
    of("id,x,y\n4,1,2\n4,2,2\n", &["lines 2 and 3", "both have `id` = 4"]);
    of("x,y\n", &["no point below the header"]);
    of(
        "id,x,y\n7,0,0\n3,1,0\n12,9,0\n",
        &["neighbours.radius", "particle 12 at (9, 0)", "within 1.6", "wider"],
    );
    let apart = "id,x,y\n5,9,0\n7,0,0\n3,1,0\n12,8,0\n";
    of(apart, &["body.shape", "2 parts", "particle 7 and particle 12", "not connected"]);
    let far = "x,y\n1e12,0\n1000000000001,0\n";
    of(far, &["body.shape", "a double has steps", "origin"]);
    let probes = SCENE.replace("[5301, 5016]", "[5302]");
    refused(&run, &probes, &table(&cloud()), &["record.probes[0]", "no particle 5302", "from 5001 to 5718"]);
    let region =
        SCENE.replace("{ kind = \"edge\", side = \"left\", depth = 0.9 }", "{ kind = \"ids\", ids = [9] }");
    refused(
        &run,
        &region,
        &table(&cloud()),
        &["roles[0].region.ids[0]", "no particle 9", "those of the body's file"],
    );
}

#[test]
fn what_needs_a_lattice_is_refused_of_a_cloud_with_the_remedy() {
    let table = table(&cloud());
    let set = |set: &str, words: &[&str]| {
        refused(
            &["run", "cloud.toml", "--set", set],
            SCENE,
            &table,
            &[words, &["a body of points has none"]].concat(),
        );
    };
    set("lattice={kind=\"square\",spacing=1.0}", &["lattice", "leave the lattice out"]);
    set("body.holes=[{kind=\"disc\",radius=1.0}]", &["body.holes", "leave the points in the hole out"]);
    set("body.anchor=[0.0,0.0]", &["body.anchor"]);
    set("frame=lagged", &["frame", "use frame = \"none\""]);
    set("material={kind=\"isotropic\",young=1.0,poisson=0.3}", &["material", "cells of a lattice"]);
    set("loads=[{kind=\"body\",force=[0.0,1.0]}]", &["loads"]);
    set("roles[1].motion={kind=\"reference\"}", &["roles[1].motion", "motion of their own"]);
    set("equilibrium={}", &["equilibrium", "stop = { tolerance"]);
    set("rule.mean={kind=\"material\"}", &["rule.mean", "barycentre"]);
    set("rule.weights={kind=\"list\",values=[1.0]}", &["rule.weights", "solved"]);
    set("rule.weights={kind=\"gradient\",length=3.0}", &["rule.weights"]);
    let run = ["run", "cloud.toml"];
    let mut neighbours = SCENE.replace("neighbours = { kind = \"within\", radius = 1.6 }\n", "");
    refused(&run, &neighbours, &table, &["neighbours", "how far its particles see", "kind = \"within\""]);
    neighbours += "\n[neighbours]\nkind = \"first\"\n";
    refused(&run, &neighbours, &table, &["neighbours", "no sites of a lattice", "kind = \"within\""]);
    refused(&["material", "cloud.toml"], SCENE, &table, &["body.shape", "no lattice"]);
    refused(&["compare", "cloud.toml"], SCENE, &table, &["material"]);
    refused(&["trade", "cloud.toml"], SCENE, &table, &["material"]);
    let hole = "title = \"h\"\nlattice = { kind = \"square\", spacing = 1.0 }\nbody = { shape = { kind = \"disc\", radius = 9.0 }, \
                holes = [{ kind = \"points\", file = \"points/cloud.csv\" }] }\n";
    refused(&run, hole, &table, &["body.holes[0]", "a shape of its own"]);
    refused(
        &run,
        "title = \"n\"\nbody = { shape = { kind = \"disc\", radius = 9.0 } }\n",
        "",
        &["lattice: is missing"],
    );
}

#[test]
fn a_swarm_is_no_cloud() {
    let flown = "title = \"s\"\n[scene]\nname = \"cloud.toml\"\n";
    let folder = temporary();
    write(folder.path(), SCENE, &table(&cloud()));
    let body = "title = \"s\"\n[body]\nshape = { kind = \"points\", file = \"points/cloud.csv\" }\n";
    for (swarm, word) in [(flown, "scene.name"), (body, "body.shape")] {
        std::fs::write(folder.path().join("swarm.toml"), swarm).expect("written");
        refused_in(&["swarm", "swarm.toml"], folder.path(), &[word, "[[robots]]"]);
    }
}

#[test]
fn a_plan_and_a_stability_study_know_a_cloud() {
    let folder = temporary();
    write(folder.path(), SCENE, &table(&cloud()));
    let said = done(&["plan", "cloud.toml", "--set", "update.damping=1.9"], folder.path());
    assert!(said.contains("none: points, the nearest 0."), "{said}");
    assert!(said.contains("240 (") && !said.contains("diverges"), "{said}");
    let linear = ["--set", "fracture={}", "--no-extremes", "-q", "--out", "s"];
    done(&[&["stability", "cloud.toml"][..], &linear].concat(), folder.path());
}
