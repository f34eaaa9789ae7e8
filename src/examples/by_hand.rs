//! A body stepped in real time, as in a game: one side is moved by hand and let go half-way, the rest follows, and the program never
//! waits for it to come to rest.
//!
//! ```sh
//! cargo run --release --example by_hand
//! ```

use std::time::{Duration, Instant};

use flockform::engine::setup::RoleChange;
use flockform::flock::role::Role;
use flockform::{Builder, LatticeKind, SceneError, Side};

/// Frames a second, and steps of the body in each: the more, the stiffer it looks.
const FRAMES: u32 = 60;
const STEPS_A_FRAME: usize = 10;
const SECONDS: u32 = 2;

fn main() -> Result<(), SceneError> {
    let (columns, rows) = (60, 20);
    let mut engine = Builder::new(LatticeKind::Hexagonal { spacing: 0.1 })
        .grid(columns, rows)
        .clamp(Side::Left)
        .clamp(Side::Right)
        .engine()?;
    let reference = engine.body().reference.clone();
    let edge = reference.x.iter().copied().fold(0.0, f64::max) - 0.1;
    let held: Vec<usize> = (0..reference.len()).filter(|&i| reference.x[i] > edge).collect();
    let frame = Duration::from_secs(1) / FRAMES;
    let mut busy = Duration::ZERO;
    for number in 1..=SECONDS * FRAMES {
        let begun = Instant::now();
        // Where a hand, or anything else, has the held side now.
        let time = f64::from(number) / f64::from(FRAMES);
        let by = [0.5 * time.sin(), (2.0 * time).sin()];
        if number < SECONDS * FRAMES / 2 {
            for &particle in &held {
                let [x, y] = reference.get(particle);
                engine.lead(particle, [x + by[0], y + by[1]]);
            }
        } else if number == SECONDS * FRAMES / 2 {
            engine.add_role_change(RoleChange::new(held.clone(), Role::Follower, engine.step() + 1));
        }
        engine.advance_steps(STEPS_A_FRAME);
        // Here a program draws `engine.present()`.
        busy += begun.elapsed();
        std::thread::sleep(frame.saturating_sub(begun.elapsed()));
    }
    let middle = reference.len() / 2;
    let [x, y] = engine.displacement(middle);
    println!(
        "{} particles, {} steps: the middle one moved by ({x:.3}, {y:.3})",
        reference.len(),
        engine.step()
    );
    println!(
        "{:.2} ms of {:.1} ms a frame",
        1e3 * busy.as_secs_f64() / f64::from(SECONDS * FRAMES),
        1e3 * frame.as_secs_f64()
    );
    Ok(())
}
