//! The tension test: a square sample is clamped at its left side, pulled at its right one, and let come to rest.
//!
//! ```sh
//! cargo run --release --example tension
//! ```

use flockform::{Builder, LatticeKind, SceneError, Side};

fn main() -> Result<(), SceneError> {
    let outcome = Builder::new(LatticeKind::Square { spacing: 1.0 })
        .grid(30, 30)
        .clamp(Side::Left)
        .lead(Side::Right, [6.0, 0.0], 60)
        .run()?;
    let engine = &outcome.engine;
    println!("{} after {} steps", outcome.reason.name(), engine.step());
    // Column by column from the bottom: the row at half the height.
    for particle in (15..engine.body().count()).step_by(30) {
        let [x, y] = engine.displacement(particle);
        println!("particle {particle:>3} moved by ({x:6.3}, {y:6.3})");
    }
    Ok(())
}
