//! `flockform install`: the layout that ROS 2 tools look for, and nothing overwritten that is not ours.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::program::{done, read, refused_in, temporary, text};

const CHECKOUT: &str = env!("CARGO_MANIFEST_DIR");

/// Paths of all files below a folder, relative to it.
fn files(folder: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(inside) = folders.pop() {
        for entry in std::fs::read_dir(folder.join(&inside)).expect("readable") {
            let entry = entry.expect("readable");
            let path = inside.join(entry.file_name());
            if entry.path().is_dir() {
                folders.push(path)
            } else {
                found.insert(path.display().to_string());
            }
        }
    }
    found
}

#[test]
fn the_package_lies_where_ros_looks_for_it() {
    let folder = temporary();
    let said = done(&["install", "--prefix", "p"], folder.path());
    assert!(said.contains("/p/setup.bash\n"), "{said}");
    let said = done(&["install", "--prefix", "it's"], folder.path());
    assert!(said.contains(r"/it'\''s/setup.bash'"), "{said}");

    let prefix = folder.path().join("p");
    let version =
        std::process::Command::new(prefix.join("lib/flockform/flockform")).arg("--version").output();
    assert!(text(&version.expect("executable").stdout).starts_with("flockform "));
    assert_eq!(read(prefix.join("share/ament_index/resource_index/packages/flockform")), "");
    let share = prefix.join("share/flockform");
    let checkout = Path::new(CHECKOUT);
    assert_eq!(read(share.join("package.xml")), read(checkout.join("package.xml")));
    let folders = [
        ("msgs", "msgs"),
        ("parameters", "launch-configs/parameters"),
        ("swarms", "launch-configs/swarms"),
        ("views", "launch-configs/views"),
    ];
    for (there, here) in folders {
        let here = checkout.join(here);
        assert_eq!(files(&share.join(there)), files(&here));
        for file in files(&here) {
            assert_eq!(read(share.join(there).join(&file)), read(here.join(&file)), "{file}");
        }
    }
    let launch: BTreeSet<String> = files(&checkout.join("launch-configs"))
        .into_iter()
        .filter(|file| file.contains("_launch."))
        .collect();
    assert_eq!(files(&share.join("launch")), launch);
    assert!(files(&prefix).iter().all(|file| !file.contains("partial")), "{:?}", files(&prefix));
}

#[test]
fn the_views_show_topics_and_frames_that_the_node_has() {
    let views = Path::new(CHECKOUT).join("launch-configs/views");
    let read = |name: &str| std::fs::read_to_string(views.join(name)).expect("readable");
    let (rviz, foxglove) = (read("formation.rviz"), read("formation.foxglove.json"));
    let layout: serde_json::Value = serde_json::from_str(&foxglove).expect("JSON");
    let panels = layout["configById"].as_object().expect("panels");
    let topics = |text: &str| -> BTreeSet<String> {
        let quoted = |c: char| !(c.is_ascii_alphanumeric() || "/_".contains(c));
        text.split(quoted).filter(|word| word.starts_with("/flockform/")).map(str::to_owned).collect()
    };
    // RViz takes this name in its own namespace, which is the fleet's in the demo.
    let values = rviz.lines().filter_map(|line| line.trim().strip_prefix("Value: "));
    assert_eq!(values.filter(|value| value.contains('/')).collect::<Vec<_>>(), ["flockform/markers"]);
    assert_eq!(topics(&foxglove), ["/flockform/markers", "/flockform/state"].map(str::to_owned).into());
    let state =
        std::fs::read_to_string(Path::new(CHECKOUT).join("msgs/flockform_msgs/msg/FormationState.msg"));
    let state = state.expect("readable");
    let fields: Vec<&str> = state.lines().filter_map(|line| line.split_whitespace().nth(1)).collect();
    let plotted: Vec<&str> =
        foxglove.split("/flockform/state.").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(plotted.len(), 3);
    assert!(plotted.iter().all(|field| fields.contains(field)), "{plotted:?} of {fields:?}");
    // Every panel of the layout has its settings.
    let tree = layout["layout"].to_string();
    let shown: BTreeSet<&str> = tree.split('"').filter(|word| word.contains('!')).collect();
    assert_eq!(shown, panels.keys().map(String::as_str).collect());
    // Foxglove and its open fork Lichtblick each read the titles under a key of their own.
    for (name, panel) in panels {
        assert!(panel["foxglovePanelTitle"].is_string(), "{name}");
        assert_eq!(panel["lichtblickPanelTitle"], panel["foxglovePanelTitle"], "{name}");
    }
    // Both show the frame of a swarm file that names none, and no frame of a robot, of which there are a hundred.
    assert!(rviz.contains("    Fixed Frame: map\n"));
    assert_eq!(panels["3D!formation"]["followTf"], "map");
    assert_eq!(panels["3D!formation"]["scene"]["transforms"]["axisScale"], 0);
    assert_eq!(panels["3D!formation"]["scene"]["transforms"]["lineWidth"], 0);
    // RViz reads these two into variables that nothing initialises.
    for dock in ["Left", "Right"] {
        assert!(rviz.contains(&format!("\n  Hide {dock} Dock: false\n")), "{dock}");
    }
    // A launch that does not find the package rviz2 ends, and leaves running what it has started.
    let demo = read("../demo_launch.xml");
    let place = |what: &str| demo.find(what).expect("in the demo");
    assert!(place("pkg=\"rviz2\"") < place("<include "));
}

/// One that is started anew is not in the emergency stop in which its robots may stand, and leads them back to where its programs begin.
#[test]
fn launch_files_start_no_node_again_that_has_ended() {
    let folder = Path::new(CHECKOUT).join("launch-configs");
    let mut nodes = 0;
    for name in files(&folder).iter().filter(|name| name.contains("_launch.")) {
        let text = std::fs::read_to_string(folder.join(name)).expect("readable");
        let (begins, ends) = if name.ends_with(".py") { (" Node(", "\n        )") } else { ("<node ", ">") };
        let started = text.split(begins).skip(1).filter_map(|rest| rest.split(ends).next());
        for node in started.filter(|one| one.contains("\"node ") || one.contains("\"node\"")) {
            assert!(!node.contains("respawn"), "{name}: {node}");
            nodes += 1;
        }
    }
    assert_eq!(nodes, 3, "those of two launch files in XML and of one in Python");
}

#[test]
fn sourcing_the_prefix_puts_it_first_and_once() {
    let folder = temporary();
    done(&["install", "--prefix", "a b"], folder.path());
    let script = "set -eu; . 'a b/setup.bash'; . 'a b/local_setup.bash'; printf %s \"$AMENT_PREFIX_PATH\"";
    let shell = std::process::Command::new("bash")
        .args(["-c", script])
        .current_dir(folder.path())
        .env("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
        .output()
        .expect("bash");
    let prefix = std::fs::canonicalize(folder.path()).expect("exists").join("a b");
    assert_eq!(
        text(&shell.stdout),
        format!("{}:/opt/ros/jazzy", prefix.display()),
        "{}",
        text(&shell.stderr)
    );
}

#[test]
fn installing_again_renews_what_is_ours() {
    let folder = temporary();
    let install = || done(&["install", "--prefix", "."], folder.path());
    install();
    let before = files(folder.path());
    std::fs::remove_file(folder.path().join("setup.bash")).expect("installed");
    install();
    assert_eq!(files(folder.path()), before);
}

#[test]
fn a_file_that_was_changed_is_replaced_by_force_only() {
    let folder = temporary();
    let parameters = folder.path().join("share/flockform/parameters/formation.yaml");
    done(&["install", "--prefix", "."], folder.path());
    std::fs::write(&parameters, "mine").expect("writable");
    let before = files(folder.path());

    refused_in(
        &["install", "--prefix", "."],
        folder.path(),
        &["formation.yaml is not flockform's", "--force"],
    );
    assert_eq!(read(&parameters), "mine");
    assert_eq!(files(folder.path()), before);

    done(&["install", "--prefix", ".", "--force"], folder.path());
    assert!(read(&parameters).contains("ros__parameters"));
}

#[test]
fn a_workspace_keeps_its_own_setup_files() {
    let folder = temporary();
    std::fs::write(folder.path().join("setup.bash"), "colcon").expect("writable");
    done(&["install", "--prefix", "."], folder.path());
    assert_eq!(read(folder.path().join("setup.bash")), "colcon");
    assert!(folder.path().join("local_setup.bash").exists());
}

#[test]
fn a_prefix_that_cannot_be_is_refused_and_nothing_is_left() {
    let folder = temporary();
    std::fs::write(folder.path().join("share"), "a file").expect("writable");
    refused_in(&["install", "--prefix", "."], folder.path(), &["cannot install"]);
    assert_eq!(files(folder.path()), BTreeSet::from(["share".to_string()]));
}

/// FNV-1a, as the list of installed files has it.
fn checksum(bytes: &[u8]) -> String {
    let step = |sum: u64, byte: &u8| (sum ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    format!("{:016x}", bytes.iter().fold(0xcbf2_9ce4_8422_2325, step))
}

#[test]
fn what_an_earlier_list_names_is_removed_in_the_package_s_folders_only() {
    let folder = temporary();
    let prefix = folder.path().join("prefix");
    let install = || done(&["install", "--prefix", "prefix"], folder.path());
    install();
    let write = |path: &str| std::fs::write(folder.path().join(path), "gone").expect("writable");
    let gone = "prefix/share/flockform/gone.txt";
    let kept = ["important.txt", "prefix/thesis.tex", "prefix/share/other.txt"];
    kept.into_iter().chain([gone]).for_each(write);
    #[cfg(unix)]
    std::os::unix::fs::symlink(folder.path(), prefix.join("share/flockform/link")).expect("linked");
    let named = [
        "../important.txt".to_owned(),
        "share/flockform/../../../important.txt".to_owned(),
        "share/flockform/link/important.txt".to_owned(),
        folder.path().join("important.txt").display().to_string(),
        "thesis.tex".to_owned(),
        "share/other.txt".to_owned(),
        "share/flockform/gone.txt".to_owned(),
    ];
    let list = prefix.join("share/flockform/installed-files");
    let lines = named.map(|path| format!("{} {path}\n", checksum(b"gone"))).concat();
    std::fs::write(&list, read(&list) + &lines).expect("writable");
    install();
    for path in kept {
        assert_eq!(read(folder.path().join(path)), "gone", "{path}");
    }
    assert!(!folder.path().join(gone).exists(), "what is gone from the package goes");
}
