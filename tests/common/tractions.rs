//! Tractions along the sides of cells.

use flockform::flock::vectors::{Vectors, distance};

/// The force on each particle \[force\]: each side with its traction at either end \[force / length\], linear between.
pub fn forces(reference: &Vectors, sides: impl IntoIterator<Item = ([u32; 2], [[f64; 2]; 2])>) -> Vectors {
    let mut forces = Vectors::zeros(reference.len());
    for (ends, [at_a, at_b]) in sides {
        let [a, b] = ends.map(|i| i as usize);
        let length = distance(reference.get(a), reference.get(b));
        for (i, near, far) in [(a, at_a, at_b), (b, at_b, at_a)] {
            forces.x[i] += length * (2.0 * near[0] + far[0]) / 6.0;
            forces.y[i] += length * (2.0 * near[1] + far[1]) / 6.0;
        }
    }
    forces
}
