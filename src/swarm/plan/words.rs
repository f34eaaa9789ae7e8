//! The plan of a swarm as it is printed.

use std::fmt;

use super::{
    Convergence, DelayMargin, Exactness, ManoeuvreError, ManoeuvreSpeed, SpeedMargin, SwarmPlan, TAKES_LONG,
};
use crate::scene::text::{counted, decimals, listed};

/// Smaller values read as zero to three places.
const NOTHING: f64 = 0.001;

fn half_life(half: Option<f64>) -> String {
    match half {
        None => "never".to_owned(),
        Some(half) if half < NOTHING => "at once".to_owned(),
        Some(half) => format!("in {half:.3} s"),
    }
}

impl fmt::Display for SwarmPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}", self.name, self.title)?;
        let mut line = |name: &str, value: String| writeln!(f, "  {name:<16}  {value}");
        let Self { robots, leaders, model, spacing, sweeps, period_s, .. } = self;
        line(
            "robots",
            format!(
                "{robots} ({}), simulated as {model}, {:.1} s",
                counted(*leaders, "leader"),
                self.flight_s
            ),
        )?;
        let free = self
            .free_space
            .map_or(String::new(), |free| format!(", {} m between the nearest rims", decimals(free, 4)));
        let apart = spacing
            .map_or(String::new(), |spacing| format!("places {} m apart{free}, ", decimals(spacing, 4)));
        line("formation", format!("{apart}{:.2} neighbours", self.neighbours))?;
        line(
            "loop",
            format!("a target every {period_s} s, at most {} of the rule in each", counted(*sweeps, "sweep")),
        )?;
        match self.convergence {
            Some(Convergence { factor, half_life_s }) => {
                let halves = half_life(half_life_s);
                let left =
                    if factor < NOTHING { format!("less than {NOTHING}") } else { format!("{factor:.3}") };
                line(
                    "comes to rest",
                    format!("a disturbance halves {halves}; {left} is left after a period"),
                )?;
                let DelayMargin { simulated_s, factor, half_life_s, frame_remembers, .. } = self.delay;
                let delayed = half_life(half_life_s);
                let with = match (simulated_s, factor) {
                    (0.0, _) => "none is simulated".into(),
                    (simulated, Some(_)) => format!("with {simulated:.3} s the error halves {delayed}"),
                    (simulated, None) => format!("with {simulated:.3} s not computed: {TAKES_LONG}"),
                };
                let does = match frame_remembers {
                    true => "does not reach what the frame remembers",
                    false => "slows convergence, never destabilises",
                };
                line("delay", format!("{does}: {with}"))?;
            }
            None => {
                line("comes to rest", format!("not predicted: {}", self.not_predicted.unwrap_or_default()))?
            }
        }
        let DelayMargin { largest_s, largest_periods, room_s, .. } = self.delay;
        let room = room_s.map_or(String::new(), |room| {
            format!("; up to {room:.3} s robots at their places have room where each has a node of its own")
        });
        line(
            "delay margin",
            format!("poses are used up to an age of {largest_s} s, {largest_periods} periods{room}"),
        )?;
        match self.noise.gain {
            None => {}
            Some(gain) if gain < NOTHING => {
                line("noise", "the noise of poses does not reach the targets of followers".into())?
            }
            Some(gain) => line(
                "noise",
                format!("a follower moves by up to {gain:.3} of the poses' standard deviation"),
            )?,
        }
        let held = match self.noise.largest {
            Some(largest) => format!("{largest:.4} m until the clearance holds robots at their places"),
            None => "no two robots have a clearance to keep".to_owned(),
        };
        line("noise margin", format!("{held}; simulated {} m", self.noise.simulated))?;
        for (name, words) in self.speed.in_words(model) {
            line(name, words)?;
        }
        for words in self.exactness.iter().flat_map(Exactness::in_words) {
            line("exact", words)?;
        }
        self.cautions.iter().try_for_each(|caution| writeln!(f, "caution: {caution}"))
    }
}

impl SpeedMargin {
    /// Each line's name and words.
    fn in_words(&self, model: &str) -> Vec<(&'static str, String)> {
        let Self { limit, lag_s, lag_not_known, bound, reachable, manoeuvres, .. } = self;
        let mut lines = vec![("speed limit", limit.map_or("none".into(), |limit| format!("{limit} m/s")))];
        if let Some(lag) = lag_s {
            let more = self.lag_per_speed.filter(|more| *more >= NOTHING).map_or(String::new(), |more| {
                let least = self.least_braking_lag_s.filter(|least| *least >= NOTHING);
                let least = least.map_or(String::new(), |least| format!(", {least:.3} s at least"));
                format!(", and {more:.3} s more for each m/s of them{least}, by the acceleration limit")
            });
            lines.push(("lag", format!("followers are up to {lag:.3} s behind steady leaders{more}")));
        }
        if let Some(why) = lag_not_known {
            lines.push(("lag", format!("not computed: {why}")));
        }
        let within = match bound {
            Some(bound) => {
                format!("with robots within flight.bounds.affine_error = {bound} m of their places")
            }
            None => "the speed limit: no flight.bounds.affine_error bounds how far they lag".to_owned(),
        };
        match (reachable, lag_s, lag_not_known) {
            (Some(speed), ..) => lines.push(("reachable speed", format!("{speed:.4} m/s, {within}"))),
            (None, _, Some(_)) if bound.is_some() => {
                lines.push(("reachable speed", "not computed, as the lag is not".to_owned()));
            }
            (None, Some(lag), _) if *lag < NOTHING => lines.push((
                "reachable speed",
                format!("not limited: {model} robots, with the rule, keep up at any speed"),
            )),
            _ => {}
        }
        let of_one = |ManoeuvreSpeed { name, needed, acceleration }: &ManoeuvreSpeed| {
            let [speed, acceleration] = [needed, acceleration].map(|value| decimals(*value, 3));
            (
                "manoeuvre",
                format!(
                    "`{name}` moves a place at up to {speed} m/s, accelerating at up to {acceleration} m/s^2"
                ),
            )
        };
        lines.extend(manoeuvres.iter().map(of_one));
        lines
    }
}

impl Exactness {
    /// The motions that are followed exactly, and how far each manoeuvre is from that, a line each.
    pub fn in_words(&self) -> Vec<String> {
        let exact = match &self.exact[..] {
            [] => "no kind of motion of the leaders is followed exactly in all directions".to_owned(),
            exact => format!("followers take part exactly in every {} of the leaders", exact.join(", ")),
        };
        let of_one = |ManoeuvreError { name, largest }: &ManoeuvreError| match largest {
            0.0 => format!("manoeuvre `{name}`: every follower in its place"),
            _ => format!(
                "manoeuvre `{name}`: followers up to {} m from their places, however slow it is",
                decimals(*largest, 3)
            ),
        };
        let without = self.needed.as_deref().map(|needed| match needed {
            [] => "where any one robot is lost the others go on to do so".to_owned(),
            needed => {
                let mut by: Vec<&String> = needed.iter().flat_map(|one| &one.by).collect();
                by.sort_unstable();
                by.dedup();
                let lost: Vec<&String> = needed.iter().map(|one| &one.name).collect();
                let need = if by.len() == 1 { "needs" } else { "need" };
                format!(
                    "where any one robot is lost the others go on to do so, but {} {need} one of {}",
                    listed(&by),
                    listed(&lost)
                )
            }
        });
        std::iter::once(exact).chain(without).chain(self.manoeuvres.iter().map(of_one)).collect()
    }
}
