//! Warnings of robots that are not heard.

use std::time::{Duration, Instant};

use crate::swarm::control::Control;
use crate::swarm::formation::first_few;

/// Time without a pose after which the log says so.
const PATIENCE: Duration = Duration::from_secs(5);

/// The robots of which no pose has been believed yet, or none that is not too old by now.
#[derive(Clone, Debug, Default)]
pub struct Silence {
    missing: Vec<usize>,
    /// Since when it is these.
    since: Option<Instant>,
    is_said: bool,
}

impl Silence {
    /// Warns once where the same of the robots that are `heard` have been missing for some seconds. `topic` names those of
    /// robots' poses.
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
        let is_heard = |m: usize| watch.place(m).is_some() && control.health(m).is_usable();
        let missing = heard.iter().copied().filter(|&m| !is_heard(m));
        if self.since.is_none() || !missing.clone().eq(self.missing.iter().copied()) {
            *self = Self { missing: missing.collect(), since: Some(now), is_said: false };
        }
        let since = self.since?;
        if self.is_said || self.missing.is_empty() || now.duration_since(since) < PATIENCE {
            return None;
        }
        self.is_said = true;
        let seconds = PATIENCE.as_secs();
        let has_come = |&m: &usize| watch.counts(m).accepted + watch.counts(m).rejected() > 0;
        if !heard.iter().any(has_come) {
            return Some(format!(
                "no pose has come for {seconds} s, on {}: no robot is sent a target before",
                topic(heard)
            ));
        }
        let (leaders, followers): (Vec<usize>, Vec<usize>) =
            self.missing.iter().partition(|&&m| control.formation().leads(m));
        let (robots, what) = match (control.has_begun(), leaders.is_empty()) {
            _ if self.missing == heard => (self.missing.clone(), "no robot is sent a target"),
            (false, false) => (leaders, "the programs of the leaders wait, and no robot moves before"),
            (true, false) => (self.missing.clone(), "the swarm flies without"),
            (_, true) => (followers, "the swarm flies without"),
        };
        let names = &control.formation().names;
        let of = first_few(robots.iter().map(|&m| names[m].clone()))?;
        Some(format!("no pose of {of} has been believed for {seconds} s, on {}: {what}", topic(&robots)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::bundled::bundled_swarm;
    use crate::swarm::watch::Pose;

    #[test]
    fn a_line_names_the_leaders_that_are_waited_for_and_then_the_others() {
        let swarm = bundled_swarm("square").expect("bundled").load_swarm(&[]).expect("loads");
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
