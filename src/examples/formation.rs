//! A formation's targets: poses of robots go in, safe places to go to come out, once in a period. Where the poses come from, and
//! what moves the robots, is up to the program.
//!
//! ```sh
//! cargo run --release --example formation
//! ```

use flockform::SceneError;
use flockform::scene::bundled::bundled_swarm;
use flockform::swarm::control::Control;
use flockform::swarm::watch::Pose;

fn main() -> Result<(), SceneError> {
    let swarm = bundled_swarm("square").expect("a bundled swarm").load_swarm(&[])?;
    let mut control = Control::new(&swarm)?;
    let members = control.formation().count();
    // Ideal robots: each is at its target one period later.
    let mut places: Vec<[f64; 2]> = (0..members).map(|member| control.wanted(member)).collect();
    // The corners are led by the manoeuvre of the swarm file: three legs, each followed by a hold.
    let periods = swarm.raw.flight.duration.unwrap_or(60.0) / control.period();
    for period in 0..periods.round() as u32 {
        let now = f64::from(period) * control.period();
        for (member, &position) in places.iter().enumerate() {
            let pose = Pose { position, yaw: 0.0, stamp: now, frame_is_right: true };
            if let Err(rejection) = control.receive(member, pose, now) {
                println!("{now:.2} s: the pose of {member} is rejected: {rejection:?}");
            }
        }
        control.tick(now);
        for (member, place) in places.iter_mut().enumerate() {
            *place = control.target(member).unwrap_or(*place);
        }
        if period % 100 == 99 {
            let error = control.formation_error().unwrap_or_default();
            println!(
                "{now:5.2} s: the last of {members} robots has {error:.3} m to go to its place in the formation"
            );
        }
    }
    Ok(())
}
