//! What the system says of a process, where it says anything.

/// Its word on a `key`, a number without its unit; `None` once the process has ended.
pub fn status(process: u32, key: &str) -> Option<String> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let value = status.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'))?;
    Some(value.split_whitespace().next()?.to_owned())
}
