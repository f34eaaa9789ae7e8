//! Loopback without multicast: the trap of many robots on one computer.

/// Says what to do if nothing of this computer that may be used carries multicast, once per process.
///
/// Participants then find each other only by asking the first few ports of the domain, so of more than
/// about a dozen participants some stay unseen, without any error. Over a network device they find each other as they
/// find those of other computers.
pub(crate) fn warn_without_multicast(loopback_only: bool) {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let devices = std::fs::read_dir("/sys/class/net").into_iter().flatten().flatten();
        let usable = devices.filter(|device| !loopback_only || device.file_name() == "lo");
        let flags: Vec<String> =
            usable.filter_map(|device| std::fs::read_to_string(device.path().join("flags")).ok()).collect();
        let known: Vec<bool> = flags.iter().filter_map(|flags| carries_multicast(flags)).collect();
        if !known.is_empty() && !known.contains(&true) {
            tracing::warn!(
                "the loopback device carries no multicast: at most 12 processes per ROS_DOMAIN_ID find each \
                 other on this computer. Remedy: ip link set lo multicast on && ip route add 239.0.0.0/8 dev \
                 lo, or many robots in one process"
            );
        }
    });
}

/// Whether a device with these flags, as Linux prints them (`0x1009`), is up and carries multicast; `None` where it
/// cannot be known.
fn carries_multicast(flags: &str) -> Option<bool> {
    const UP_AND_MULTICAST: u32 = 0x1001;
    let digits = flags.trim().strip_prefix("0x")?;
    Some(u32::from_str_radix(digits, 16).ok()? & UP_AND_MULTICAST == UP_AND_MULTICAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_is_up_and_has_the_multicast_bit_carries_it() {
        assert_eq!(carries_multicast("0x9\n"), Some(false));
        assert_eq!(carries_multicast("0x1009\n"), Some(true));
        assert_eq!(carries_multicast("0x1002\n"), Some(false), "down");
        assert_eq!(carries_multicast("0x1003\n"), Some(true), "an ordinary network device");
        assert_eq!(carries_multicast("nonsense"), None);
    }
}
