//! How the service `~/set_formation` moves the leaders.

use crate::flock::manoeuvre::{Leg, Manoeuvre, Posture};
use crate::flock::vectors::distance;
use crate::messages::flockform_msgs::{LoopEvent, SetFormationRequest};
use crate::messages::said;
use crate::swarm::control::Control;

/// A request that was granted, for a recorder.
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
            format!("there is no manoeuvre `{}`; there are: {}", said(&request.name), known.join(", "))
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
        return Err("stretch and shear would collapse the formation onto one line or point".into());
    }
    let about = control.formation().middle();
    let posture = Posture { translate, rotate, stretch, shear };
    let from = control.formation().posture(about, time);
    let leg = Leg { seconds: duration, hold: 0.0, posture };
    let manoeuvre = Manoeuvre { about, from, legs: vec![leg] };
    check_flyable(control, &manoeuvre)?;
    control.begin(&manoeuvre);
    Ok(format!("under way for {duration} s"))
}

/// Moments of a manoeuvre that are looked at.
const LOOKS: usize = 64;

/// Refuses a manoeuvre that no robot within the limits can follow, or that leads out of the range of accepted poses:
/// the filter would hold the robots back while the leaders' program goes on without them.
fn check_flyable(control: &Control, manoeuvre: &Manoeuvre) -> Result<(), String> {
    let (limits, formation, watch) = (control.limits(), control.formation(), control.watch().limits());
    let duration = manoeuvre.duration();
    let step = duration / LOOKS as f64;
    let maps: Vec<_> = (0..=LOOKS).map(|k| manoeuvre.affine(k as f64 * step)).collect();
    let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
    for (place, &radius) in formation.places.iter().zip(&formation.radii) {
        let way: Vec<[f64; 2]> = maps.iter().map(|map| map.apply(place)).collect();
        for &there in &way {
            let away = distance(there, watch.centre);
            if away.is_nan() || away > watch.range {
                return Err(format!(
                    "it leads {away:.3e} m from the centre: poses.range allows {} m",
                    watch.range
                ));
            }
            if !control.filter().is_fenced_in(there, radius) {
                let [x, y] = there;
                return Err(format!(
                    "it leads a robot to ({x:.3}, {y:.3}), which is not inside the geofence"
                ));
            }
        }
        speed = way.windows(2).map(|two| distance(two[0], two[1]) / step).fold(speed, f64::max);
        let bend = |w: &[[f64; 2]]| {
            f64::hypot(w[2][0] - 2.0 * w[1][0] + w[0][0], w[2][1] - 2.0 * w[1][1] + w[0][1]) / (step * step)
        };
        acceleration = way.windows(3).map(bend).fold(acceleration, f64::max);
    }
    let slower = f64::max(speed / limits.speed, (acceleration / limits.acceleration).sqrt());
    // To the rounding of the looks.
    if slower > 1.0 + 1e-6 {
        return Err(format!(
            "it asks for {speed:.3} m/s and {acceleration:.3} m/s^2, the limits are {} and {}: give a duration of \
             at least {:.2} s",
            limits.speed,
            limits.acceleration,
            duration * slower + 0.005
        ));
    }
    Ok(())
}
