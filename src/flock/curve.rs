//! An order in which particles that are near each other have numbers near each other.

use super::points::Points;

/// Cells along each side of the square the curve fills.
const CELLS: u32 = 1 << 16;

/// The indices of the points in the order in which a Hilbert curve through their bounds meets them; points of one
/// cell keep their order. Neighbours that lie together in space then lie together in memory, which is what a
/// sweep over index lists lives on.
///
/// Source: D. Hilbert, *Ueber die stetige Abbildung einer Linie auf ein Flaechenstueck*, 1891.
pub fn order_along_curve(points: &Points) -> Vec<u32> {
    let Some((low, high)) = points.bounds(0..points.len()) else { return Vec::new() };
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    // One point, or all in one place: any scale will do.
    let scale = if size > 0.0 { f64::from(CELLS - 1) / size } else { 0.0 };
    let cell = |value: f64, low: f64| ((value - low) * scale) as u32;
    let mut order: Vec<(u64, u32)> =
        points.iter().zip(0..).map(|([x, y], i)| (place(cell(x, low[0]), cell(y, low[1])), i)).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}

/// How far along the curve a cell lies.
fn place(mut x: u32, mut y: u32) -> u64 {
    let mut along = 0;
    let mut side = CELLS / 2;
    while side > 0 {
        let (right, upper) = (u32::from(x & side > 0), u32::from(y & side > 0));
        along = 4 * along + u64::from((3 * right) ^ upper);
        // Each quarter holds the curve of half the size, turned so that the ends meet.
        if upper == 0 {
            if right == 1 {
                (x, y) = (CELLS - 1 - x, CELLS - 1 - y);
            }
            (x, y) = (y, x);
        }
        side /= 2;
    }
    along
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_from_each_point_of_a_lattice_to_one_beside_it() {
        let points: Points = (0..64 * 64).map(|i| [f64::from(i % 64), f64::from(i / 64)]).collect();
        let order = order_along_curve(&points);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..64 * 64), "each once");
        for pair in order.windows(2) {
            let [a, b] = [points.get(pair[0] as usize), points.get(pair[1] as usize)];
            let apart = (a[0] - b[0]).abs() + (a[1] - b[1]).abs();
            assert_eq!(apart, 1.0, "{a:?} {b:?}");
        }
    }

    #[test]
    fn points_in_one_place_keep_their_order() {
        let points: Points = [[2.0, 3.0]; 5].into_iter().collect();
        assert_eq!(order_along_curve(&points), [0, 1, 2, 3, 4]);
        assert!(order_along_curve(&Points::default()).is_empty());
    }
}
