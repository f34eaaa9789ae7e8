//! The part of a formation that outlasts its process: the leaders' motions, and the progress of a scene's program.

use serde::{Deserialize, Serialize};

use super::{Formation, Lead, Seen, TargetSource};
use crate::flock::manoeuvre::{Leg, Manoeuvre, Posture};
use crate::flock::vectors::Vectors;

/// A leader's motion, as in [`Lead`]; the motion itself stays in the swarm file.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub enum LeadSnapshot {
    /// From outside: the place last given \[m\].
    External([f64; 2]),
    /// By the leader's own program.
    Motion {
        /// Time from which on \[s\].
        since: f64,
    },
    /// With the other leaders.
    Manoeuvre {
        /// The motion that they fly.
        manoeuvre: ManoeuvreSnapshot,
        /// Time from which on \[s\].
        since: f64,
    },
}

/// A [`Manoeuvre`] as it is written down: seconds, hold and posture of each leg; a posture is translation, turn,
/// stretch and shear.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct ManoeuvreSnapshot {
    about: [f64; 2],
    from: PostureSnapshot,
    legs: Vec<(f64, f64, PostureSnapshot)>,
}

type PostureSnapshot = ([f64; 2], f64, [f64; 2], [f64; 2]);

fn kept_posture(posture: &Posture) -> PostureSnapshot {
    (posture.translate, posture.rotate, posture.stretch, posture.shear)
}

fn posture((translate, rotate, stretch, shear): PostureSnapshot) -> Posture {
    Posture { translate, rotate, stretch, shear }
}

impl From<&Manoeuvre> for ManoeuvreSnapshot {
    fn from(manoeuvre: &Manoeuvre) -> Self {
        let legs = manoeuvre.legs.iter().map(|leg| (leg.seconds, leg.hold, kept_posture(&leg.posture)));
        Self { about: manoeuvre.about, from: kept_posture(&manoeuvre.from), legs: legs.collect() }
    }
}

impl From<ManoeuvreSnapshot> for Manoeuvre {
    fn from(kept: ManoeuvreSnapshot) -> Self {
        let leg = |(seconds, hold, kept)| Leg { seconds, hold, posture: posture(kept) };
        let legs = kept.legs.into_iter().map(leg).collect();
        Self { about: kept.about, from: posture(kept.from), legs }
    }
}

impl Formation {
    /// By member.
    pub(crate) fn kept_leads(&self) -> Vec<Option<LeadSnapshot>> {
        let kept = |lead: &Lead| match lead {
            Lead::External(place) => LeadSnapshot::External(*place),
            Lead::Motion { since, .. } => LeadSnapshot::Motion { since: *since },
            Lead::Manoeuvre { manoeuvre, since } => {
                LeadSnapshot::Manoeuvre { manoeuvre: manoeuvre.into(), since: *since }
            }
        };
        self.leads.iter().map(|lead| lead.as_ref().map(kept)).collect()
    }

    /// Continues from kept motions after `periods` periods. A motion that does not fit the file is ignored.
    pub fn restore(&mut self, leads: Vec<Option<LeadSnapshot>>, periods: u64) {
        for (lead, kept) in self.leads.iter_mut().zip(leads) {
            match (lead, kept) {
                (Some(lead), Some(LeadSnapshot::Manoeuvre { manoeuvre, since })) => {
                    *lead = Lead::Manoeuvre { manoeuvre: manoeuvre.into(), since };
                }
                (Some(Lead::External(place)), Some(LeadSnapshot::External(kept))) => *place = kept,
                (Some(Lead::Motion { since, .. }), Some(LeadSnapshot::Motion { since: kept })) => {
                    *since = kept
                }
                _ => {}
            }
        }
        // A body that moves by itself has to get to where it was; the rule alone starts from where robots are seen.
        if self.is_scene || !matches!(self.course, TargetSource::Rule { .. }) {
            let none = vec![false; self.count()];
            let (places, mut targets) = (self.places.clone(), Vectors::zeros(self.count()));
            let seen = Seen { present: &places, known: &none };
            (0..periods).for_each(|_| self.advance(&seen, &mut [], 0.0, 1, &mut targets));
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::flock::vectors::distance;
    use crate::swarm::control::{Control, Mode};
    use crate::swarm::examples::{bundled, parsed};
    use crate::swarm::watch::Pose;

    /// Every robot is at its target a period later.
    fn fly(control: &mut Control, periods: std::ops::Range<u32>) {
        for period in periods {
            let now = f64::from(period) * control.period();
            for m in 0..control.formation().count() {
                let position = control.target(m).unwrap_or(control.formation().places.get(m));
                let pose = Pose { position, yaw: 0.0, stamp: now, frame_is_right: true };
                assert_eq!(control.receive(m, pose, now), Ok(()));
            }
            control.tick(now);
        }
    }

    /// It is no longer where the file has it.
    #[test]
    fn a_robot_that_has_fallen_silent_is_kept_clear_of_by_a_loop_that_begins_anew() {
        let text = "title = \"three\"\nradius = 0.2\nlinks = { kind = \"listed\" }\n\
                    robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [0.0, 4.0], neighbours = [\"c\"] }, \
                    { name = \"c\", place = [0.0, 8.0] }]\nleaders = [{ robots = [\"a\", \"c\"], program = { kind = \"external\" } }]\n\
                    limits = { speed = 1.0, clearance = 0.3 }\n";
        let fresh = Control::new(&parsed(text, &[])).expect("valid");
        let mut control = fresh.clone();
        let mut places = [[0.0, 0.0], [3.0, 0.0], [0.0, 8.0]];
        let mut nearest = f64::INFINITY;
        for period in 0..600 {
            let now = f64::from(period) * control.period();
            if period == 20 {
                control.begin_anew(&fresh);
                assert!(control.place_leader(0, [6.0, 0.0]));
            }
            for m in [0, 1, 2].into_iter().filter(|&m| m != 1 || period < 20) {
                let pose = Pose { position: places[m], yaw: 0.0, stamp: now, frame_is_right: true };
                assert_eq!(control.receive(m, pose, now), Ok(()));
            }
            control.tick(now);
            places[0] = control.target(0).expect("heard");
            nearest = distance(places[0], places[1]).min(nearest);
        }
        assert!(nearest >= 0.7 - 1e-9 && places[0][0] > 0.5, "{nearest} m, {places:?}");
    }

    /// In a loop that goes on from another too, which the two then leave in the same place.
    #[test]
    fn leaders_from_outside_are_placed_again_once_a_manoeuvre_has_ended() {
        let text = "title = \"two\"\nradius = 0.2\nlinks = { kind = \"nearest\", count = 1 }\n\
                    robots = [{ name = \"a\", place = [0.0, 0.0] }, { name = \"b\", place = [0.0, 4.0] }]\n\
                    leaders = [{ robots = [\"a\"], program = { kind = \"external\" } }]\n\
                    manoeuvres = [{ name = \"on\", legs = [{ seconds = 2.0, translate = [1.0, 0.0] }] }]\n\
                    limits = { speed = 1.0, clearance = 0.3 }\n";
        let swarm = parsed(text, &[]);
        let mut control = Control::new(&swarm).expect("valid");
        fly(&mut control, 0..10);
        let on = control.formation().manoeuvre("on", control.program_time()).expect("in the file");
        control.begin(&on);
        fly(&mut control, 10..20);
        assert!(!control.place_leader(0, [3.0, 0.0]), "under way");
        let mut another = Control::new(&swarm).expect("valid");
        another.restore(control.kept());
        assert!(!another.place_leader(0, [3.0, 0.0]), "under way");
        assert_eq!(another.formation().moved().collect::<Vec<_>>(), [0], "its topic is heard");
        let led = |control: &Control| control.formation().led_to(0, control.program_time());
        for control in [&mut control, &mut another] {
            fly(control, 20..100);
            assert_eq!(led(control), Some([1.0, 0.0]), "where it was left");
            assert!(control.place_leader(0, [3.0, 0.0]));
            assert!(!control.place_leader(1, [3.0, 4.0]), "it follows");
            assert_eq!(led(control), Some([3.0, 0.0]));
        }
        let mut third = Control::new(&swarm).expect("valid");
        third.restore(control.kept());
        assert_eq!(led(&third), Some([3.0, 0.0]));
    }

    #[test]
    fn a_loop_goes_on_where_another_ended() {
        let swarm = bundled("square", &[]);
        let mut first = Control::new(&swarm).expect("valid");
        fly(&mut first, 0..100);
        let kept = serde_json::to_string(&first.kept()).expect("plain");
        let mut second = Control::new(&swarm).expect("valid");
        second.restore(serde_json::from_str(&kept).expect("what was written"));
        assert!((second.program_time() - first.program_time()).abs() < 1e-12 && second.program_time() > 4.0);
        for m in 0..first.formation().count() {
            let target = first.target(m).expect("heard");
            let pose = Pose { position: target, yaw: 0.0, stamp: 5.0, frame_is_right: true };
            assert_eq!((first.receive(m, pose, 5.0), second.receive(m, pose, 5.0)), (Ok(()), Ok(())));
        }
        first.tick(5.0);
        second.tick(5.0);
        for m in 0..first.formation().count() {
            let (a, b) = (first.wanted(m), second.wanted(m));
            assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9, "{m}: {a:?} {b:?}");
        }
        first.emergency_stop();
        second.restore(first.kept());
        assert_eq!(second.mode(), Mode::EmergencyStopped);
    }
}
