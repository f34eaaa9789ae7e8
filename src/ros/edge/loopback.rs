//! Loopback without multicast: the trap of many robots on one computer.

/// Says what to do if this computer's loopback device carries no multicast, once per process.
///
/// Participants then find each other only by asking the first few ports of the domain, so of more than
/// about a dozen participants some stay unseen, without any error.
pub fn warn_without_multicast() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        if carries_multicast(std::fs::read_to_string("/sys/class/net/lo/flags").ok().as_deref())
            == Some(false)
        {
            tracing::warn!(
                "the loopback device carries no multicast: at most 12 processes per ROS_DOMAIN_ID find each \
                 other on this computer. Remedy: ip link set lo multicast on && ip route add 239.0.0.0/8 dev \
                 lo, or many robots in one process"
            );
        }
    });
}

/// Whether device flags as Linux prints them (`0x1009`) hold the multicast bit; `None` where it cannot be
/// known.
pub fn carries_multicast(flags: Option<&str>) -> Option<bool> {
    const MULTICAST: u32 = 0x1000;
    let digits = flags?.trim().strip_prefix("0x")?;
    Some(u32::from_str_radix(digits, 16).ok()? & MULTICAST != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_multicast_bit_is_read_from_device_flags() {
        assert_eq!(carries_multicast(Some("0x9\n")), Some(false));
        assert_eq!(carries_multicast(Some("0x1009\n")), Some(true));
        assert_eq!(carries_multicast(Some("nonsense")), None);
        assert_eq!(carries_multicast(None), None);
    }
}
