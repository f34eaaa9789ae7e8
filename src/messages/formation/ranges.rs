//! Ranges as messages.

use std::collections::HashMap;

use crate::messages::builtin_interfaces::Time;
use crate::messages::flockform_msgs::Ranges;
use crate::messages::std_msgs::Header;
use crate::swarm::watch::Range;

/// The messages of ranges, by their observers; ranges of one observer and stamp stand together.
pub fn messages<'a>(
    ranges: &'a [Range],
    names: &'a [String],
    frame_id: &'a str,
) -> impl Iterator<Item = (usize, Ranges)> + 'a {
    let together = |a: &Range, b: &Range| a.observer == b.observer && a.stamp == b.stamp;
    ranges.chunk_by(together).map(move |some| {
        let header = Header { stamp: Time::from_seconds(some[0].stamp), frame_id: frame_id.to_owned() };
        let robots = some.iter().map(|range| names[range.of].clone()).collect();
        let distances = some.iter().map(|range| range.distance).collect();
        (some[0].observer, Ranges { header, robots, distances })
    })
}

/// The robots by their names. A message may have any number of names, and each is looked up in less time than it takes to
/// decode.
pub type Numbers = HashMap<String, usize>;

/// The numbers of robots that have these names.
pub fn numbers(names: &[String]) -> Numbers {
    names.iter().cloned().zip(0..).collect()
}

/// The ranges in an observer's message, of the robots that have numbers, the first of each. A message without a stamp was
/// measured when it arrived \[s\].
pub fn ranges<'a>(
    message: &'a Ranges,
    observer: usize,
    numbers: &'a Numbers,
    arrival: f64,
) -> impl Iterator<Item = Range> + 'a {
    let stamped = message.header.stamp.seconds();
    let stamp = if stamped == 0.0 { arrival } else { stamped };
    let mut is_measured = vec![false; numbers.len()];
    message.robots.iter().zip(&message.distances).filter_map(move |(robot, &distance)| {
        let of = *numbers.get(robot)?;
        let is_first = !std::mem::replace(&mut is_measured[of], true);
        is_first.then_some(Range { observer, of, distance, stamp })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Vec<String> {
        ["a", "b", "c"].map(str::to_owned).into()
    }

    #[test]
    fn ranges_come_back_from_their_messages() {
        let range = |observer, of, stamp| Range { observer, of, distance: 0.1 + of as f64, stamp };
        let all = [range(0, 1, 2.5), range(0, 2, 2.5), range(0, 1, 3.0), range(2, 0, 3.0)];
        let names = names();
        let sent: Vec<_> = messages(&all, &names, "map").collect();
        assert_eq!(sent.iter().map(|(observer, _)| *observer).collect::<Vec<_>>(), [0, 0, 2]);
        let numbers = numbers(&names);
        let back = sent.iter().flat_map(|(observer, message)| ranges(message, *observer, &numbers, 9.0));
        assert_eq!(back.collect::<Vec<_>>(), all);
    }

    #[test]
    fn a_message_of_any_length_and_any_names_gives_at_most_a_range_a_robot() {
        let stranger = ["b", "stranger", "c"].map(str::to_owned).to_vec();
        let unstamped = Ranges { robots: stranger, distances: vec![1.0, 2.0], ..Ranges::default() };
        let numbers = numbers(&names());
        let of: Vec<_> = ranges(&unstamped, 0, &numbers, 9.0).map(|r| (r.of, r.distance, r.stamp)).collect();
        assert_eq!(of, [(1, 1.0, 9.0)]);
        let flood =
            Ranges { robots: vec!["b".into(); 100_000], distances: vec![1.0; 100_000], ..Ranges::default() };
        assert_eq!(ranges(&flood, 0, &numbers, 9.0).count(), 1);
    }

    #[test]
    fn robots_behind_any_number_of_strangers_are_measured() {
        let mut robots: Vec<_> = (0..1_000_000).map(|k| format!("stranger_{k}")).collect();
        robots.extend(["c", "b"].map(str::to_owned));
        let mut distances = vec![1.0; robots.len()];
        distances[1_000_000] = 2.5;
        let message = Ranges { robots, distances, ..Ranges::default() };
        let of: Vec<_> = ranges(&message, 0, &numbers(&names()), 9.0).map(|r| (r.of, r.distance)).collect();
        assert_eq!(of, [(2, 2.5), (1, 1.0)]);
    }
}
