//! Warnings before a flight that follow from the file and the formation's places alone.

mod network;

use super::{ManoeuvreSpeed, needed, started};
use crate::continuum::late::beyond;
use crate::flock::block::apply;
use crate::flock::manoeuvre::{Demand, Leg, Manoeuvre, highest};
use crate::flock::motion::{Interpolation, Keyframe, Motion};
use crate::flock::rounding::{ROUNDING, at_most};
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::minus;
use crate::scene::swarm::Swarm;
use crate::scene::swarm::raw::{RawCommandKind, RawSwarm};
use crate::scene::text::{decimals, number};
use crate::swarm::flight::{Flight, lasts};
use crate::swarm::formation::{Formation, Lead, first_few};
use crate::swarm::safety::foot;
pub use network::{late_without_speed, of_real_robots, of_simulated_robots};

/// Parts of a leg, or of a program's way from one point to the next, between which a leader's way is looked at.
const PARTS: usize = 40;

/// Most times at which those that follow are looked at: a program may have thousands of points.
const MOST_LOOKS: usize = 1000;

/// All of them.
pub fn of(swarm: &Swarm, flight: &Flight) -> Vec<String> {
    let formation = flight.control().formation();
    let raw = &swarm.raw;
    let one = [
        late_faults(flight, raw),
        short_faults(raw),
        hidden_fault(raw),
        late_commands(flight, raw),
        unled(flight),
    ];
    let fast = fast_manoeuvres(raw, formation)
        .chain(fast_paths(swarm, formation))
        .chain(leaping_paths(swarm, flight));
    network::of(raw, flight)
        .into_iter()
        .chain(one.into_iter().flatten())
        .chain(misplaced(raw, flight))
        .chain(commanded_astray(raw, flight))
        .chain(fast)
        .chain(narrow(raw, formation))
        .collect()
}

/// Faults that begin when the flight is over. What is done at its very end is how a session that was saved there ended.
fn late_faults(flight: &Flight, raw: &RawSwarm) -> Option<String> {
    let end = flight.periods() as f64 * raw.control.period;
    let late = raw.flight.faults.iter().enumerate().filter(|(_, fault)| !at_most(fault.at, end));
    let keys = late.map(|(k, fault)| format!("flight.faults[{k}].at = {}", fault.at));
    beyond(&format!("the end of the flight, at {end} s"), keys, "flight.duration")
}

/// Faults that end before a period begins in them: robots are looked at as periods begin.
fn short_faults(raw: &RawSwarm) -> Option<String> {
    let period = raw.control.period;
    let is_between = |at: f64, until: f64| {
        let first = (at / period).floor();
        !(0..=2).any(|k| lasts([at, until], (first + f64::from(k)) * period))
    };
    let short = raw.flight.faults.iter().enumerate();
    let short = short.filter(|(_, fault)| fault.until.is_some_and(|until| is_between(fault.at, until)));
    let keys: Vec<String> = short.map(|(k, _)| format!("flight.faults[{k}]")).collect();
    let names = first_few(keys.into_iter())?;
    Some(format!(
        "no period begins while these faults last, which are without effect: {names}; let them last a control.period"
    ))
}

fn hidden_fault(raw: &RawSwarm) -> Option<String> {
    let faults = &raw.flight.faults;
    let until = |k: usize| faults[k].until.unwrap_or(f64::INFINITY);
    let meet = |first: usize, second: usize| {
        let [a, b] = [first, second].map(|k| &faults[k]);
        a.robot == b.robot && a.at < until(second) && b.at < until(first)
    };
    let mut pairs = (0..faults.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
    let (first, second) = pairs.find(|&(first, second)| meet(first, second))?;
    Some(format!(
        "`{}` has one fault at a time: flight.faults[{second}] hides flight.faults[{first}] while both last; let the one end \
         before the other begins",
        faults[first].robot
    ))
}

fn late_commands(flight: &Flight, raw: &RawSwarm) -> Option<String> {
    let periods = flight.periods();
    let late = raw.flight.commands.iter().enumerate().filter(|(_, command)| command.after > periods);
    let keys = late.map(|(k, command)| format!("flight.commands[{k}].after = {}", command.after));
    beyond(&format!("the end of the flight, after {periods} periods"), keys, "flight.duration")
}

fn unled(flight: &Flight) -> Option<String> {
    let formation = flight.control().formation();
    let unled = formation.unled();
    if unled.len() == formation.count() {
        return Some("no robot leads: the formation goes nowhere; add [[leaders]]".into());
    }
    if let Some(names) = formation.named(|m| unled.contains(&m)) {
        return Some(format!(
            "no leader reaches {names}: these robots follow each other alone; link them to the others, or let one of them lead"
        ));
    }
    let unled = started(flight)?.unreached();
    let names = formation.named(|m| unled.contains(&m))?;
    Some(format!(
        "no leader reaches {names} at the start: these robots follow each other alone, or stand, until others come near; link \
         them farther, let them start nearer, or let one of them lead"
    ))
}

/// Robots that start, have their places or are led where they cannot stand, or where no pose is believed.
fn misplaced(raw: &RawSwarm, flight: &Flight) -> impl Iterator<Item = String> {
    let (control, formation) = (flight.control(), flight.control().formation());
    let (filter, led) = (control.filter(), Led::by(flight));
    let radius = |m: usize| formation.radii[m] - ROUNDING;
    let is_outside = |m: usize, place: [f64; 2]| !filter.is_fenced_in(place, radius(m));
    let is_far = |_: usize, place: [f64; 2]| !control.is_believed(place);
    let is_in_solid = |m: usize, place: [f64; 2]| filter.obstacles().distance(place) < radius(m);
    let start = |m: usize| flight.fleet().robots()[m].position;
    let home = |m: usize| formation.places.get(m);
    let outside = |which: &str, names: String| {
        format!(
            "these robots {which} outside limits.geofence, in whole or in part: {names}; widen it, or move them"
        )
    };
    let far = |which: &str, names: String, mend: &str| {
        let range = number(raw.poses.range);
        format!(
            "{which} farther than poses.range = {range} m from the formation's middle, where no pose is believed: {names}; \
             raise it, or {mend}"
        )
    };
    let starts_elsewhere = !raw.flight.start.is_empty();
    let all = [
        formation.named(|m| is_outside(m, start(m))).map(|names| outside("start", names)),
        formation
            .named(|m| starts_elsewhere && is_outside(m, home(m)))
            .map(|names| outside("have their places in the formation", names)),
        near_at_the_start(flight, raw),
        formation
            .named(|m| is_far(m, start(m)))
            .map(|names| far("these robots start", names, "move them")),
        led.to(formation, &is_outside).map(|names| {
            format!(
                "programs lead these robots out of limits.geofence: {names}; they will stop at the fence: widen it, or change \
                 their programs"
            )
        }),
        led.to(formation, &is_far)
            .map(|names| far("programs lead these robots", names, "change their programs")),
        // Wherever they start.
        formation.named(|m| is_in_solid(m, home(m))).map(|names| {
            format!("an obstacle stands at the places of {names} in the formation; move one of them")
        }),
        led_into_solids(formation, &is_in_solid),
    ];
    all.into_iter().flatten()
}

/// Robots that begin nearer to each other than the clearance, which nothing keeps until they have moved apart.
fn near_at_the_start(flight: &Flight, raw: &RawSwarm) -> Option<String> {
    let clearance = raw.limits.clearance?;
    let (places, formation) = (flight.fleet().places(), flight.control().formation());
    let is_near = |a: usize, b: usize| formation.gap(&places, a, b) < clearance - ROUNDING;
    let is_beside_another = |m: usize| (0..places.len()).any(|other| other != m && is_near(m, other));
    let names = formation.named(is_beside_another)?;
    Some(format!(
        "these robots start nearer to another than limits.clearance: {names}; move them, or lower it"
    ))
}

/// Where programs lead the robots.
struct Led {
    /// Time until which they are looked at \[s\].
    end: f64,
    /// Places of the members at rest, at times until then \[m\]; none where they are not known.
    rests: Vec<Vectors>,
}

impl Led {
    fn by(flight: &Flight) -> Self {
        let (control, formation) = (flight.control(), flight.control().formation());
        let end = match formation.programs_end() {
            end if end.is_finite() => end,
            _ => flight.periods() as f64 * control.period(),
        };
        // Where several programs lead, those that follow are looked at by the first.
        let times = looks((0..formation.count()).find_map(|m| formation.lead(m)), end);
        let thinned = times.iter().step_by(times.len().div_ceil(MOST_LOOKS));
        Self { end, rests: thinned.filter_map(|&time| rest(formation, time)).collect() }
    }

    /// Robots that programs lead to a bad place, or that follow to one and are not laid out at such a one.
    fn to(&self, formation: &Formation, is_bad: &dyn Fn(usize, [f64; 2]) -> bool) -> Option<String> {
        formation.named(|m| match formation.lead(m) {
            lead @ Some(_) => {
                let mut led = looks(lead, self.end).into_iter().filter_map(|time| formation.led_to(m, time));
                led.any(|place| is_bad(m, place))
            }
            None => !is_bad(m, formation.places.get(m)) && self.rests.iter().any(|all| is_bad(m, all.get(m))),
        })
    }
}

/// Places at which the members rest behind leaders that are where their programs have them at `time` \[s\]; `None` where that is not
/// known.
fn rest(formation: &Formation, time: f64) -> Option<Vectors> {
    let led = |m: usize| formation.led_to(m, time).unwrap_or_else(|| formation.places.get(m));
    formation.is_led_here().then(|| formation.settled(&(0..formation.count()).map(led).collect()))?
}

/// Times at which a leader's way is looked at, until `end` \[s\]: within each of its parts, however short.
fn looks(lead: Option<&Lead>, end: f64) -> Vec<f64> {
    if end <= 0.0 {
        return vec![0.0];
    }
    let ends: Vec<f64> = match lead {
        Some(Lead::Motion { motion: Motion::Keyframes { frames, .. }, since }) => {
            frames.iter().map(|frame| since + frame.step).collect()
        }
        // It repeats.
        Some(Lead::Motion { motion: Motion::Sinusoid { period, .. }, since }) => {
            (1..=4).map(|quarter| since + 0.25 * period * f64::from(quarter)).collect()
        }
        Some(Lead::Manoeuvre { manoeuvre, since }) => {
            let whole = |begun: &mut f64, leg: &Leg| {
                let end = *begun + leg.seconds;
                *begun = end + leg.hold;
                Some(end)
            };
            manoeuvre.legs.iter().scan(*since, whole).collect()
        }
        Some(Lead::External(_) | Lead::Motion { .. }) | None => {
            (1..4).map(|quarter| 0.25 * end * f64::from(quarter)).collect()
        }
    };
    let mut ends: Vec<f64> = ends.into_iter().filter(|time| *time < end).collect();
    ends.insert(0, 0.0);
    ends.push(end);
    let part = |pair: &[f64], k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / PARTS as f64;
    ends.windows(2).flat_map(|pair| (0..=PARTS).map(move |k| part(pair, k))).collect()
}

fn led_into_solids(formation: &Formation, is_in_one: &dyn Fn(usize, [f64; 2]) -> bool) -> Option<String> {
    let end = Some(formation.programs_end()).filter(|end| end.is_finite() && *end > 0.0)?;
    let at_rest = rest(formation, end);
    let place = |m: usize| match formation.led_to(m, end) {
        None => Some(at_rest.as_ref()?.get(m)).filter(|_| !is_in_one(m, formation.places.get(m))),
        led => led,
    };
    let names = formation.named(|m| place(m).is_some_and(|place| is_in_one(m, place)))?;
    Some(format!(
        "programs end with these robots' places in an obstacle, before which they will stop: {names}; move it, or \
         change their programs"
    ))
}

fn commanded_astray<'a>(raw: &'a RawSwarm, flight: &'a Flight) -> impl Iterator<Item = String> + 'a {
    let (filter, formation) = (flight.control().filter(), flight.control().formation());
    raw.flight.commands.iter().enumerate().filter_map(move |(k, command)| {
        let RawCommandKind::Lead { robot, to } = &command.what else { return None };
        let radius = formation.radii[formation.number(robot)?] - ROUNDING;
        let why = match () {
            () if !filter.is_fenced_in(*to, radius) => "out of limits.geofence",
            () if filter.obstacles().distance(*to) < radius => "into an obstacle",
            () => return None,
        };
        Some(format!(
            "flight.commands[{k}] leads `{robot}` {why}, where it cannot come to stand; lead it elsewhere"
        ))
    })
}

fn fast_manoeuvres<'a>(raw: &'a RawSwarm, formation: &'a Formation) -> impl Iterator<Item = String> + 'a {
    let all = raw.manoeuvres.iter().filter_map(|one| needed(formation, &one.name));
    all.filter_map(move |ManoeuvreSpeed { name, needed, acceleration }| {
        let words = above_limits(raw, "a robot's place", Demand { speed: needed, acceleration })?;
        Some(format!("manoeuvre `{name}` {words}: robots will fall behind; give its legs more seconds"))
    })
}

fn fast_paths(swarm: &Swarm, formation: &Formation) -> impl Iterator<Item = String> {
    (0..swarm.leaders.len()).filter_map(move |k| {
        let asked = motions(formation, k).map(|(_, motion)| demand(motion)).fold(Demand::default(), larger);
        let words = above_limits(&swarm.raw, "a robot", asked)?;
        Some(format!("the program of leaders[{k}] {words}: it will fall behind; give its points more time"))
    })
}

/// Words of what is asked of `moved` beyond a limit; none where nothing is.
fn above_limits(raw: &RawSwarm, moved: &str, Demand { speed, acceleration }: Demand) -> Option<String> {
    let [fastest, most] =
        [raw.limits.speed, raw.limits.acceleration].map(|limit| limit.unwrap_or(f64::INFINITY));
    let asked = [
        (speed, fastest, "moves", "m/s, above limits.speed"),
        (acceleration, most, "accelerates", "m/s^2, above limits.acceleration"),
    ];
    let above = asked.into_iter().filter(|(value, limit, ..)| !at_most(*value, *limit));
    let words = above
        .map(|(value, _, asks, limit)| format!("{asks} {moved} at up to {} {limit}", decimals(value, 3)));
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| words.join(", and "))
}

fn leaping_paths(swarm: &Swarm, flight: &Flight) -> impl Iterator<Item = String> {
    let (formation, robots) = (flight.control().formation(), flight.fleet().robots());
    let reach = swarm.raw.limits.speed.unwrap_or(f64::INFINITY) * swarm.raw.control.period;
    (0..swarm.leaders.len()).filter_map(move |k| {
        let away = |m: usize| minus(robots[m].position, formation.places.get(m));
        let begins = motions(formation, k).map(|(m, motion)| begins_away(motion, away(m))).fold(0.0, f64::max);
        let leaps = motions(formation, k).map(|(_, motion)| leap(motion)).fold(0.0, f64::max);
        // Points at the very beginning come from files alone, which hold none.
        let asked = [
            (begins, "begins", " from where its robot starts", "let it begin there"),
            (leaps, "leaps by up to", "", "interpolate it \"linear\" or \"smooth\""),
        ];
        let words = |(way, does, from, mend): (f64, &str, &str, &str)| {
            format!(
                "the program of leaders[{k}] {does} {} m{from}, farther than limits.speed leads in a period: the robot will be \
                 on its way for a while; {mend}",
                decimals(way, 3)
            )
        };
        asked.into_iter().find(|(way, ..)| !at_most(*way, reach)).map(words)
    })
}

/// Those by points of robots that an entry of leaders leads.
fn motions(formation: &Formation, entry: usize) -> impl Iterator<Item = (usize, &Motion)> {
    let led = (0..formation.count()).filter(move |&m| formation.entry(m) == Some(entry));
    led.filter_map(|m| match formation.lead(m)? {
        Lead::Motion { motion, .. } => Some((m, motion)),
        Lead::External(_) | Lead::Manoeuvre { .. } => None,
    })
}

/// How far from its robot a program that has a point at its very beginning has it \[m\]; `start` is the robot's displacement then.
fn begins_away(motion: &Motion, start: [f64; 2]) -> f64 {
    let Motion::Keyframes { frames, .. } = motion else { return 0.0 };
    let first = frames.first().filter(|frame| frame.step <= 0.0);
    first.map_or(0.0, |first| distance(start, first.displacement))
}

/// Way \[m\] and time \[s\] from each point of a program to the next, from the robot's place on.
fn parts(frames: &[Keyframe]) -> impl Iterator<Item = (f64, f64)> {
    let begins = frames.iter().map(|frame| (frame.displacement, frame.step));
    let begins = std::iter::once(([0.0; 2], 0.0)).chain(begins);
    begins.zip(frames).map(|((from, since), to)| (distance(from, to.displacement), to.step - since))
}

/// Largest leap of a program that holds each of its points until the next \[m\].
fn leap(motion: &Motion) -> f64 {
    let Motion::Keyframes { frames, interpolation: Interpolation::Hold } = motion else { return 0.0 };
    parts(frames).map(|(way, _)| way).fold(0.0, f64::max)
}

/// What a program by keyframes that goes from one to the next asks of a robot; at those where its velocity leaps no acceleration.
fn demand(motion: &Motion) -> Demand {
    let Motion::Keyframes { frames, interpolation } = motion else { return Demand::default() };
    // The largest derivatives of the part of the way that is done.
    let [pace, gain] = match interpolation {
        Interpolation::Hold => return Demand::default(),
        Interpolation::Linear => [1.0, 0.0],
        Interpolation::Smooth => [1.5, 6.0],
    };
    let of_part = |(way, seconds): (f64, f64)| Demand {
        speed: pace * way / seconds,
        acceleration: gain * way / (seconds * seconds),
    };
    parts(frames).filter(|(_, seconds)| *seconds > 0.0).map(of_part).fold(Demand::default(), larger)
}

/// The larger of two speeds, and of two accelerations.
fn larger(one: Demand, other: Demand) -> Demand {
    Demand { speed: one.speed.max(other.speed), acceleration: one.acceleration.max(other.acceleration) }
}

/// Manoeuvres that bring two robots nearer than they may be, at their places or where followers come to rest.
fn narrow(raw: &RawSwarm, formation: &Formation) -> impl Iterator<Item = String> {
    let clearance = raw.limits.clearance;
    raw.manoeuvres.iter().filter_map(move |one| {
        let (least, manoeuvre) = (clearance?, formation.manoeuvre(&one.name, 0.0)?);
        let is_narrow = |(free, ..): &(f64, usize, usize)| *free < least - ROUNDING;
        let at_places =
            narrowest(formation, &manoeuvre).filter(is_narrow).map(|found| ("at their places", found));
        let at_rest =
            || Some(("where they come to rest", narrowest_rest(formation, &manoeuvre).filter(is_narrow)?));
        let (which, (free, i, j)) = at_places.or_else(at_rest)?;
        let [first, second] = [i, j].map(|m| &formation.names[m]);
        Some(format!(
            "manoeuvre `{}` leaves {} m between `{first}` and `{second}` {which}, less than \
             limits.clearance: robots will be held off them; stretch or shear it less",
            one.name,
            decimals(free, 3)
        ))
    })
}

/// The same where the followers come to rest behind leaders in a manoeuvre; `None` where that is not known.
fn narrowest_rest(formation: &Formation, manoeuvre: &Manoeuvre) -> Option<(f64, usize, usize)> {
    /// Looks at a leg less one, beside which the nearest are sought.
    const LOOKS: usize = 16;
    formation.settled(&formation.places).filter(|_| formation.is_led_here())?;
    let nearest = std::cell::Cell::new((f64::INFINITY, 0, 0));
    let mut begun = 0.0;
    for leg in &manoeuvre.legs {
        highest(LOOKS, |part| {
            let affine = manoeuvre.affine(begun + leg.seconds * part);
            let places = formation.places.iter().map(|place| affine.apply(place)).collect();
            let rest = formation.settled(&places).unwrap_or(places);
            let free = |(i, j)| (formation.gap(&rest, i, j), j, i);
            let least =
                formation.pairs().map(free).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(nearest.get());
            if least.0 < nearest.get().0 {
                nearest.set(least);
            }
            -least.0
        });
        begun += leg.seconds + leg.hold;
    }
    Some(nearest.get())
}

/// Least free space between two robots at their places in a manoeuvre \[m\], and which two.
///
/// A turn leaves their distance, and stretch and shear are linear in the part of a leg that is done: so is the way from the
/// one to the other before the turn.
fn narrowest(formation: &Formation, manoeuvre: &Manoeuvre) -> Option<(f64, usize, usize)> {
    let mut least: Option<(f64, usize, usize)> = None;
    let mut from = manoeuvre.from.shape();
    for leg in &manoeuvre.legs {
        let to = leg.posture.shape();
        for (i, j) in formation.pairs() {
            let way = minus(formation.places.get(i), formation.places.get(j));
            let [begin, end] = [&from, &to].map(|shape| apply(shape, way));
            let nearest = foot([begin, end], [0.0; 2]);
            let free = distance(nearest, [0.0; 2]) - formation.radii[i] - formation.radii[j];
            if least.is_none_or(|(other, ..)| free < other) {
                least = Some((free, j, i));
            }
        }
        from = to;
    }
    least
}
