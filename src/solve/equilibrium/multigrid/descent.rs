//! Which coarser grid comes after a grid, and when one is coarse enough.

use super::transfer::Transfer;

/// How much coarser the first grid is than the lattice, in particles per node.
const FIRST_RATIO: f64 = 4.0;

/// Most columns, and rows, to a node.
pub const MOST_STEPS: usize = 8;

/// Nodes of the coarsest level: fewer are not worth another level.
const COARSEST: usize = 640;

/// Nodes across a slender body below which it is not coarsened further: fewer could not bend. Along it
/// the factor only grows with its length.
const ACROSS: i32 = 5;

/// The way down from a body's particles, as far as it has been gone.
pub struct Descent {
    /// Vectors from a particle's site to that of the next column and of the next row \[length\].
    grid: [[f64; 2]; 2],
    /// Columns, and rows, of the body's sites from one node to the next.
    steps: [i32; 2],
    is_finest: bool,
}

impl Descent {
    pub fn new(grid: [[f64; 2]; 2]) -> Self {
        Self { grid, steps: [1; 2], is_finest: true }
    }

    /// The way to the next level; `None` where one of so many nodes, in as many columns and rows, is to be solved outright.
    pub fn next(
        &self,
        (count, extent): (usize, [i32; 2]),
        particles_per_site: impl FnOnce() -> f64,
    ) -> Option<Transfer> {
        let is_slender = extent.iter().any(|&nodes| nodes <= ACROSS);
        if count <= COARSEST || (!self.is_finest && is_slender) {
            return None;
        }
        let of_sites = spacing_of(self.grid);
        let spacing = [0, 1].map(|k| of_sites[k] * f64::from(self.steps[k]));
        let steps =
            if self.is_finest { first_steps(spacing, particles_per_site()) } else { next_steps(spacing) };
        Some(Transfer { steps })
    }

    /// Goes down one level.
    pub fn go(&mut self, transfer: Transfer) {
        self.steps = [0, 1].map(|k| self.steps[k] * transfer.steps[k]);
        self.is_finest = false;
    }
}

/// How far apart columns, and rows, are \[length\].
pub fn spacing_of(grid: [[f64; 2]; 2]) -> [f64; 2] {
    grid.map(|v| v[0].hypot(v[1]))
}

/// Columns and rows to a node of the first coarse grid: about four particles each, the nodes about as far
/// apart both ways. Columns and rows are `spacing` apart \[length\].
pub fn first_steps(spacing: [f64; 2], particles_per_site: f64) -> [i32; 2] {
    let cost = |[i, j]: [i32; 2]| {
        let ratio = f64::from(i * j) * particles_per_site / FIRST_RATIO;
        let aspect = f64::from(i) * spacing[0] / (f64::from(j) * spacing[1]);
        // A grid that is too coarse costs iterations, one that is too fine costs memory.
        ratio.ln().abs() + 1.5 * aspect.ln().abs()
    };
    let most = MOST_STEPS as i32;
    let all = (1..=most).flat_map(|i| (1..=most).map(move |j| [i, j]));
    let coarser = all.filter(|&[i, j]| i * j > 1);
    coarser.min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or([2, 2])
}

/// Columns and rows to a node of the next coarser grid: two each way, but only along the denser direction
/// where nodes lie farther apart along the other. `spacing` is that of the present nodes \[length\].
pub fn next_steps(spacing: [f64; 2]) -> [i32; 2] {
    let aspect = spacing[0] / spacing[1];
    if aspect > 1.6 {
        [1, 2]
    } else if aspect < 1.0 / 1.6 {
        [2, 1]
    } else {
        [2, 2]
    }
}
