//! How programs of the swarm lead a formation: by motions of each leader, by manoeuvres of all, and from outside.

use super::Formation;
use crate::flock::manoeuvre::{Affine, Manoeuvre, Posture};
use crate::flock::motion::Motion;
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::point::{minus, plus};
use crate::scene::swarm::NamedManoeuvre;

/// The motion of a leader.
#[derive(Clone, Debug)]
pub enum Lead {
    /// From outside: the place last given, at first its nominal place.
    External([f64; 2]),
    /// From the time `since` on \[s\].
    Motion {
        /// Displacements from the nominal place \[m\].
        motion: Motion,
        /// Time at which it begins.
        since: f64,
    },
    /// With the other leaders, from the time `since` on \[s\].
    Manoeuvre {
        /// Postures of the formation as a whole.
        manoeuvre: Manoeuvre,
        /// Time at which it begins.
        since: f64,
    },
}

impl Formation {
    /// Leaders that the file has moved from outside.
    pub fn moved(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count()).filter(|&m| self.is_moved[m])
    }

    /// Gives a leader that is moved from outside a new place \[m\] at `now` \[s\]; false for any other member, and during a
    /// manoeuvre.
    pub fn place_leader(&mut self, member: usize, place: [f64; 2], now: f64) -> bool {
        if member >= self.leads.len() {
            return false;
        }
        if let Some(Lead::External(moved)) = &mut self.leads[member] {
            *moved = place;
            return true;
        }
        self.is_moved[member] && !self.is_on_manoeuvre(member, now) && self.take_over(member, place, now)
    }

    /// Whether a manoeuvre moves a leader at `now` \[s\].
    pub(in crate::swarm) fn is_on_manoeuvre(&self, member: usize, now: f64) -> bool {
        matches!(&self.leads[member],
            Some(Lead::Manoeuvre { manoeuvre, since }) if now < since + manoeuvre.duration())
    }

    /// Sends a leader to a place \[m\] from `now` \[s\] on, moved from outside; false for a member that no program of the swarm
    /// leads.
    pub(crate) fn take_over(&mut self, member: usize, place: [f64; 2], now: f64) -> bool {
        let is_led = self.leads[member].is_some();
        if is_led {
            self.leads[member] = Some(Lead::External(place));
            self.taken_over = now;
        }
        is_led
    }

    /// The entry of the file's `leaders` that leads a member.
    pub fn entry(&self, member: usize) -> Option<usize> {
        self.entries[member]
    }

    pub(super) fn let_lead(&mut self, leads: Vec<Option<(usize, Lead)>>) {
        let split =
            |lead: Option<(usize, Lead)>| lead.map_or((None, None), |(k, lead)| (Some(k), Some(lead)));
        (self.entries, self.leads) = leads.into_iter().map(split).unzip();
        self.is_moved = self.leads.iter().map(|lead| matches!(lead, Some(Lead::External(_)))).collect();
    }

    /// How a program of the swarm leads a member.
    pub(in crate::swarm) fn lead(&self, member: usize) -> Option<&Lead> {
        self.leads[member].as_ref()
    }

    /// Whether a program of the swarm leads a member.
    pub fn is_led(&self, member: usize) -> bool {
        self.leads[member].is_some()
    }

    /// Moves all leaders by a manoeuvre from `now` \[s\] on.
    pub fn begin(&mut self, manoeuvre: &Manoeuvre, now: f64) {
        for lead in self.leads.iter_mut().flatten() {
            *lead = Lead::Manoeuvre { manoeuvre: manoeuvre.clone(), since: now };
        }
    }

    /// The manoeuvre of this name, from the nominal places or from the posture in which the leaders are.
    pub fn manoeuvre(&self, name: &str, now: f64) -> Option<Manoeuvre> {
        let NamedManoeuvre { about, legs, .. } = self.manoeuvres.iter().find(|one| one.name == name)?;
        let about = about.unwrap_or_else(|| self.middle());
        Some(Manoeuvre { about, from: self.posture(about, now), legs: legs.clone() })
    }

    /// The posture about this point in which leaders on a manoeuvre are, or nearest to where others are led.
    pub fn posture(&self, about: [f64; 2], now: f64) -> Posture {
        let under_way = self.leads.iter().flatten().find_map(|lead| match lead {
            Lead::Manoeuvre { manoeuvre, since } => {
                Some(manoeuvre.posture(now - since).about(about, manoeuvre.about))
            }
            _ => None,
        });
        let led = || -> Vec<_> {
            (0..self.count()).filter_map(|m| Some((self.places.get(m), self.led_to(m, now)?))).collect()
        };
        under_way.unwrap_or_else(|| match led() {
            led if led.iter().all(|(place, to)| place == to) => Posture::NOMINAL,
            led => Posture::fitted(about, &led),
        })
    }

    /// The affine motion of the formation at `now`, where all its leaders follow one.
    pub fn affine(&self, now: f64) -> Option<Affine> {
        let mut leads = self.leads.iter().flatten();
        let of = |lead: &Lead| match lead {
            Lead::Manoeuvre { manoeuvre, since } => Some(manoeuvre.affine(now - since)),
            _ => None,
        };
        let first = of(leads.next()?)?;
        leads.all(|lead| of(lead) == Some(first)).then_some(first)
    }

    /// The end of the last program of the swarm's leaders, or when one of them was last sent to a place instead \[s\]. Of a scene's
    /// own program it knows nothing.
    pub fn programs_end(&self) -> f64 {
        let end = |lead: &Lead| match lead {
            Lead::External(_) => 0.0,
            Lead::Motion { motion: Motion::Keyframes { frames, .. }, since } => {
                since + frames.last().map_or(0.0, |frame| frame.step)
            }
            Lead::Motion { .. } => f64::INFINITY,
            Lead::Manoeuvre { manoeuvre, since } => since + manoeuvre.duration(),
        };
        self.leads.iter().flatten().map(end).fold(self.taken_over, f64::max)
    }

    /// The place of a leader at `time` by its program \[m\].
    pub(in crate::swarm) fn led_to(&self, member: usize, time: f64) -> Option<[f64; 2]> {
        let place = self.places.get(member);
        Some(match self.leads[member].as_ref()? {
            Lead::External(moved) => *moved,
            Lead::Motion { motion, since } => plus(place, motion.displacement(time - since, 0, place)),
            Lead::Manoeuvre { manoeuvre, since } => manoeuvre.affine(time - since).apply(place),
        })
    }

    /// Each member's place \[m\] where all leaders are sent the same way from theirs by `time` \[s\].
    pub fn moved_together(&self, time: f64) -> Option<Vectors> {
        let by = |m: usize| Some(minus(self.led_to(m, time)?, self.places.get(m)));
        let mut all = (0..self.count()).filter_map(by);
        let first = all.next()?;
        let rounding = 1e-9 * (distance(first, [0.0; 2]) + self.spacing);
        all.all(|way| distance(way, first) <= rounding)
            .then(|| self.places.iter().map(|place| plus(place, first)).collect())
    }
}
