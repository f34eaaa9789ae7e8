//! The memory that is there, and bodies that are too large for it.

#[cfg(target_os = "linux")]
use std::alloc::{GlobalAlloc, Layout, System};
use std::fs::read_to_string;
use std::path::Path;

use flockform::continuum::memory::readable_bytes;
use flockform::continuum::plan::Plan;
use flockform::export::memory::Outputs;
use flockform::scene::{Scene, SceneError};

/// Memory that this process may still take, and what bounds it.
#[derive(Clone, Debug, PartialEq)]
struct Room {
    bytes: u64,
    bound: &'static str,
}

/// Bytes that the run of a plan takes at its largest. What this process took until the plan was made, the run takes too.
pub fn predicted(scene: &Scene, plan: &Plan, outputs: Outputs) -> usize {
    let running = flockform::export::memory::predicted(scene, plan, outputs, code());
    running.max(own("VmHWM:").unwrap_or(0) as usize)
}

/// Bytes that one of so many ranks, with this part of a body, takes at its largest, its tables among them, and what the first one
/// keeps for a report.
pub fn of_part(scene: &Scene, plan: &Plan, ranks: usize, report: bool) -> usize {
    flockform::export::memory::of_part(scene, plan, (ranks, report), code())
}

/// Bytes of the program's code so far; a guess where the system does not say.
fn code() -> usize {
    own("RssFile:").unwrap_or(16 << 20) as usize
}

/// A number of the status of this process \[B\].
fn own(name: &str) -> Option<u64> {
    Some(1024 * field(&read_to_string("/proc/self/status").ok()?, name)?)
}

/// Refuses a scene whose run takes more bytes than there are, so that no kernel has to end it on the way.
///
/// # Errors
/// Says how much is taken, and how much is there.
pub fn require(scene: &Scene, bytes: f64) -> Result<(), SceneError> {
    match room() {
        Some(room) if bytes > room.bytes as f64 => {
            let [asked, there] = [bytes as usize, room.bytes as usize].map(readable_bytes);
            let message = format!(
                "a run of it takes {asked} of memory or more, and {there} are there ({})",
                room.bound
            );
            Err(scene.refuse(
                "body",
                message,
                "use a larger `lattice.spacing`, a smaller body, or fewer `record.figures`",
            ))
        }
        _ => Ok(()),
    }
}

/// Has large arrays go back to the system when they are dropped. glibc keeps those that are smaller than one that was dropped
/// before, and what it keeps lies in pieces: an equilibrium of 432,000 particles took 12 % more at its largest. What solves
/// again and again is faster without.
pub fn return_what_is_dropped() {
    /// Bytes from which an array has pages of its own.
    #[cfg(all(feature = "ros", target_env = "gnu"))]
    const LARGE: libc::c_int = 1 << 17;
    // SAFETY: the call sets a number of the allocator; no other thread runs yet.
    #[cfg(all(feature = "ros", target_env = "gnu"))]
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
    }
}

/// The system's allocator, which asks for large pages where an array is as long as one of them: the system sets up a page when it is
/// first touched, and many give large ones only to what asks. A run of 1.1 million particles touches 176,000 pages for the first time
/// instead of 354,000 (`perf stat -e page-faults flockform run`, AMD EPYC, 26 November 2026).
#[cfg(target_os = "linux")]
pub struct LargePages;

#[cfg(target_os = "linux")]
impl LargePages {
    /// Bytes of a large page, and of the pages that a mapping begins with \[B\].
    const PAGES: [usize; 2] = [1 << 21, 1 << 12];

    fn asked(array: *mut u8, bytes: usize) -> *mut u8 {
        let [large, small] = Self::PAGES;
        if !array.is_null() && bytes >= large {
            // An array of a mapping of its own begins behind the few bytes that the allocator keeps there.
            let before = array.addr() % small;
            let page = array.wrapping_sub(before).cast();
            // SAFETY: these are pages of this process, whose contents the advice leaves; where a system has no large pages the
            // call fails and changes nothing.
            unsafe { libc::madvise(page, before + bytes, libc::MADV_HUGEPAGE) };
        }
        array
    }
}

// SAFETY: all is done by the system's allocator, on the same conditions.
#[cfg(target_os = "linux")]
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller's.
        Self::asked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller's.
        Self::asked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, array: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: as the caller's.
        Self::asked(unsafe { System.realloc(array, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, array: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(array, layout) }
    }
}

/// Gives back the memory of small arrays that were dropped, such as the frames of a small body.
pub fn return_what_is_free() {
    // SAFETY: the call asks nothing of its caller.
    #[cfg(all(feature = "ros", target_env = "gnu"))]
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Memory of this process that is in use \[B\]; 0 where the system does not say.
pub fn resident() -> u64 {
    own("VmRSS:").unwrap_or(0)
}

/// The least of the machine's, the control groups' and the process's own; `None` where the system says nothing.
fn room() -> Option<Room> {
    let machine = read_to_string("/proc/meminfo").ok().and_then(|text| field(&text, "MemAvailable:"));
    let machine = machine.map(|kilobytes| Room { bytes: 1024 * kilobytes, bound: "the machine's" });
    let groups = read_to_string("/proc/self/cgroup").ok().and_then(|text| of_groups(&text));
    let limit = read_to_string("/proc/self/limits").ok().and_then(|text| field(&text, "Max address space"));
    let taken = own("VmSize:").unwrap_or(0);
    let limit = limit.map(|limit| Room { bytes: limit.saturating_sub(taken), bound: "`ulimit -v`" });
    [machine, groups, limit].into_iter().flatten().min_by_key(|room| room.bytes)
}

/// The number behind a word of a text, if there is one.
fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The least room in the control groups that a process is in, as `/proc/self/cgroup` names them.
fn of_groups(text: &str) -> Option<Room> {
    let rooms = text.lines().filter_map(|line| {
        let [_, controllers, path] = <[&str; 3]>::try_from(line.splitn(3, ':').collect::<Vec<_>>()).ok()?;
        match controllers {
            "" => least_room("/sys/fs/cgroup", path, ["memory.max", "memory.current"]),
            "memory" => {
                least_room("/sys/fs/cgroup/memory", path, ["memory.limit_in_bytes", "memory.usage_in_bytes"])
            }
            _ => None,
        }
    });
    rooms.min().map(|bytes| Room { bytes, bound: "its control group's" })
}

/// The least room in a group and those around it; within a container its own group is the outermost one that it sees.
fn least_room(mount: &str, path: &str, [limit, usage]: [&str; 2]) -> Option<u64> {
    let groups = Path::new(path.trim_start_matches('/')).ancestors();
    let room = |group: &Path| {
        let group = Path::new(mount).join(group);
        let read = |file: &str| read_to_string(group.join(file)).ok();
        let number = |file: &str| read(file)?.trim().parse::<u64>().ok();
        // Files that are kept because there was room for them make way.
        let gives_way = read("memory.stat").and_then(|text| field(&text, "inactive_file ")).unwrap_or(0);
        Some(number(limit)?.saturating_sub(number(usage)?.saturating_sub(gives_way)))
    };
    groups.filter_map(room).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_behind_their_words() {
        let text = "MemTotal:       24576 kB\nMemAvailable:   1000 kB\nMax address space         unlimited  unlimited  bytes\n";
        assert_eq!(field(text, "MemAvailable:"), Some(1000));
        assert_eq!(field(text, "Max address space"), None);
        assert_eq!(field(text, "VmSize:"), None);
        assert_eq!(
            field("Max address space    4096000000  unlimited bytes", "Max address space"),
            Some(4_096_000_000)
        );
    }

    #[test]
    fn the_tightest_of_nested_groups_counts_and_files_in_it_give_way() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |group: &str, file: &str, text: &str| {
            let group = folder.path().join(group);
            std::fs::create_dir_all(&group).expect("a folder");
            std::fs::write(group.join(file), text).expect("written");
        };
        write("a/b", "memory.max", "max\n");
        write("a/b", "memory.current", "700\n");
        write("a", "memory.max", "5000\n");
        write("a", "memory.current", "3000\n");
        write("a", "memory.stat", "anon 1000\ninactive_file 500\n");
        let mount = folder.path().to_str().expect("plain");
        let files = ["memory.max", "memory.current"];
        assert_eq!(least_room(mount, "/a/b", files), Some(2500));
        write("a/b", "memory.max", "1000\n");
        assert_eq!(least_room(mount, "/a/b", files), Some(300));
        assert_eq!(least_room(mount, "/elsewhere", files), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn this_machine_has_some() {
        assert!(room().is_some_and(|room| room.bytes > 1 << 20));
    }
}
