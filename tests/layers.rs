//! The rooms keep their order: the core imports no other room.

use std::path::{Path, PathBuf};

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the folder exists") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            files.push(path);
        }
    }
    files
}

/// Rooms of this crate that a room's files name, tests included.
fn rooms_named_in(room: &str) -> Vec<(PathBuf, String)> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(room);
    let files = rust_files(&source);
    assert!(!files.is_empty(), "{room} has files");
    let mut named = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("readable");
        for path in text.split("crate::").skip(1) {
            let other: String = path.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if other != room {
                named.push((file.clone(), other));
            }
        }
    }
    named
}

fn assert_imports_only(room: &str, allowed: &[&str]) {
    for (file, other) in rooms_named_in(room) {
        assert!(allowed.contains(&other.as_str()), "{} imports {other}", file.display());
    }
}

#[test]
fn geometry_imports_no_other_room() {
    assert_imports_only("geometry", &[]);
}

#[test]
fn flock_imports_geometry_alone() {
    assert_imports_only("flock", &["geometry"]);
}

#[test]
fn geometry_and_flock_have_no_features_no_clock_and_no_threads() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for file in ["geometry", "flock"].iter().flat_map(|room| rust_files(&source.join(room))) {
        let text = std::fs::read_to_string(&file).expect("readable");
        for word in ["feature =", "std::time", "std::thread", "std::fs", "std::io", "rayon", "serde"] {
            assert!(!text.contains(word), "{} uses {word}", file.display());
        }
    }
}

#[test]
fn sweep_imports_the_flock_alone() {
    assert_imports_only("sweep", &["geometry", "flock"]);
}

#[test]
fn solve_stands_on_the_flock_its_sweeps_and_the_ranks_that_share_them() {
    assert_imports_only("solve", &["geometry", "flock", "sweep", "ranks"]);
}

#[test]
fn the_finite_elements_know_geometry_alone() {
    assert_imports_only("fem", &["geometry"]);
}

#[test]
fn material_imports_the_flock_and_geometry() {
    assert_imports_only("material", &["geometry", "flock"]);
}

#[test]
fn scene_knows_nothing_of_hosts_and_outputs() {
    assert_imports_only("scene", &["geometry", "flock", "solve", "material", "sweep"]);
}

#[test]
fn ranks_know_nothing_of_what_they_exchange() {
    assert_imports_only("ranks", &[]);
}

#[test]
fn mpi_is_called_in_one_place() {
    assert_eq!(files_with("use mpi::"), ["ranks/mpi.rs"]);
}

#[test]
fn the_engine_knows_no_scene() {
    assert_imports_only("engine", &["geometry", "flock", "material", "sweep", "ranks"]);
}

#[test]
fn continuum_knows_nothing_of_outputs() {
    assert_imports_only(
        "continuum",
        &["geometry", "flock", "solve", "scene", "material", "sweep", "engine", "ranks"],
    );
}

#[test]
fn studies_know_nothing_of_outputs() {
    assert_imports_only(
        "study",
        &["geometry", "scene", "continuum", "engine", "flock", "material", "solve", "sweep", "fem"],
    );
}

#[test]
fn the_swarm_knows_nothing_of_middleware_and_outputs() {
    assert_imports_only(
        "swarm",
        &["geometry", "scene", "continuum", "engine", "flock", "material", "solve", "sweep"],
    );
}

#[test]
fn messages_describe_the_swarm_and_know_nothing_of_the_network() {
    assert_imports_only("messages", &["scene", "flock", "swarm"]);
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/messages");
    for file in rust_files(&source) {
        let text = std::fs::read_to_string(&file).expect("readable");
        for word in ["std::net", "std::fs", "std::thread", "socket2", "DomainParticipant"] {
            assert!(!text.contains(word), "{} uses {word}", file.display());
        }
    }
}

#[test]
fn ros_is_an_edge_of_the_swarm() {
    assert_imports_only("ros", &["scene", "continuum", "engine", "flock", "messages", "swarm"]);
}

#[test]
fn shared_memory_is_an_edge_of_the_swarm_and_of_the_continuum() {
    assert_imports_only("shm", &["scene", "continuum", "engine", "flock", "swarm"]);
}

#[test]
fn recordings_stand_on_the_messages_and_know_nothing_of_the_network_and_of_figures() {
    assert_imports_only("record", &["scene", "continuum", "engine", "flock", "swarm", "messages"]);
}

#[test]
fn python_stands_above_the_rooms_that_compute_and_below_no_other() {
    let below = [
        "geometry",
        "flock",
        "sweep",
        "solve",
        "material",
        "fem",
        "scene",
        "engine",
        "continuum",
        "study",
        "swarm",
    ];
    assert_imports_only("python", &below);
}

#[test]
fn live_sessions_show_bodies_and_swarms_and_know_nothing_of_middleware() {
    assert_imports_only("live", &["scene", "continuum", "engine", "flock", "swarm", "export", "study"]);
}

#[test]
fn live_sessions_answer_this_computer_alone() {
    let opens = ["TcpListener::bind", "UdpSocket::bind"].map(|word| files_with(word).into_iter());
    let own: Vec<String> = opens.into_iter().flatten().filter(|file| file.starts_with("live/")).collect();
    assert_eq!(own, ["live/server.rs"]);
    let server = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/live/server.rs");
    let text = std::fs::read_to_string(server).expect("readable");
    assert!(text.contains("TcpListener::bind((Ipv4Addr::LOCALHOST,"));
}

/// Files of `src` that contain a word.
fn files_with(word: &str) -> Vec<String> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let has = |file: &PathBuf| std::fs::read_to_string(file).expect("readable").contains(word);
    let name = |file: PathBuf| file.strip_prefix(&source).expect("in src").display().to_string();
    let mut files: Vec<String> = rust_files(&source).into_iter().filter(has).map(name).collect();
    files.sort();
    files
}

#[test]
fn the_width_of_vectors_is_chosen_in_one_place() {
    // The neighbour query is written in vectors itself.
    assert_eq!(files_with("target_feature(enable"), ["flock/grid/candidates.rs", "flock/lanes.rs"]);
}

#[test]
fn loops_are_written_in_vectors_where_rows_are_applied_and_bonds_are_watched() {
    let known = ["flock/fracture/watch.rs", "solve/operator/kernel.rs", "sweep/kernel.rs", "sweep/torn.rs"];
    assert_eq!(files_with("in_lanes("), known);
}

#[test]
fn threads_share_a_body_in_the_schedule_and_where_a_solver_or_a_report_goes_over_all_of_it() {
    let known = [
        "engine/forces.rs",
        "engine/movement.rs",
        "solve/corotated/body.rs",
        "solve/equilibrium/steps.rs",
        "solve/equilibrium/windows/tests.rs",
        "solve/refined.rs",
        "sweep/mod.rs",
        "sweep/schedule.rs",
        "sweep/schedule/tests.rs",
        "sweep/tests.rs",
    ];
    let rooms = ["flock/", "sweep/", "engine/", "solve/"];
    let mut found = files_with("rayon::");
    found.retain(|file| rooms.iter().any(|room| file.starts_with(room)));
    assert_eq!(found, known);
}

#[test]
fn unsafe_code_stands_where_it_was_measured_to_pay_or_where_the_system_is_called() {
    let known = [
        "cli/interrupt.rs",
        "cli/memory.rs",
        "flock/grid/candidates.rs",
        "flock/lanes.rs",
        "ros/edge/door.rs",
        "ros/edge/pulse.rs",
        "shm/folders.rs",
        "sweep/gathers.rs",
    ];
    assert_eq!(files_with("unsafe {"), known);
}

/// A standard error that is full or closed ends no command.
#[test]
fn no_line_to_standard_error_can_end_the_program() {
    let others = files_with("eprintln!").into_iter().filter(|file| !file.starts_with("examples"));
    assert_eq!(others.collect::<Vec<_>>(), Vec::<String>::new());
}

#[test]
fn films_are_drawn_by_the_figures() {
    let own = |word: &str| files_with(word).into_iter().any(|file| file.starts_with("export/film/"));
    assert!(!own("Svg") && !own("<svg"), "a film has no drawing of its own");
    assert!(own("figures::"));
}

#[test]
fn keys_and_certificates_are_looked_into_in_one_place() {
    assert_eq!(files_with("openssl::"), ["ros/arguments/enclave.rs"]);
    let gated = files_with("feature = \"security\"");
    assert!(gated.iter().all(|file| file.starts_with("ros/")), "{gated:?}");
}
