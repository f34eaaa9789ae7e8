//! Checks of a formation that has been laid out.

use super::Formation;
use crate::flock::rounding::at_most;
use crate::flock::vectors::{Vectors, distance};
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;
use crate::scene::text::number;

/// Robots that a message names.
const MOST_NAMED: usize = 6;

impl Formation {
    /// Members that no leader reaches by links that last, ascending; none where a scene leads, or links do not last.
    pub fn unled(&self) -> Vec<usize> {
        let is_judged = match self.engine().filter(|_| self.is_led_here()) {
            None => false,
            Some(engine) => {
                engine.lasting_neighbours().is_some() || !(0..self.count()).any(|m| self.leads(m))
            }
        };
        if is_judged { self.unreached() } else { Vec::new() }
    }

    /// Members that no leader reaches by the links of now, ascending.
    pub(in crate::swarm) fn unreached(&self) -> Vec<usize> {
        let mut reached: Vec<bool> = (0..self.count()).map(|m| self.leads(m)).collect();
        let mut grows = true;
        while std::mem::take(&mut grows) {
            for m in 0..self.count() {
                if !reached[m] && self.neighbours(m).any(|other| reached[other]) {
                    (reached[m], grows) = (true, true);
                }
            }
        }
        (0..self.count()).filter(|&m| !reached[m]).collect()
    }

    /// The member of a name that stands at `key`.
    ///
    /// # Errors
    /// No member is called so.
    pub fn require(&self, swarm: &Swarm, key: &str, name: &str) -> Result<usize, SceneError> {
        self.number(name).ok_or_else(|| {
            let (first, last) = (&self.names[0], &self.names[self.count() - 1]);
            let message = format!("there is no robot `{name}`: they are called `{first}` to `{last}`");
            swarm.refuse(key, message, "name a robot of this swarm")
        })
    }

    /// Places at which the members start \[m\]: where the file says, else those in the formation.
    ///
    /// # Errors
    /// Names a robot that the swarm does not have.
    pub fn starts(&self, swarm: &Swarm) -> Result<Vectors, SceneError> {
        let mut places = self.places.clone();
        for (k, start) in swarm.raw.flight.start.iter().enumerate() {
            let member = self.require(swarm, &format!("flight.start[{k}].robot"), &start.robot)?;
            places.set(member, start.place);
        }
        Ok(places)
    }

    /// Names of the members that are picked, the first few of them; none where none is.
    pub fn named(&self, is_picked: impl Fn(usize) -> bool) -> Option<String> {
        first_few((0..self.count()).filter(|&m| is_picked(m)).map(|m| format!("`{}`", self.names[m])))
    }
}

/// The first few of these names and how many there are besides; none where there is no name.
pub fn first_few(mut names: impl Iterator<Item = String>) -> Option<String> {
    let shown = names.by_ref().take(MOST_NAMED).collect::<Vec<_>>().join(", ");
    match names.count() {
        _ if shown.is_empty() => None,
        0 => Some(shown),
        more => Some(format!("{shown} and {more} more")),
    }
}

/// Refuses places at which two robots would be closer than the swarm's own limit.
pub fn require_apart(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let Some(clearance) = swarm.raw.limits.clearance else { return Ok(()) };
    for (i, j) in formation.pairs() {
        let needed = formation.radii[i] + formation.radii[j] + clearance;
        let apart = distance(formation.places.get(i), formation.places.get(j));
        if !at_most(needed, apart) {
            let [apart, needed] = [apart, needed].map(rounded);
            let message = format!(
                "the places of `{}` and `{}` are {apart} m apart, and their radii and the clearance need {needed} m",
                formation.names[j], formation.names[i]
            );
            let help = "widen the formation, or lower the clearance or the radius";
            return Err(swarm.refuse("limits.clearance", message, help));
        }
    }
    Ok(())
}

/// A length of which the digits of rounding errors are left out \[m\]: micrometres are kept.
fn rounded(length: f64) -> String {
    let micrometres = (length * 1e6).round();
    number(if micrometres.is_finite() { micrometres / 1e6 } else { length })
}

/// Refuses places where no pose would be believed.
pub fn require_in_range(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let (middle, range) = (formation.middle(), swarm.raw.poses.range);
    let off = |m: usize| distance(formation.places.get(m), middle);
    let farthest = (0..formation.count()).max_by(|&a, &b| off(a).total_cmp(&off(b)));
    match farthest.filter(|&m| !at_most(off(m), range)) {
        None => Ok(()),
        Some(m) => {
            let key = match swarm.raw.robots.len() {
                0 => "poses.range".into(),
                _ => format!("robots[{m}].place"),
            };
            let message = format!(
                "`{}` is {:.4e} m from the formation's middle, and poses farther than poses.range ({range} m) are rejected",
                formation.names[m],
                off(m)
            );
            Err(swarm.refuse(&key, message, "give places nearer to each other, or raise poses.range"))
        }
    }
}

/// Refuses more liars than could ever be outvoted by the robots that measure.
pub fn require_witnesses(swarm: &Swarm, formation: &Formation) -> Result<(), SceneError> {
    let Some(ranges) = &swarm.raw.ranges else { return Ok(()) };
    let others = formation.count().saturating_sub(1);
    if ranges.max_faulty < others {
        return Ok(());
    }
    let message = format!(
        "a pose is contradicted by more robots than this, and there are {others} that could measure it: no lie would ever be \
         found"
    );
    Err(swarm.refuse("ranges.max_faulty", message, "lower it, or leave ranges out"))
}
