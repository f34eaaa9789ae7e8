//! Warnings of robots that are not heard.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::swarm::control::{Control, Mode};
use crate::swarm::formation::first_few;

/// Time without a pose after which the log says so.
const PATIENCE: Duration = Duration::from_secs(5);

/// The robots of which no pose has been believed yet, or none that is not too old by now.
#[derive(Clone, Debug, Default)]
pub struct Silence {
    /// By the number of the robot; none of one that is heard.
    missing: BTreeMap<usize, Missing>,
    /// When the last line was written.
    last: Option<Instant>,
    /// Since when none has come at all.
    silent: Option<Instant>,
}

/// A robot that is missing, or has been a moment ago.
#[derive(Clone, Copy, Debug)]
struct Missing {
    since: Instant,
    /// Since when it is heard again.
    heard: Option<Instant>,
    is_said: bool,
}

impl Silence {
    /// Warns once of each of the robots that are to be `heard` and have been missing for some seconds, and again only of one that has
    /// been heard for as long meanwhile. `topic` names those of robots' poses.
    pub fn look(&mut self, control: &Control, heard: &[usize], topic: &dyn Fn(&[usize]) -> String) {
        if let Some(text) = self.text(control, heard, topic, Instant::now()) {
            tracing::warn!("{text}");
        }
    }

    fn text(
        &mut self,
        control: &Control,
        heard: &[usize],
        topic: &dyn Fn(&[usize]) -> String,
        now: Instant,
    ) -> Option<String> {
        let watch = control.watch();
        let is_past = |since: Instant| now.duration_since(since) >= PATIENCE;
        let seconds = PATIENCE.as_secs();
        let has_come = |&m: &usize| watch.counts(m).accepted + watch.counts(m).rejected() > 0;
        if !heard.iter().any(has_come) {
            let is_due = !heard.is_empty() && is_past(*self.silent.get_or_insert(now)) && self.last.is_none();
            return is_due.then(|| {
                self.last = Some(now);
                let topic = topic(heard);
                format!("no pose has come for {seconds} s, on {topic}: no robot is sent a target before")
            });
        }
        for &m in heard {
            if watch.place(m).is_none() || !control.health(m).is_usable() {
                let one = Missing { since: now, heard: None, is_said: false };
                let one = self.missing.entry(m).or_insert(one);
                one.since = if one.heard.take().is_some() { now } else { one.since };
            } else if let Some(one) = self.missing.get_mut(&m)
                && is_past(*one.heard.get_or_insert(now))
            {
                self.missing.remove(&m);
            }
        }
        let gone = |m: &usize| self.missing.get(m).is_some_and(|one| one.heard.is_none());
        let awaited: Vec<usize> = heard
            .iter()
            .copied()
            .filter(|&m| control.formation().leads(m) && watch.place(m).is_none())
            .collect();
        let waits = !control.has_begun() && !awaited.is_empty();
        let is_due = |m: &usize| {
            self.missing.get(m).is_some_and(|one| one.heard.is_none() && !one.is_said && is_past(one.since))
        };
        // Without its leaders nothing moves: the others are of no matter before.
        let due: Vec<usize> =
            heard.iter().copied().filter(is_due).filter(|m| !waits || awaited.contains(m)).collect();
        if due.is_empty() || self.last.is_some_and(|last| !is_past(last)) {
            return None;
        }
        let what = match control.mode() {
            _ if waits => "the programs of the leaders wait, and no robot moves before",
            _ if heard.iter().all(gone) => "no robot is sent a target",
            Mode::Running => "the swarm flies without",
            Mode::EmergencyStopped | Mode::Inactive => "the swarm stands without",
        };
        self.last = Some(now);
        for (m, one) in &mut self.missing {
            one.is_said |= due.contains(m);
        }
        let names = &control.formation().names;
        let of = first_few(due.iter().map(|&m| names[m].clone()))?;
        Some(format!("no pose of {of} has been believed for {seconds} s, on {}: {what}", topic(&due)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::examples::bundled;
    use crate::swarm::watch::Pose;

    #[test]
    fn a_line_names_the_leaders_that_are_waited_for_and_then_the_others() {
        let swarm = bundled("square", &[]);
        let mut control = Control::new(&swarm).expect("laid out");
        let heard: Vec<usize> = (0..25).collect();
        let (mut silence, begun) = (Silence::default(), Instant::now());
        let mut at = |control: &Control, seconds: u64| {
            silence.text(
                control,
                &heard,
                &|of| format!("pose/{}", of[0]),
                begun + Duration::from_secs(seconds),
            )
        };
        assert_eq!((at(&control, 0), at(&control, 4)), (None, None));
        assert!(at(&control, 5).is_some_and(|text| text.starts_with("no pose has come for 5 s, on pose/0:")));
        assert_eq!(at(&control, 60), None, "once");
        let hear = |control: &mut Control, member: usize| {
            let position = control.formation().places.get(member);
            let pose = Pose { position, yaw: 0.0, stamp: 1.0, frame_is_right: true };
            control.receive(member, pose, 1.0).expect("believed");
        };
        let leader = (0..25).find(|&m| control.formation().leads(m)).expect("one leads");
        let follower = (0..25).find(|&m| !control.formation().leads(m)).expect("one follows");
        (0..25).filter(|&m| m != leader && m != follower).for_each(|m| hear(&mut control, m));
        control.tick(1.0);
        assert_eq!((at(&control, 61), at(&control, 65)), (None, None));
        let text = at(&control, 66).expect("a line");
        let names = control.formation().names.clone();
        assert!(text.contains(&format!("no pose of {} has been", names[leader])), "{text}");
        assert!(text.contains("the programs of the leaders wait"), "{text}");
        hear(&mut control, leader);
        control.tick(1.0);
        assert_eq!(at(&control, 70), None);
        let text = at(&control, 75).expect("a line");
        assert!(text.contains(&format!("no pose of {} has been", names[follower])), "{text}");
        assert!(text.contains("flies without"), "{text}");
        hear(&mut control, follower);
        assert_eq!((at(&control, 76), at(&control, 99)), (None, None));
        // One is heard on, and at last none.
        for k in 0..10 {
            let (position, now) = (control.formation().places.get(follower), 8.0 + 0.1 * f64::from(k));
            let _ =
                control.receive(follower, Pose { position, yaw: 0.0, stamp: now, frame_is_right: true }, now);
        }
        control.tick(9.0);
        assert_eq!(at(&control, 100), None);
        let text = at(&control, 105).expect("a line");
        assert!(
            text.contains("and 18 more has been believed for 5 s") && text.contains("flies without"),
            "{text}"
        );
        control.tick(20.0);
        assert_eq!(at(&control, 106), None);
        let text = at(&control, 111).expect("a line");
        assert!(text.contains("no robot is sent a target"), "{text}");
    }
}
