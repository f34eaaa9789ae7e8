//! The memory that is there, and bodies that are too large for it.

#[cfg(target_os = "linux")]
use std::alloc::{GlobalAlloc, Layout, System};
use std::fs::read_to_string;
use std::path::Path;

use flockform::continuum::memory::{field, own, readable_bytes};
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

/// Bytes that one of so many ranks, with this part of a body, takes at its largest for these outputs, if it is the one that `writes` or
/// another.
pub fn of_part(scene: &Scene, plan: &Plan, ranks: usize, (outputs, writes): (Outputs, bool)) -> usize {
    flockform::export::memory::of_part(scene, plan, (ranks, outputs, writes), code())
}

/// Bytes of the program's code so far; a guess where the system does not say.
fn code() -> usize {
    own("RssFile:").unwrap_or(16 << 20) as usize
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

/// Bytes from which an array is large, and has pages of its own \[B\].
#[cfg(target_os = "linux")]
const LARGE: usize = 1 << 17;

/// Has large arrays go back to the system when they are dropped. glibc keeps those that are smaller than one that was dropped
/// before, and what it keeps lies in pieces: an equilibrium of 432,000 particles took 12 % more at its largest. What solves
/// again and again is faster without.
pub fn return_what_is_dropped() {
    // SAFETY: the call sets a number of the allocator; no other thread runs yet.
    #[cfg(target_env = "gnu")]
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE as libc::c_int);
    }
}

/// The system's allocator, but for large arrays: they begin at a line of the caches, and for those as long as a large page it asks for
/// large pages: the system sets up a page when it is first touched, and many give large ones only to what asks. A run of
/// 1.1 million particles touches 176,000 pages for the first time instead of 354,000 (`perf stat -e page-faults flockform run`, AMD
/// EPYC, 26 November 2026).
#[cfg(target_os = "linux")]
pub struct ArrayAllocator;

#[cfg(target_os = "linux")]
impl ArrayAllocator {
    /// Bytes of a large page, and of a page \[B\].
    const PAGES: [usize; 2] = [1 << 21, 1 << 12];

    /// Bytes of a line of the caches \[B\]. A sweep stores whole lines, and reads across two where what it reads begins elsewhere in a
    /// line: with arrays that begin with one, bodies of 256 and 1024 squared are swept 1.3 and 1.4 times as fast (16 steps together,
    /// one thread, alternated, Intel Xeon with AVX-512, 28 November 2026). Smaller arrays lie together in pages, where what is
    /// left in front of a line stays in pieces: the frames of a body of 1,252 particles took 3 MB more.
    const LINE: usize = 64;

    /// Whether it is an array, which the C library's own functions serve here.
    fn is_array(layout: Layout) -> bool {
        layout.size() >= LARGE && layout.align() <= align_of::<libc::max_align_t>()
    }

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

// SAFETY: arrays are made, moved and freed by the C library, all else by the system's allocator: of a layout by the same always.
#[cfg(target_os = "linux")]
unsafe impl GlobalAlloc for ArrayAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !Self::is_array(layout) {
            // SAFETY: as the caller's.
            return unsafe { System.alloc(layout) };
        }
        let mut array = std::ptr::null_mut();
        // SAFETY: a line is a power of two and a multiple of a pointer's size; where the call fails `array` stays null.
        unsafe { libc::posix_memalign(&raw mut array, Self::LINE, layout.size()) };
        Self::asked(array.cast(), layout.size())
    }

    /// Zeroed arrays begin where they may: the system gives their pages as they are touched, and to align them would touch them.
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if !Self::is_array(layout) {
            // SAFETY: as the caller's.
            return unsafe { System.alloc_zeroed(layout) };
        }
        // SAFETY: the call asks nothing of its caller.
        Self::asked(unsafe { libc::calloc(1, layout.size()) }.cast(), layout.size())
    }

    unsafe fn realloc(&self, array: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: the caller's: `bytes`, rounded up to the alignment, is at most what an `isize` holds.
        let next = unsafe { Layout::from_size_align_unchecked(bytes, layout.align()) };
        match [layout, next].map(Self::is_array) {
            // SAFETY: as the caller's.
            [false, false] => unsafe { System.realloc(array, layout, bytes) },
            // SAFETY: the C library made the array.
            [true, true] => Self::asked(unsafe { libc::realloc(array.cast(), bytes) }.cast(), bytes),
            _ => {
                // SAFETY: as the caller's, for a new array; the old one and the new one are apart, and hold what is copied.
                unsafe {
                    let moved = self.alloc(next);
                    if !moved.is_null() {
                        std::ptr::copy_nonoverlapping(array, moved, bytes.min(layout.size()));
                        self.dealloc(array, layout);
                    }
                    moved
                }
            }
        }
    }

    unsafe fn dealloc(&self, array: *mut u8, layout: Layout) {
        if Self::is_array(layout) {
            // SAFETY: the C library made the array.
            unsafe { libc::free(array.cast()) };
        } else {
            // SAFETY: as the caller's.
            unsafe { System.dealloc(array, layout) };
        }
    }
}

/// Gives back the memory of small arrays that were dropped, such as the frames of a small body.
pub fn return_what_is_free() {
    // SAFETY: the call asks nothing of its caller.
    #[cfg(target_env = "gnu")]
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

    #[cfg(target_os = "linux")]
    #[test]
    fn arrays_begin_at_a_line_of_the_caches_and_hold_what_was_in_them_whatever_becomes_of_their_size() {
        let alloc = ArrayAllocator;
        let layout = |bytes| Layout::from_size_align(bytes, 8).expect("small");
        let sizes = [24, LARGE - 8, LARGE, 170_000, 3 << 20, LARGE + 8, 40, 5 << 20, LARGE, 8];
        // SAFETY: each array is made, written, read, moved and freed with the layout that it has.
        unsafe {
            for zeroed in [false, true] {
                let mut array = if zeroed { alloc.alloc_zeroed(layout(8)) } else { alloc.alloc(layout(8)) };
                array.write(7);
                let mut before = 8;
                for bytes in sizes {
                    let made = alloc.alloc(layout(bytes));
                    assert!(bytes < LARGE || made.addr().is_multiple_of(64), "{bytes}");
                    alloc.dealloc(made, layout(bytes));
                    let made = alloc.alloc_zeroed(layout(bytes));
                    assert_eq!((made.read(), made.add(bytes - 1).read()), (0, 0));
                    alloc.dealloc(made, layout(bytes));
                    array = alloc.realloc(array, layout(before), bytes);
                    assert_eq!((array.read(), array.addr() % 8), (7, 0), "{before} to {bytes}");
                    array.add(bytes - 1).write(9);
                    before = bytes;
                }
                alloc.dealloc(array, layout(before));
            }
        }
    }

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
