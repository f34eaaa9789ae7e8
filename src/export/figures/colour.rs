//! Colours of roles, fields and lines.

use crate::flock::role::Role;

pub const BROKEN_BOND: &str = "#d0021b";
/// In a raster, where a broken bond is a dot like any other and must not pass for a leader.
pub const BROKEN_BOND_SQUARE: &str = "#111111";
pub const LIVE_BOND: &str = "#b8bcc2";

/// The paper's colours, with the clamped ones in a darker red than the leaders that move.
pub fn of_role(role: Role) -> &'static str {
    match role {
        Role::Follower => "#2060c0",
        Role::Leader => "#e8201c",
        Role::Clamped => "#7d0a0a",
        Role::Frame => "#ff9a1f",
        Role::Ghost => "#9aa0a6",
    }
}

/// Lines on white paper; the first six stay apart for colour-blind readers (Okabe and Ito).
pub const SERIES: [&str; 12] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#444444", "#8a5a2b", "#6a3d9a",
    "#a80042", "#7f8c1f", "#00a3a3",
];

/// The colour map viridis at every tenth.
const VIRIDIS: [u32; 11] = [
    0x440154, 0x482475, 0x414487, 0x355f8d, 0x2a788e, 0x21918c, 0x22a884, 0x44bf70, 0x7ad151, 0xbddf26,
    0xfde725,
];

/// The diverging colour map of K. Moreland (Advances in Visual Computing, LNCS 5876, 2009) at every eighth.
const BLUE_TO_RED: [u32; 9] =
    [0x3b4cc0, 0x6282ea, 0x8db0fe, 0xb8d0f9, 0xdddddd, 0xf5c4ad, 0xf49a7b, 0xde604d, 0xb40426];

/// Viridis, perceptually uniform, at `fraction` of its way from dark to bright.
pub fn viridis(fraction: f64) -> String {
    along(&VIRIDIS, fraction)
}

/// From blue over grey, at half of the way, to red.
pub fn blue_to_red(fraction: f64) -> String {
    along(&BLUE_TO_RED, fraction)
}

/// The colour at `fraction` of the way along a map.
fn along(map: &[u32], fraction: f64) -> String {
    let last = map.len() - 1;
    let place = fraction.clamp(0.0, 1.0) * last as f64;
    let below = (place as usize).min(last - 1);
    let part = place - below as f64;
    let mix = |channel: usize| {
        let value = |colour: u32| f64::from(colour.to_be_bytes()[1 + channel]);
        let [from, to] = [map[below], map[below + 1]].map(value);
        (from + part * (to - from)).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viridis_runs_from_dark_violet_to_yellow() {
        assert_eq!([viridis(0.0), viridis(0.5), viridis(1.0)], ["#440154", "#21918c", "#fde725"]);
        assert_eq!(viridis(0.05), "#461365");
        assert_eq!([0.0, 0.5, 1.0].map(blue_to_red), ["#3b4cc0", "#dddddd", "#b40426"]);
    }
}
