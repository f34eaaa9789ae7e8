//! Files that ranks write together, each its own, into the folder of the first one.

use std::ffi::OsString;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

use super::error::ExportError;
use crate::ranks::Team;

/// Has each rank write the file of its name into the `folder`, which the first rank has and all must see. What one of them
/// cannot write is an error of all.
pub(super) fn write_each<T>(
    folder: Option<&Path>,
    name: impl Fn(usize) -> String,
    team: &Team,
    write: impl FnOnce(&Path) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    let own = folder.map_or(&b""[..], |folder| folder.as_os_str().as_encoded_bytes());
    let first = team.each_bytes(own).swap_remove(0);
    let folder = PathBuf::from(OsString::from_vec(first));
    let written = write(&folder.join(name(team.rank())));
    let failed = team.each([u64::from(written.is_err())]).iter().position(|&[failed]| failed == 1);
    match failed {
        Some(rank) if rank != team.rank() => Err(ExportError::OnRank { rank, path: folder.join(name(rank)) }),
        _ => written,
    }
}
