//! How the service `~/set_formation` moves the leaders.

use crate::flock::manoeuvre::{Leg, Manoeuvre, Posture};
use crate::ros::messages::flockform_msgs::{LoopEvent, SetFormationRequest};
use crate::swarm::control::Control;

/// A request that was granted, for a tape.
pub fn as_event(request: &SetFormationRequest) -> (u8, String, Vec<f64>) {
    if !request.name.is_empty() {
        return (LoopEvent::MANOEUVRE, request.name.clone(), Vec::new());
    }
    let SetFormationRequest { translate, rotate, stretch, shear, duration, .. } = *request;
    let values = [translate[0], translate[1], rotate, stretch[0], stretch[1], shear[0], shear[1], duration];
    (LoopEvent::POSTURE, String::new(), values.to_vec())
}

/// Moves the leaders, as the service asks for it.
///
/// # Errors
/// Why they do not move.
pub fn set_formation(control: &mut Control, request: &SetFormationRequest) -> Result<String, String> {
    if !control.formation().is_led_here() {
        return Err("the leaders are moved by a scene's program".into());
    }
    let time = control.program_time();
    if !request.name.is_empty() {
        let manoeuvre = control.formation().manoeuvre(&request.name, time);
        let manoeuvre = manoeuvre.ok_or_else(|| {
            let known: Vec<&str> =
                control.formation().manoeuvres.iter().map(|manoeuvre| manoeuvre.name.as_str()).collect();
            format!("there is no manoeuvre `{}`; there are: {}", request.name, known.join(", "))
        })?;
        control.begin(&manoeuvre);
        return Ok(format!("manoeuvre `{}`, {} s", request.name, manoeuvre.duration()));
    }
    let SetFormationRequest { translate, rotate, stretch, shear, duration, .. } = *request;
    let numbers = [translate[0], translate[1], rotate, stretch[0], stretch[1], shear[0], shear[1], duration];
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err("a number is not finite".into());
    }
    if duration <= 0.0 {
        return Err(format!("duration = {duration} s: give a positive one"));
    }
    if stretch[0] * stretch[1] == shear[0] * shear[1] {
        return Err("stretch and shear would bring everybody onto one line or point".into());
    }
    let about = control.formation().middle();
    let posture = Posture { translate, rotate, stretch, shear };
    let from = control.formation().posture(about, time);
    let leg = Leg { seconds: duration, hold: 0.0, posture };
    control.begin(&Manoeuvre { about, from, legs: vec![leg] });
    Ok(format!("under way for {duration} s"))
}
