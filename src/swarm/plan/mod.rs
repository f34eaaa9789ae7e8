//! The plan of a swarm: how fast its formation comes to rest, how far noise and delay may go, how fast it can be led.
//!
//! One period of the loop is a linear map of the places at which the members are seen, `x' = A x_F + B x_L + D l` with
//! the leaders' seen places `x_L` and led places `l`. The map is taken from the loop itself, column by column. With it:
//!
//! * the formation forgets a disturbance by the spectral radius of `A` in a period; a delay of `d` periods makes that
//!   its `d + 1`st root, which is below 1 as well: delay slows the formation and never makes it grow. A frame that lags remembers the
//!   last sweep, which no pose delays: there it is the radius of the joint map of the frame and of the places of the last `d + 1` periods;
//! * noise of the poses moves a follower by the root of the diagonal of `C = A C A' + A A' + B B'` times that noise;
//! * behind leaders that move steadily a follower lags by the row `n` of `(1 - A)^-1 (A + B) 1` times their way in a period,
//!   `d + 1` times that under a delay of `d` periods, if a shift of all takes all targets along: `(A + B + D) 1 = 1`. Otherwise it
//!   is farther behind the farther they go, and has no lag;
//! * where each robot is kept a way `b` behind its target, in which it could brake, it is `n b` farther behind the leaders,
//!   and `(n + 1) b` behind their program, behind which they are themselves.
//!
//! For many followers, or with a frame, which remembers, the lag is that of the loop itself, run until it is steady; where the frame
//! lags it is run with the delay.
//!
//! A loop that is not linear has no such map, and nothing of this is stated of it.

pub mod cautions;
mod convergence;
mod exactness;
mod period_map;
#[cfg(test)]
mod tests;
mod words;

use serde::Serialize;

use super::formation::{Formation, Seen};
use crate::flock::manoeuvre::{Demand, Manoeuvre};
use crate::flock::rounding::{ROUNDING, at_most};
use crate::flock::vectors::distance;
use crate::scene::SceneError;
use crate::scene::swarm::{Shape, Swarm};
use crate::scene::text::decimals;
use crate::swarm::flight::Flight;
use crate::swarm::robots::DoubleIntegrator;
use crate::swarm::safety::Limits;
use convergence::{convergence, delayed_factor, half_life, remembers};
use exactness::keeps_to_shift;
pub use exactness::{Exactness, ManoeuvreError};
use period_map::{PeriodMap, lag_when_led};

/// A lag below this sets no speed: what it allows is far above that of any robot \[s\].
const LEAST_LAG: f64 = 1e-3;

/// The reason for which no lag is known of followers that are never in their places.
const NEVER_STEADY: &str = "disturbances do not die out";

/// The reason for which no lag is known of followers that fall behind, or aside, by more and more.
const NOT_KEPT: &str = "followers do not keep to a shift of the leaders";

/// The reason for which nothing is known of a formation that is too large for it.
const TAKES_LONG: &str = "it would take long to compute for so many robots";

/// Standard deviations of noise that each robot keeps farther away from everything.
const DEVIATIONS_KEPT: f64 = 3.0;

/// A swarm before it flies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SwarmPlan {
    /// Name of the swarm.
    pub name: String,
    /// Title of the swarm.
    pub title: String,
    /// Number of robots.
    pub robots: usize,
    /// Those of them that lead.
    pub leaders: usize,
    /// Neighbours of a follower, in the mean; at the start where they are found anew \[1\].
    pub neighbours: f64,
    /// Smallest distance between two places of the formation \[m\]; absent for a single robot.
    pub spacing: Option<f64>,
    /// Free space between the two rims that are nearest at the places of the formation \[m\].
    pub free_space: Option<f64>,
    /// The model of the simulated robots.
    pub model: &'static str,
    /// Time between two targets \[s\].
    pub period_s: f64,
    /// Applications of the rule in a period, at most.
    pub sweeps: usize,
    /// The simulated flight's duration \[s\].
    pub flight_s: f64,
    /// How fast a disturbance dies out.
    pub convergence: Option<Convergence>,
    /// The reason for which that is not predicted.
    pub not_predicted: Option<&'static str>,
    /// Effects of noise.
    pub noise: NoiseMargin,
    /// Effects of delay.
    pub delay: DelayMargin,
    /// How fast the formation can be led.
    pub speed: SpeedMargin,
    /// How exactly followers keep to the leaders' motion; absent where no linear rule says.
    pub exactness: Option<Exactness>,
    /// Warnings before the flight.
    pub cautions: Vec<String>,
}

/// How fast a disturbance dies out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Convergence {
    /// Largest part of a disturbance that is left after a period \[1\].
    pub factor: f64,
    /// Time in which the slowest part of a disturbance halves \[s\]; absent where it does not.
    pub half_life_s: Option<f64>,
}

/// Effects of noise in the poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NoiseMargin {
    /// The noise that is simulated: standard deviation of a coordinate \[m\].
    pub simulated: f64,
    /// Standard deviation of the place of the follower that is moved most, over that of the poses \[1\].
    pub gain: Option<f64>,
    /// Noise at which the filter begins to hold robots at their places of the formation \[m\].
    pub largest: Option<f64>,
}

/// Effects of delay of the poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DelayMargin {
    /// The delay that is simulated, the jitter included \[s\].
    pub simulated_s: f64,
    /// Age up to which poses are used \[s\].
    pub largest_s: f64,
    /// The same in whole periods.
    pub largest_periods: usize,
    /// Age from which on two robots at their places may be too near for all that poses say, so that they hold each other where
    /// no node sends both their targets \[s\]; absent where robots are not kept apart, or are predicted.
    pub room_s: Option<f64>,
    /// Largest part of a disturbance that is left after a period under the simulated delay \[1\].
    pub factor: Option<f64>,
    /// Time in which the slowest part of a disturbance halves under that delay \[s\].
    pub half_life_s: Option<f64>,
    /// Whether a frame remembers the last sweep, which poses do not delay.
    #[serde(skip)]
    pub frame_remembers: bool,
}

/// How fast the formation can be led.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpeedMargin {
    /// The speed limit \[m/s\].
    pub limit: Option<f64>,
    /// The time by which the last follower is behind steadily and slowly moving leaders under the simulated delay, in the
    /// formation \[s\].
    pub lag_s: Option<f64>,
    /// The reason for which that is not known.
    pub lag_not_known: Option<&'static str>,
    /// How much more that is for each of the leaders' metres a second, by the acceleration limit \[s^2/m\]: a robot at a speed of `v` is
    /// held as far behind its target as it goes while it brakes, `v^2 / (2 a)`.
    pub lag_per_speed: Option<f64>,
    /// How much more it is at least for robots that brake in whole periods, however slow the leaders are \[s\].
    pub least_braking_lag_s: Option<f64>,
    /// `flight.bounds.affine_error` \[m\].
    pub bound: Option<f64>,
    /// The highest speed of a steady program at which every robot, leaders included, stays within that bound of its place, at
    /// most the speed limit \[m/s\]. Without a bound it is the speed limit. It is absent where nothing limits it. It is
    /// absent, too, where there is a bound and the lag is not known.
    pub reachable: Option<f64>,
    /// The demands of each manoeuvre.
    pub manoeuvres: Vec<ManoeuvreSpeed>,
}

/// The demands of a manoeuvre on its fastest robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ManoeuvreSpeed {
    /// Name of the manoeuvre.
    pub name: String,
    /// Largest speed of a place of the formation \[m/s\].
    pub needed: f64,
    /// Largest acceleration of a place of the formation \[m/s^2\].
    pub acceleration: f64,
}

impl SwarmPlan {
    /// # Errors
    /// Names the key of the swarm that cannot be laid out, kept safe or flown.
    pub fn new(swarm: &Swarm) -> Result<Self, SceneError> {
        let flight = Flight::new(swarm)?;
        let formation = flight.control().formation();
        let raw = &swarm.raw;
        let period = raw.control.period;
        let leaders = (0..formation.count()).filter(|&m| formation.leads(m)).count();
        let not_linear = not_linear(formation, swarm);
        let predicted = match not_linear {
            Some(why) => Err(why),
            None => convergence(formation, swarm).ok_or("the rule is not linear"),
        }
        .map_err(|why| if leaders == formation.count() { "every robot leads" } else { why });
        let map = PeriodMap::of(formation, raw.control.sweeps).filter(|_| not_linear.is_none());
        let exactness = Exactness::of(swarm, formation);
        let convergence = predicted.ok();
        let delay = f64::from(longest_delay(swarm));
        let delayed = convergence.and_then(|one| delayed_factor(formation, swarm, one.factor));
        let lag =
            lag(swarm, formation, map.as_ref(), predicted.map(|one| (one, delayed)), exactness.as_ref());
        let mut plan = Self {
            name: swarm.name.clone(),
            title: raw.title.clone(),
            robots: formation.count(),
            leaders,
            neighbours: neighbours(started(&flight).as_ref().unwrap_or(formation)),
            spacing: (formation.count() > 1).then(|| formation.spacing()),
            free_space: free_space(formation),
            model: flight.fleet().model().name(),
            period_s: period,
            sweeps: raw.control.sweeps,
            flight_s: flight.periods() as f64 * period,
            noise: NoiseMargin {
                simulated: raw.flight.noise,
                gain: map.as_ref().and_then(PeriodMap::noise_gain),
                largest: largest_noise(formation, raw.limits.clearance),
            },
            delay: DelayMargin {
                simulated_s: delay * period,
                largest_s: raw.poses.age_limit,
                // Of an exact multiple all periods count, whatever rounding makes of it.
                largest_periods: (raw.poses.age_limit / period * (1.0 + ROUNDING)) as usize,
                room_s: room_for_delay(formation, flight.control().limits()),
                factor: delayed,
                half_life_s: delayed
                    .filter(|&factor| factor < 1.0)
                    .map(|factor| period * half_life(factor).max(delay + 1.0)),
                frame_remembers: remembers(formation),
            },
            speed: speed(swarm, &flight, lag),
            exactness,
            not_predicted: predicted.err(),
            convergence,
            cautions: Vec::new(),
        };
        let real = cautions::late_without_speed(flight.control().limits()).map(str::to_owned);
        plan.cautions = lasting(&plan)
            .into_iter()
            .chain(cautions::of(swarm, &flight))
            .chain(beyond_bound(formation, &plan.speed))
            .chain(real)
            .collect();
        Ok(plan)
    }
}

/// The formation with the neighbours that are found as the flight starts; `None` where they last, or a scene leads.
fn started(flight: &Flight) -> Option<Formation> {
    let mut formation = flight.control().formation().clone();
    let lasts = formation.engine()?.lasting_neighbours().is_some();
    if lasts || !formation.is_led_here() {
        return None;
    }
    let (present, known) = (flight.fleet().places(), vec![true; formation.count()]);
    formation.advance(&Seen { present: &present, known: &known }, &mut [], 0.0, 1, &mut present.clone());
    Some(formation)
}

fn neighbours(formation: &Formation) -> f64 {
    let followers = || (0..formation.count()).filter(|&m| !formation.leads(m));
    let all: usize = followers().map(|m| formation.neighbours(m).count()).sum();
    all as f64 / followers().count().max(1) as f64
}

/// Smallest free space between two rims at the places of the formation \[m\].
fn free_space(formation: &Formation) -> Option<f64> {
    formation.pairs().map(|(i, j)| formation.gap(&formation.places, i, j)).reduce(f64::min)
}

/// Noise at which two robots at their places take up all of the space between them \[m\].
fn largest_noise(formation: &Formation, clearance: Option<f64>) -> Option<f64> {
    let free = free_space(formation)? - clearance?;
    Some((free / (2.0 * DEVIATIONS_KEPT)).max(0.0))
}

/// Age of poses at which two robots at their places are perhaps too near, where each may be anywhere within the speed limit and the
/// line between the two is off by as much (see the docs of `swarm::safety`) \[s\].
fn room_for_delay(formation: &Formation, limits: &Limits) -> Option<f64> {
    if !limits.keeps_apart || limits.brakes || !limits.speed.is_finite() {
        return None;
    }
    let Formation { places, radii, .. } = formation;
    let room = |(i, j)| {
        let apart = distance(places.get(i), places.get(j));
        let keep = radii[i] + radii[j] + limits.clearance + 2.0 * limits.margin();
        // Where sqrt(apart^2 - off^2) = keep + off.
        let off: f64 = 0.5 * ((2.0 * apart * apart - keep * keep).max(0.0).sqrt() - keep);
        off.max(0.0) / (2.0 * limits.speed)
    };
    formation.pairs().map(room).reduce(f64::min)
}

/// The reason for which a period is no linear map, as far as the file shows it.
fn not_linear(formation: &Formation, swarm: &Swarm) -> Option<&'static str> {
    // A scene changes the roles on its way; a body that carries robots along is not moved by them.
    let is_rule = matches!(swarm.shape, Shape::Places(_) | Shape::Body(_));
    match formation.engine().filter(|_| is_rule) {
        None => Some("a scene leads"),
        Some(engine) if engine.lasting_neighbours().is_none() => {
            Some("neighbours are found anew in every period")
        }
        Some(_) => {
            let resilience = swarm.raw.resilience.as_ref().filter(|one| one.max_faulty_neighbours > 0);
            resilience.map(|_| "robots leave straying neighbours out")
        }
    }
}

/// Periods by which poses are late at most in the simulated flight.
fn longest_delay(swarm: &Swarm) -> u32 {
    swarm.raw.flight.delay + swarm.raw.flight.jitter
}

/// The largest lag of a follower behind leaders that move steadily.
#[derive(Clone, Copy)]
struct Lag {
    /// Without a delay \[period\].
    prompt: f64,
    /// Under the simulated one \[period\].
    delayed: f64,
}

/// The lag, or the reason for which it is not known.
fn lag(
    swarm: &Swarm,
    formation: &Formation,
    map: Option<&PeriodMap>,
    convergence: Result<(Convergence, Option<f64>), &'static str>,
    exactness: Option<&Exactness>,
) -> Result<Lag, &'static str> {
    if formation.is_led_here() && (0..formation.count()).all(|m| formation.leads(m)) {
        return Ok(Lag { prompt: 0.0, delayed: 0.0 });
    }
    let (Convergence { factor, .. }, delayed) = convergence?;
    // 1 - A has an inverse where disturbances grow too, but no lag comes of it.
    if factor >= 1.0 || delayed.is_some_and(|factor| factor >= 1.0) {
        return Err(NEVER_STEADY);
    }
    let axes = followed_axes(formation, exactness).ok_or(NOT_KEPT)?;
    let delay = longest_delay(swarm);
    let led = |factor, delay| {
        lag_when_led((formation, swarm.raw.control.sweeps), axes, factor, delay).ok_or(TAKES_LONG)
    };
    let prompt = match map {
        Some(map) => map.lag(axes).ok_or(NEVER_STEADY)?,
        None => led(factor, 0)?,
    };
    let delayed = match delayed {
        Some(_) if delay == 0 => prompt,
        Some(factor) if remembers(formation) => led(factor, delay)?,
        None => return Err(TAKES_LONG),
        Some(_) => prompt * (f64::from(delay) + 1.0),
    };
    Ok(Lag { prompt, delayed })
}

/// The axes along which leaders go and followers keep to a shift of theirs; `None` where leaders may go another way too.
fn followed_axes(formation: &Formation, exactness: Option<&Exactness>) -> Option<[bool; 2]> {
    let axes = [0, 1].map(|axis| keeps_to_shift(formation, axis));
    // A term across one axis alone shows in no manoeuvre along the other one.
    let is_led_along = || {
        let are_exact = exactness.is_some_and(Exactness::is_every_manoeuvre_exact);
        axes != [false; 2] && formation.affine(0.0).is_some() && are_exact
    };
    (axes == [true; 2] || is_led_along()).then_some(axes)
}

fn speed(swarm: &Swarm, flight: &Flight, lag: Result<Lag, &'static str>) -> SpeedMargin {
    let (raw, formation) = (&swarm.raw, flight.control().formation());
    let (limit, bound, period) = (raw.limits.speed, raw.flight.bounds.affine_error, raw.control.period);
    let follow = (0..formation.count()).any(|m| !formation.leads(m));
    let lags = lag.ok().filter(|_| follow);
    let braking = raw.limits.acceleration.zip(lags);
    let in_time = |lag: Lag| lag.delayed * period;
    let reachable = match (bound, lag) {
        (None, _) => limit,
        (Some(_), Err(_)) => None,
        (Some(error), Ok(lag)) => {
            let by_lag = reachable(error, in_time(lag), lag.prompt + 1.0, flight.control().limits(), period);
            [limit, by_lag].into_iter().flatten().reduce(f64::min)
        }
    };
    SpeedMargin {
        limit,
        lag_s: lags.map(in_time),
        lag_not_known: lag.err(),
        lag_per_speed: braking.map(|(most, lag)| lag.prompt / (2.0 * most)),
        least_braking_lag_s: braking
            .filter(|_| flight.control().limits().brakes)
            .map(|(_, lag)| 0.5 * lag.prompt * period),
        bound,
        reachable,
        manoeuvres: swarm.manoeuvres.iter().filter_map(|one| needed(formation, &one.name)).collect(),
    }
}

/// The speed at which the way behind a program, the lag's and so many braking ways, is the error \[m\]; `None` where no speed is.
fn reachable(error: f64, lag: f64, ways: f64, limits: &Limits, period: f64) -> Option<f64> {
    /// Halvings of the interval in which it is: to all its digits.
    const HALVINGS: usize = 60;
    // A smaller lag allows far more than the speed of any robot.
    let by_lag = if lag >= LEAST_LAG { error / lag } else { f64::INFINITY };
    let highest = by_lag.min((2.0 * limits.acceleration * error / ways).sqrt());
    if highest.is_infinite() {
        return None;
    }
    let behind = |speed: f64| lag * speed + ways * braking_way(speed, limits, period);
    let (mut low, mut high) = (0.0, highest);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if behind(middle) <= error {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

/// How far behind its target a robot is kept at a steady speed, by a limit of acceleration \[m\].
fn braking_way(speed: f64, limits: &Limits, period: f64) -> f64 {
    let acceleration = limits.acceleration;
    if acceleration.is_infinite() {
        0.0
    } else if limits.brakes {
        DoubleIntegrator { speed: f64::INFINITY, acceleration }.braking_way([speed, 0.0], period)[0]
    } else {
        speed * speed / (2.0 * acceleration)
    }
}

/// The largest speed and acceleration of a place in a manoeuvre.
fn needed(formation: &Formation, name: &str) -> Option<ManoeuvreSpeed> {
    let Demand { speed: needed, acceleration } = formation.manoeuvre(name, 0.0)?.demand(&formation.places);
    Some(ManoeuvreSpeed { name: name.to_owned(), needed, acceleration })
}

/// Manoeuvres within the speed limit, one of whose legs is too fast for the bound.
fn beyond_bound<'a>(formation: &'a Formation, speed: &'a SpeedMargin) -> impl Iterator<Item = String> + 'a {
    let limit = speed.limit.unwrap_or(f64::INFINITY);
    let too_fast = move |(bound, reachable): (f64, f64)| {
        let lag = bound / reachable;
        let is_beyond = move |leg: &Manoeuvre| {
            // Robots that would lag by that time fall behind by a part of it alone in a leg that is shorter.
            let part = 1.0 - (-0.5 * leg.duration() / lag).exp();
            !at_most(leg.demand(&formation.places).speed * part, reachable)
        };
        let is_fast = move |one: &&ManoeuvreSpeed| {
            let manoeuvre = formation.manoeuvre(&one.name, 0.0);
            at_most(one.needed, limit)
                && manoeuvre.is_some_and(|manoeuvre| leg_by_leg(&manoeuvre).any(|leg| is_beyond(&leg)))
        };
        let words = move |ManoeuvreSpeed { name, needed, .. }: &ManoeuvreSpeed| {
            let [needed, reachable] = [*needed, reachable].map(|speed| decimals(speed, 3));
            format!(
                "manoeuvre `{name}` moves a robot's place at up to {needed} m/s, and steadily led robots are within \
                 flight.bounds.affine_error = {bound} m of their places up to {reachable} m/s: give its legs more seconds, or \
                 raise the bound"
            )
        };
        speed.manoeuvres.iter().filter(is_fast).map(words)
    };
    speed.bound.zip(speed.reachable).into_iter().flat_map(too_fast)
}

/// Each leg as a manoeuvre of its own.
fn leg_by_leg(manoeuvre: &Manoeuvre) -> impl Iterator<Item = Manoeuvre> + '_ {
    let begins = std::iter::once(manoeuvre.from).chain(manoeuvre.legs.iter().map(|leg| leg.posture));
    begins.zip(&manoeuvre.legs).map(|(from, &leg)| Manoeuvre {
        about: manoeuvre.about,
        from,
        legs: vec![leg],
    })
}

fn lasting(plan: &SwarmPlan) -> Option<String> {
    // Where that is not known, as it is without the delay.
    let prompt = plan.convergence.map(|one| one.factor);
    let factor = plan.delay.factor.or(prompt).filter(|&factor| factor >= 1.0)?;
    Some(format!("disturbances do not die out: {factor:.4} of the slowest is left after a period"))
}
