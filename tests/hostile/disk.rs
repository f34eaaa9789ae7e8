//! Full disks: a failure says so, and what was safe before is safe afterwards.

use std::process::Command;

/// Runs a script beside a small file system of its own, `$disk`; `$flockform` is the program.
fn on_a_small_disk(size: &str, script: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let mounted =
        format!("mount -t tmpfs -o size={size} tmpfs \"$disk\" && cd \"$disk\" && {{ {script}; }} 2>&1");
    let output = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", &mounted])
        .env("disk", folder.path())
        .env("flockform", env!("CARGO_BIN_EXE_flockform"))
        .output()
        .expect("unshare is there");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    said
}

#[test]
#[ignore = "mounts a small disk, which takes user namespaces"]
fn a_full_disk_is_a_failure_that_every_message_names_and_leaves_nothing_half_written() {
    let runs = [
        ("16k", "run tension --no-report --figures none"),
        ("100k", "run tension --figures none"),
        ("40k", "run tension --no-report --figures png"),
        ("40k", "run tension --no-report --figures none --set record.vtk_every=1"),
        ("100k", "swarm square --no-report --record flight.mcap --set flight.duration=20.0"),
        ("40k", "swarm square --set flight.duration=2.0"),
    ];
    for (size, run) in runs {
        let script = format!("\"$flockform\" {run} -q --out o; echo \"code $?\"; ls -A");
        let said = on_a_small_disk(size, &script);
        assert!(said.contains("code 1"), "{run}: {said}");
        assert!(said.contains("error:") && said.contains("No space left"), "{run}: {said}");
        let left = said.split("code 1\n").nth(1).unwrap_or_default();
        // A recording is kept as far as it came.
        assert!(left.is_empty() || left == "flight.mcap.part\n", "{run}: {left:?}");
    }
}

#[test]
#[ignore = "mounts a small disk, which takes user namespaces"]
fn a_node_whose_recording_a_full_disk_cuts_short_flies_on_and_says_where_it_is() {
    let node =
        "ROS_DOMAIN_ID=87 ROS_LOCALHOST_ONLY=1 timeout --preserve-status -s INT 6 \"$flockform\" node square";
    let said = on_a_small_disk("24k", &format!("{node} --record flight.mcap; echo \"code $?\"; ls -A"));
    assert!(said.contains("code 1") && said.contains("the recording ends early"), "{said}");
    assert!(said.contains("is in flight.mcap.part") && !said.contains("nothing is kept"), "{said}");
    assert!(said.ends_with("code 1\nflight.mcap.part\n"), "{said}");
}

#[test]
#[ignore = "mounts a small disk, which takes user namespaces"]
fn shared_memory_that_is_full_is_refused_before_anything_is_in_it() {
    for subcommand in ["node", "robots"] {
        let mount = "mount -t tmpfs -o size=64k tmpfs /dev/shm";
        let said = on_a_small_disk(
            "64k",
            &format!(
                "{mount}; \"$flockform\" {subcommand} square --transport shm; echo \"code $?\"; ls -A /dev/shm"
            ),
        );
        assert!(said.ends_with("code 2\n") && said.contains("/dev/shm has 65 kB free"), "{said}");
    }
}

#[test]
#[ignore = "mounts a small disk, which takes user namespaces"]
fn whatever_a_full_disk_takes_nothing_of_is_a_failure() {
    for command in [
        "new scene other --from cook",
        "install --prefix p",
        "schema > s",
        "plan tension > s",
        "swarm square --no-report -q --out o --record r.mcap",
    ] {
        let script = format!("cat /dev/zero > fill 2> /dev/null; \"$flockform\" {command}; echo \"code $?\"");
        let said = on_a_small_disk("64k", &script);
        assert!(said.contains("code 1") && said.contains("No space left"), "{command}: {said}");
    }
}

#[test]
#[ignore = "mounts a small disk, which takes user namespaces"]
fn a_film_that_a_full_disk_has_no_room_for_is_not_there_and_the_results_are() {
    let script = "\"$flockform\" run tension -q --no-report --figures none --out o --film t.gif; \
                  echo \"code $?\"; test -s o/summary.json && echo kept; ls -A";
    let said = on_a_small_disk("200k", script);
    for word in ["No space left", "t.gif", "code 1", "kept\no\n"] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

#[test]
#[ignore = "mounts a small disk, which takes user namespaces"]
fn a_checkpoint_outlives_a_full_disk_and_the_run_goes_on_when_there_is_room() {
    let script = "\"$flockform\" run tension -q --out o --checkpoint-every 20steps --set record.vtk_every=1; \
                  echo \"code $?\"; test -s o.unfinished/checkpoint && echo kept; \
                  mount -o remount,size=64m \"$disk\"; \
                  \"$flockform\" run --resume o -q; echo \"then $?\"; test -s o/summary.json && echo done";
    let said = on_a_small_disk("2m", script);
    for word in ["No space left", "code 1", "kept", "then 0", "done"] {
        assert!(said.contains(word), "{word}: {said}");
    }
}
