//! Tables of particles.

use std::fmt::Display;

/// The same jumble each time.
pub fn shuffled<T: Clone>(values: &[T], mut seed: u64) -> Vec<T> {
    let mut values = values.to_vec();
    for i in (1..values.len()).rev() {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        values.swap(i, (seed >> 33) as usize % (i + 1));
    }
    values
}

/// As CSV, to the last digit.
pub fn table(rows: &[(impl Display, [f64; 2])]) -> String {
    let rows = rows.iter().map(|(id, [x, y])| format!("{id},{x:?},{y:?}\n"));
    std::iter::once("id,x,y\n".to_owned()).chain(rows).collect()
}
