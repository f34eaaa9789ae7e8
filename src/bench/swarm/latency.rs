//! From a pose that a robot publishes to the target that answers it, over DDS on loopback.
//!
//! A node of this process serves the formation; a second participant publishes the poses and receives the
//! targets, as the robots would. Each round the robots stand elsewhere, further than a target can lie from
//! where its robot stands: so a target says which round it answers.

use std::fmt;

use serde::Serialize;

#[cfg(feature = "ros")]
use crate::bench::machine::quantile;

/// The cases that could be measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// One entry for each formation and way to serve it.
    pub cases: Vec<Case>,
    /// Why there are no cases, or not all.
    pub skipped: Option<String>,
}

/// One formation and one way to serve it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Robots of the formation.
    pub robots: usize,
    /// Period of the node's steady loop \[s\], which a pose has to wait for; none where the node ticks over and
    /// over, 50 us apart: transport and tick alone.
    pub period_seconds: Option<f64>,
    /// Targets that came.
    pub samples: usize,
    /// Poses whose target had not come after a quarter of a second.
    pub lost: usize,
    /// The middle one of the times from pose to target \[s\]; none without samples.
    pub p50_seconds: Option<f64>,
    /// That which all but one in a hundred keep \[s\].
    pub p99_seconds: Option<f64>,
}

impl Case {
    #[cfg(feature = "ros")]
    fn of(robots: usize, period_seconds: Option<f64>, mut times: Vec<f64>, lost: usize) -> Self {
        times.sort_unstable_by(f64::total_cmp);
        let (p50_seconds, p99_seconds) = (quantile(&times, 0.5), quantile(&times, 0.99));
        Self { robots, period_seconds, samples: times.len(), lost, p50_seconds, p99_seconds }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for case in &self.cases {
            let served = match case.period_seconds {
                Some(period) => format!("loop of {:.0} Hz, {:.1} ms", 1.0 / period, 1e3 * period),
                None => "transport and tick alone".into(),
            };
            let ms = |time: Option<f64>| time.map_or("-".into(), |time| format!("{:.3} ms", 1e3 * time));
            let (p50, p99) = (ms(case.p50_seconds), ms(case.p99_seconds));
            let Case { robots, samples, lost, .. } = case;
            writeln!(
                f,
                "{robots:>7} robots  {served:<26}  p50 {p50:>9}  p99 {p99:>9}  ({samples} targets, {lost} lost)"
            )?;
        }
        self.skipped.iter().try_for_each(|why| writeln!(f, "not measured: {why}"))
    }
}

#[cfg(not(feature = "ros"))]
pub(super) fn measure(_effort: &[(usize, usize)]) -> Report {
    Report { cases: Vec::new(), skipped: Some("built without the feature `ros`".into()) }
}

#[cfg(feature = "ros")]
pub(super) use over_dds::measure;

#[cfg(feature = "ros")]
mod over_dds {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::{Duration, Instant};

    use super::super::formation;
    use super::{Case, Report};
    use crate::flock::vectors::Vectors;
    use crate::ros::arguments::{DiscoveryRange, Environment, RosArguments};
    use crate::ros::node::FormationNode;
    use crate::ros::robots::{Layout, Link};
    use crate::scene::swarm::Swarm;
    use crate::swarm::control::Control;
    use crate::swarm::pace::system_time;
    use crate::swarm::transport::RobotsEnd;
    use crate::swarm::watch::Pose;

    /// Of the node's loop [s]: as fast as it goes.
    const PERIOD: f64 = 0.002;

    /// Between two looks for what arrived.
    const LOOK: Duration = Duration::from_micros(50);

    /// For a target.
    const PATIENCE: Duration = Duration::from_millis(250);

    /// For the first target of all robots.
    const DISCOVERY: Duration = Duration::from_secs(10);

    /// Of all rounds of a case together.
    const LONGEST: Duration = Duration::from_secs(10);

    /// From one round's places to the next's [m].
    const STRIDE: f64 = 0.15;

    /// A target is nearer than this to where its robot stands [m].
    const NEAR: f64 = 0.06;

    /// Formations of so many robots, each for so many rounds.
    pub fn measure(effort: &[(usize, usize)]) -> Report {
        let mut report = Report::default();
        for &(robots, rounds) in effort {
            for measured in [steadily(robots, rounds), at_once(robots, rounds)] {
                match measured {
                    Ok(case) => report.cases.push(case),
                    Err(why) => report.skipped = Some(why),
                }
            }
        }
        report
    }

    /// A domain that runs side by side are unlikely to share.
    fn arguments() -> RosArguments {
        let domain = 100 + (std::process::id() % 101) as u16;
        let environment =
            Environment { domain, discovery: DiscoveryRange::Localhost, ..Environment::default() };
        RosArguments { environment, ..RosArguments::default() }
    }

    /// Robots and the node that serves them.
    fn open(robots: usize) -> Result<(Fleet, FormationNode), String> {
        let swarm = formation(robots, 1, PERIOD).map_err(words)?;
        Ok((Fleet::open(&swarm)?, FormationNode::open(&swarm, &arguments(), None).map_err(words)?))
    }

    fn words(error: impl std::fmt::Display) -> String {
        error.to_string()
    }

    /// The node ticks at its own rate in a thread of its own.
    fn steadily(robots: usize, rounds: usize) -> Result<Case, String> {
        let (mut fleet, mut node) = open(robots)?;
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| node.run(&stop));
            let measured = fleet.fly(rounds, &mut || ());
            stop.store(true, Ordering::Relaxed);
            measured.map(|(times, lost)| Case::of(robots, Some(PERIOD), times, lost))
        })
    }

    /// The node ticks whenever the robots look.
    fn at_once(robots: usize, rounds: usize) -> Result<Case, String> {
        let (mut fleet, mut node) = open(robots)?;
        let (times, lost) = fleet.fly(rounds, &mut || node.tick())?;
        Ok(Case::of(robots, None, times, lost))
    }

    /// The robots' side.
    struct Fleet {
        places: Vectors,
        link: Link,
        round: usize,
    }

    impl Fleet {
        fn open(swarm: &Swarm) -> Result<Self, String> {
            let control = Control::new(swarm).map_err(words)?;
            let formation = control.formation();
            let link = Link::open(swarm, formation, &arguments(), Layout::OneNode).map_err(words)?;
            Ok(Self { places: formation.places.clone(), link, round: 0 })
        }

        /// Times from pose to target [s], and how many targets never came.
        fn fly(&mut self, rounds: usize, tick: &mut dyn FnMut()) -> Result<(Vec<f64>, usize), String> {
            let begun = Instant::now();
            let mut known = vec![false; self.places.len()];
            while known.contains(&false) {
                if begun.elapsed() > DISCOVERY {
                    return Err(format!("the participants did not find each other within {DISCOVERY:?}"));
                }
                for (member, time) in self.answers(PATIENCE / 10, tick)? {
                    known[member] |= time.is_some();
                }
            }
            let begun = Instant::now();
            let (mut times, mut lost) = (Vec::new(), 0);
            for round in 0..rounds {
                if begun.elapsed() > LONGEST {
                    break;
                }
                for (_, time) in self.answers(PATIENCE, tick)? {
                    lost += usize::from(time.is_none());
                    times.extend(time);
                }
                // At every phase of the node's loop, and never faster than robots speak.
                let phase = (round * 7 % 16) as f64 / 16.0;
                std::thread::sleep(Duration::from_secs_f64((2.0 + phase) * PERIOD));
            }
            Ok((times, lost))
        }

        /// All say where they are now; each one's time until the target that answers it.
        fn answers(
            &mut self,
            patience: Duration,
            tick: &mut dyn FnMut(),
        ) -> Result<Vec<(usize, Option<f64>)>, String> {
            self.round += 1;
            let aside = STRIDE * (self.round % 4) as f64;
            let count = self.places.len();
            let here: Vectors = self.places.iter().map(|[x, y]| [x, y + aside]).collect();
            let mut sent = Vec::with_capacity(count);
            for member in 0..count {
                let (position, stamp) = (here.get(member), system_time());
                let pose = Pose { position, yaw: 0.0, stamp, frame_is_right: true };
                sent.push(Instant::now());
                self.link.send(stamp, &[(member, pose)]).map_err(words)?;
            }
            let mut answered: Vec<(usize, Option<f64>)> = (0..count).map(|member| (member, None)).collect();
            let begun = Instant::now();
            while begun.elapsed() < patience && answered.iter().any(|(_, time)| time.is_none()) {
                tick();
                self.link.targets(&mut |member, target| {
                    let (here, time) = (here.get(member), &mut answered[member].1);
                    if time.is_none() && (0..2).all(|k| (target[k] - here[k]).abs() < NEAR) {
                        *time = Some(sent[member].elapsed().as_secs_f64());
                    }
                });
                std::thread::sleep(LOOK);
            }
            Ok(answered)
        }
    }
}

#[cfg(all(test, feature = "ros"))]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_answered_by_its_target_or_it_is_said_why_not() {
        let report = measure(&[(2, 5)]);
        let no_network = |why: &String| why.starts_with("no DDS participant");
        assert!(report.skipped.as_ref().map_or(report.cases.len() == 2, no_network), "{report}");
        for case in &report.cases {
            assert_eq!(case.samples + case.lost, 10, "{report}");
            assert!(case.p50_seconds <= case.p99_seconds);
        }
    }
}
