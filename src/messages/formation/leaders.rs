//! How the service `~/set_formation` moves the leaders.

use std::f64::consts::TAU;

use crate::flock::manoeuvre::{Affine, Demand, Leg, Manoeuvre, Posture};
use crate::flock::vectors::distance;
use crate::messages::flockform_msgs::{LoopEvent, SetFormationRequest};
use crate::messages::said;
use crate::scene::text::{decimals, number};
use crate::swarm::control::Control;

/// A request that was granted, for a recorder.
pub fn as_event(request: &SetFormationRequest) -> (u8, String, Vec<f64>) {
    if !request.name.is_empty() {
        return (LoopEvent::MANOEUVRE, request.name.clone(), Vec::new());
    }
    (LoopEvent::POSTURE, String::new(), numbers(request).to_vec())
}

fn numbers(request: &SetFormationRequest) -> [f64; 8] {
    let SetFormationRequest { translate: [tx, ty], rotate, stretch, shear, duration, .. } = *request;
    [tx, ty, rotate, stretch[0], stretch[1], shear[0], shear[1], duration]
}

/// Moves the leaders, as the service asks for it.
///
/// # Errors
/// Why they do not move.
pub fn set_formation(control: &mut Control, request: &SetFormationRequest) -> Result<String, String> {
    let manoeuvre = requested(control, request)?;
    // What the file's own leaders fly is planned with cautions; it is not checked here.
    let is_named = !request.name.is_empty();
    let remedy = if is_named { "its legs would have to take" } else { "give a duration of" };
    check_flyable(control, &manoeuvre, remedy)?;
    control.begin(&manoeuvre);
    let duration = number(manoeuvre.duration());
    Ok(match is_named {
        true => format!("manoeuvre `{}`, {duration} s", request.name),
        false => format!("under way for {duration} s"),
    })
}

/// The manoeuvre that the service is asked for, whether it can be flown or not.
///
/// # Errors
/// Why it is none.
pub(crate) fn requested(control: &Control, request: &SetFormationRequest) -> Result<Manoeuvre, String> {
    if !control.formation().is_led_here() {
        return Err("the leaders are moved by a scene's program".into());
    }
    let time = control.program_time();
    if !request.name.is_empty() {
        return control.formation().manoeuvre(&request.name, time).ok_or_else(|| {
            let known: Vec<&str> =
                control.formation().manoeuvres.iter().map(|manoeuvre| manoeuvre.name.as_str()).collect();
            format!("there is no manoeuvre `{}`; there are: {}", said(&request.name), known.join(", "))
        });
    }
    let SetFormationRequest { translate, rotate, stretch, shear, duration, .. } = *request;
    if !numbers(request).iter().all(|number| number.is_finite()) {
        return Err("a number is not finite".into());
    }
    if duration <= 0.0 {
        return Err(format!("duration = {} s: give a positive one", number(duration)));
    }
    let about = control.formation().middle();
    let posture = Posture { translate, rotate, stretch, shear };
    let from = control.formation().posture(about, time);
    if collapses(&from, &posture) {
        return Err(
            "stretch and shear would collapse the formation onto one line or point, there or on the way"
                .into(),
        );
    }
    let leg = Leg { seconds: duration, hold: 0.0, posture };
    Ok(Manoeuvre { about, from, legs: vec![leg] })
}

/// Whether a formation that goes evenly from one posture to another has no area at some moment after the first.
fn collapses(from: &Posture, to: &Posture) -> bool {
    let between = |share: f64| {
        let part = |from: f64, to: f64| from + share * (to - from);
        let [x, y] = [0, 1].map(|k| part(from.stretch[k], to.stretch[k]));
        let [right, up] = [0, 1].map(|k| part(from.shear[k], to.shear[k]));
        x * y - right * up
    };
    // It is a quadratic of the share: of one sign if it is so at both ends and where it turns.
    let [begin, middle, end] = [0.0, 0.5, 1.0].map(between);
    // What overflows leads out of all range, which is refused as such.
    if !(begin.is_finite() && end.is_finite()) {
        return false;
    }
    let bend = 2.0 * (begin - 2.0 * middle + end);
    let turn = (begin - end + bend) / (2.0 * bend);
    let turn = if (0.0..=1.0).contains(&turn) { between(turn) } else { end };
    // A share of rounding.
    let least = 1e-12 * end.abs().min(begin.abs());
    [turn, end].iter().any(|area| area.abs() <= least || area.signum() != begin.signum())
}

/// Moments of a leg whose places are looked at.
const LOOKS: u32 = 64;

/// Angle between two looks at a turn \[rad\].
const PART: f64 = 0.1;

/// Where the formation comes in a leg that begins so late \[s\]. Between two moments it may turn far, past what it passes at
/// neither; of several rounds one is looked at.
fn passed(manoeuvre: &Manoeuvre, leg: &Leg, begun: f64) -> Vec<Affine> {
    let posture = |k: u32| manoeuvre.posture(begun + leg.seconds * f64::from(k) / f64::from(LOOKS));
    let between = |k: u32| {
        let (here, next) = (posture(k), posture((k + 1).min(LOOKS)));
        let turn = (next.rotate - here.rotate).clamp(-TAU, TAU);
        let looks = (turn.abs() / PART).ceil().max(1.0);
        (0..looks as u32)
            .map(move |n| Posture { rotate: here.rotate % TAU + turn * f64::from(n) / looks, ..here })
            .map(|posture| posture.affine(manoeuvre.about))
    };
    (0..=LOOKS).flat_map(between).collect()
}

/// Refuses a manoeuvre that no robot within the limits can follow, or that leads out of the range of accepted poses:
/// the filter would hold the robots back while the leaders' program goes on without them.
fn check_flyable(control: &Control, manoeuvre: &Manoeuvre, remedy: &str) -> Result<(), String> {
    let (limits, formation, watch) = (control.limits(), control.formation(), control.watch().limits());
    let mut begun = 0.0;
    let mut maps = Vec::new();
    for leg in &manoeuvre.legs {
        maps.extend(passed(manoeuvre, leg, begun));
        begun += leg.seconds + leg.hold;
    }
    for (place, &radius) in formation.places.iter().zip(&formation.radii) {
        for there in maps.iter().map(|map| map.apply(place)) {
            let away = distance(there, watch.centre);
            if away.is_nan() || away > watch.range {
                return Err(format!(
                    "it leads {away:.3e} m from the centre: poses.range allows {} m",
                    number(watch.range)
                ));
            }
            if !control.filter().is_fenced_in(there, radius) {
                let [x, y] = there;
                return Err(format!(
                    "it leads a robot to ({x:.3}, {y:.3}), which is not inside the geofence"
                ));
            }
        }
    }
    let Demand { speed, acceleration } = manoeuvre.demand(&formation.places);
    let slower = f64::max(speed / limits.speed, (acceleration / limits.acceleration).sqrt());
    // To rounding.
    if slower > 1.0 + 1e-6 {
        return Err(format!(
            "it asks for {} m/s and {} m/s^2, the limits are {} and {}: {remedy} at least {} s",
            decimals(speed, 3),
            decimals(acceleration, 3),
            limits.speed,
            limits.acceleration,
            decimals(manoeuvre.duration() * slower + 0.005, 2)
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::examples::{bundled, parsed};

    #[test]
    fn manoeuvres_of_the_bundled_swarms_can_be_asked_for_where_a_robot_can_fly_them() {
        for one in crate::scene::bundled::SWARMS {
            let swarm = one.load_swarm(&[]).expect("loads");
            let control = Control::new(&swarm).expect("laid out");
            for manoeuvre in
                control.formation().manoeuvres.iter().filter(|_| control.formation().is_led_here())
            {
                let request =
                    SetFormationRequest { name: manoeuvre.name.clone(), ..SetFormationRequest::default() };
                let begun = set_formation(&mut control.clone(), &request);
                // There the leaders' targets change places at once.
                let is_step = one.name == "antipodal";
                assert_eq!(begun.is_err(), is_step, "{}, {}: {begun:?}", one.name, manoeuvre.name);
            }
        }
    }

    #[test]
    fn a_formation_that_was_led_by_other_means_moves_on_from_where_it_is() {
        let text = "title = \"two\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 1 }\n\
                    robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [0.0, 4.0] }]\n\
                    leaders = [{ robots = [\"a\", \"b\"], program = { kind = \"external\" } }]\n\
                    manoeuvres = [{ name = \"far\", about = [0.0, 0.0], legs = [{ seconds = 6.0, translate = [4.0, 0.0], rotate = 30.0 }] }]\n\
                    limits = { speed = 1.0, clearance = 0.3 }\n";
        let mut control = Control::new(&parsed(text, &[])).expect("laid out");
        let led = [[5.0, 0.0], [5.0, 4.0]];
        led.into_iter().enumerate().for_each(|(m, place)| assert!(control.place_leader(m, place)));
        // Where the leaders of a formation about this point are at these times.
        let places = |control: &Control, about: [f64; 2], time: f64| {
            let map = control.formation().posture(about, time).affine(about);
            [0, 1].map(|m| map.apply(control.formation().places.get(m)))
        };
        let stays = |control: &Control, led: [[f64; 2]; 2]| {
            [[0.0, 2.0], [0.0, 0.0], [-3.0, 5.0]].into_iter().all(|about| {
                let found = [0.0, 3.0, 10.0].map(|time| places(control, about, time));
                found.iter().flat_map(|found| found.iter().zip(led)).all(|(a, b)| distance(*a, b) < 1e-9)
            })
        };
        assert!(stays(&control, led), "led from outside");
        let still = |translate: [f64; 2], rotate: f64| SetFormationRequest {
            stretch: [1.0; 2],
            translate,
            rotate,
            duration: 10.0,
            ..SetFormationRequest::default()
        };
        set_formation(&mut control, &still([5.0, 0.0], 0.0)).expect("it is there already");
        assert!(stays(&control, led), "on a manoeuvre that leads nowhere");
        let far = SetFormationRequest { name: "far".into(), ..SetFormationRequest::default() };
        set_formation(&mut control, &far).expect("can be flown");
        let end = places(&control, [0.0, 0.0], 6.0);
        // About the middle, (0, 2), which the turn about (0, 0) has carried to (3, 2 cos 30).
        let turn = 30.0_f64.to_radians();
        let there = places(&control, [0.0, 2.0], 6.0);
        assert!(end.iter().zip(there).all(|(a, b)| distance(*a, b) < 1e-9), "{end:?} {there:?}");
        let posture = control.formation().posture([0.0, 2.0], 6.0);
        let translate = [4.0 - 2.0 * turn.sin(), 2.0 * turn.cos() - 2.0];
        assert!(distance(posture.translate, translate) < 1e-12 && posture.rotate == turn, "{posture:?}");
    }

    #[test]
    fn a_formation_is_not_led_through_its_collapse() {
        let mut control = Control::new(&bundled("square", &[])).expect("laid out");
        let mut ask = |stretch: [f64; 2], shear: [f64; 2]| {
            let request =
                SetFormationRequest { stretch, shear, duration: 600.0, ..SetFormationRequest::default() };
            set_formation(&mut control, &request)
        };
        for (stretch, shear) in [
            ([0.0, 1.0], [0.0; 2]),
            ([1.0, 1.0], [1.0, 1.0]),
            ([-1.0, 1.0], [0.0; 2]),
            ([-1.0, -1.0], [0.0; 2]),
            ([-1.0, -2.0], [0.0; 2]),
            ([-0.3, -0.3], [0.0; 2]),
        ] {
            let refused = ask(stretch, shear).expect_err("collapses");
            assert!(refused.contains("would collapse"), "{stretch:?} {shear:?}: {refused}");
        }
        for (stretch, shear) in [([1.5, 0.5], [0.3, 0.0]), ([0.1, 0.1], [0.0; 2]), ([1.0, 1.0], [0.9, 0.9])] {
            ask(stretch, shear).expect("can be flown");
        }
    }

    #[test]
    fn a_turn_of_many_rounds_is_refused_for_what_it_is_between_the_looks() {
        let control = |set: &[&str]| Control::new(&bundled("square", set)).expect("laid out");
        let ask = |set: &[&str], rotate: f64, duration: f64| {
            let request =
                SetFormationRequest { stretch: [1.0; 2], rotate, duration, ..SetFormationRequest::default() };
            set_formation(&mut control(set), &request)
        };
        let control = control(&[]);
        let formation = control.formation();
        let reach =
            formation.places.iter().map(|place| distance(place, formation.middle())).fold(0.0, f64::max);
        let limit = control.limits().speed;
        // Whole rounds between two of the looks at its way, so that these see nothing move.
        for rounds in [1.0, 64.0, 1000.0, 64_000.0] {
            let least = 1.5 * rounds * TAU * reach / limit;
            let refused = ask(&[], rounds * TAU, 0.9 * least).expect_err("too fast");
            assert!(refused.contains(&format!("it asks for {:.3} m/s", limit / 0.9)), "{refused}");
            assert!(ask(&[], rounds * TAU, 1.01 * least).is_ok(), "{rounds} rounds");
            let [x, y] = formation.middle();
            let edge = |a: f64| format!("[{}, {}]", x + 1.2 * reach * a.cos(), y + 0.95 * reach * a.sin());
            let corners: Vec<String> = (0..64).map(|k| edge(TAU * f64::from(k) / 64.0)).collect();
            let fence = format!("limits.geofence=[{}]", corners.join(", "));
            let refused = ask(&[&fence], rounds * TAU, 1.01 * least).expect_err("leads out");
            assert!(refused.contains("not inside the geofence"), "{refused}");
        }
    }
}
