//! What is left in shared memory and in iceoryx2's folders after a clean end, and whether two users get along.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::support::{domain_name, signal};
use crate::folders::temporary;

/// Files of a domain, wherever iceoryx2 keeps some.
fn files(prefix: &str) -> Vec<PathBuf> {
    let mut open = vec![PathBuf::from("/dev/shm"), PathBuf::from("/tmp/iceoryx2")];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(prefix) {
                found.push(entry.path());
            }
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                open.push(entry.path());
            }
        }
    }
    found
}

fn publish(folder: &Path, user: Option<&str>, domain: Option<&str>) -> Command {
    let run = ["run", "tension", "--publish", "here", "-q", "--no-report", "--figures", "none", "--out", "o"];
    let program = env!("CARGO_BIN_EXE_flockform");
    let mut command = match user {
        None => Command::new(program),
        Some(user) => {
            let mut command = Command::new("setpriv");
            let ids = [format!("--reuid={user}"), format!("--regid={user}"), "--clear-groups".to_owned()];
            command.args(ids).arg(program);
            command
        }
    };
    command.args(run).current_dir(folder).env_remove("FLOCKFORM_SHM_DOMAIN");
    if let Some(domain) = domain {
        command.env("FLOCKFORM_SHM_DOMAIN", domain);
    }
    command
}

#[test]
fn a_clean_end_leaves_nothing_behind() {
    let folder = temporary();
    let domain = domain_name();
    let output = publish(folder.path(), None, Some(&domain)).output().expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(files(&format!("{domain}_")), Vec::<PathBuf>::new());
}

/// Files of a domain as they are when their maker is killed while it makes them.
fn leave_unfinished(domain: &str) -> [PathBuf; 2] {
    let services = Path::new("/tmp/iceoryx2/services");
    std::fs::create_dir_all(services).expect("a folder");
    let files =
        [PathBuf::from(format!("/dev/shm/{domain}_a.dynamic")), services.join(format!("{domain}_a.service"))];
    for path in &files {
        let file = std::fs::File::create(path).expect("a file");
        file.set_permissions(Permissions::from_mode(0o600)).expect("ours");
        let before = std::time::SystemTime::now() - Duration::from_secs(10);
        file.set_modified(before).expect("ours");
    }
    files
}

#[test]
fn what_a_process_left_that_died_while_it_made_it_is_removed_or_named() {
    let publish_in =
        |domain: &str| publish(temporary().path(), None, Some(domain)).output().expect("the program starts");
    let domain = domain_name();
    leave_unfinished(&domain);
    let output = publish_in(&domain);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(files(&format!("{domain}_")), Vec::<PathBuf>::new());

    // What iceoryx2 knows to remove, it removes.
    let mut running = Command::new(env!("CARGO_BIN_EXE_flockform"))
        .args(["node", "square", "--transport", "shm"])
        .env("FLOCKFORM_SHM_DOMAIN", &domain)
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    super::support::until("it has begun", || (files(&format!("{domain}_")).len() > 20).then_some(()));
    running.kill().expect("it runs");
    running.wait().expect("it ends");
    let output = publish_in(&domain);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(files(&format!("{domain}_")), Vec::<PathBuf>::new());

    // A process that has them open may be about to finish them; others may live.
    let peer = super::support::domain(&domain).join("test").expect("shared memory");
    let left = leave_unfinished(&domain);
    let open = left.each_ref().map(|file| std::fs::File::open(file).expect("it is there"));
    let output = publish_in(&domain);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    let is_named = |file: &PathBuf| message.contains(&*file.to_string_lossy());
    assert!(left.iter().all(is_named) && message.contains("FLOCKFORM_SHM_DOMAIN"), "{message}");
    assert!(left.iter().all(|file| file.exists()));
    drop(open);
    let output = publish_in(&domain);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(left.iter().all(|file| !file.exists()));
    drop(peer);
}

#[test]
fn a_program_that_is_ended_while_it_opens_closes_in_order() {
    let programs = ["node", "robots"].map(|subcommand| {
        let domain = domain_name();
        // For this one, in which nodes are counted, it waits: its maker may live.
        std::fs::write(format!("/dev/shm/{domain}_ab_node.global_mgmt"), "").expect("written");
        let mut command = Command::new(env!("CARGO_BIN_EXE_flockform"));
        command.args([subcommand, "square", "--transport", "shm"]).env("FLOCKFORM_SHM_DOMAIN", &domain);
        (domain, command.stderr(Stdio::piped()).spawn().expect("the program starts"))
    });
    std::thread::sleep(Duration::from_secs(1));
    programs.iter().for_each(|(_, program)| signal("TERM", program.id()));
    for (domain, program) in programs {
        let ended = program.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
        assert_eq!(files(&format!("{domain}_")), Vec::<PathBuf>::new());
    }
}

/// Ends with its test.
struct Ends(Child);

impl Drop for Ends {
    fn drop(&mut self) {
        signal("INT", self.0.id());
        let _ = self.0.wait();
    }
}

#[test]
#[ignore = "becomes another user, which takes root"]
fn two_users_of_one_computer_both_run() {
    let own = Command::new(env!("CARGO_BIN_EXE_flockform"))
        .args(["robots", "square", "--transport", "shm"])
        .env_remove("FLOCKFORM_SHM_DOMAIN")
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let _own = Ends(own);
    let begun = Instant::now();
    while files("iox2_").is_empty() {
        assert!(begun.elapsed() < Duration::from_secs(30), "it never began");
        std::thread::sleep(Duration::from_millis(20));
    }
    let folder = temporary();
    let open = |folder: &Path, mode: u32| {
        std::fs::set_permissions(folder, Permissions::from_mode(mode)).expect("it is this user's");
    };
    open(folder.path(), 0o777);
    let of_another = || publish(folder.path(), Some("65534"), None).output().expect("setpriv is there");
    let output = of_another();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(files("u65534_"), Vec::<PathBuf>::new());
    // As a program leaves it that is not flockform.
    let services = Path::new("/tmp/iceoryx2/services");
    open(services, 0o750);
    let output = of_another();
    open(services, 0o1777);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("chmod 1777") && message.contains("/tmp/iceoryx2/services"), "{message}");
}
