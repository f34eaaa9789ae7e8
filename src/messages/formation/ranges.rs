//! Ranges as messages.

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

/// The ranges in an observer's message, of the robots that have these names, at most one of each. A message without a
/// stamp was measured when it arrived \[s\].
pub fn ranges<'a>(
    message: &'a Ranges,
    observer: usize,
    names: &'a [String],
    arrival: f64,
) -> impl Iterator<Item = Range> + 'a {
    let stamped = message.header.stamp.seconds();
    let stamp = if stamped == 0.0 { arrival } else { stamped };
    // Of others no swarm has more than names; a message may promise any number.
    message.robots.iter().zip(&message.distances).take(names.len()).filter_map(move |(robot, &distance)| {
        let of = names.iter().position(|name| name == robot)?;
        Some(Range { observer, of, distance, stamp })
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
        let back = sent.iter().flat_map(|(observer, message)| ranges(message, *observer, &names, 9.0));
        assert_eq!(back.collect::<Vec<_>>(), all);
    }

    #[test]
    fn a_message_of_any_length_and_any_names_gives_at_most_a_range_a_robot() {
        let stranger = ["b", "stranger", "c"].map(str::to_owned).to_vec();
        let unstamped = Ranges { robots: stranger, distances: vec![1.0, 2.0], ..Ranges::default() };
        let of: Vec<_> = ranges(&unstamped, 0, &names(), 9.0).map(|r| (r.of, r.distance, r.stamp)).collect();
        assert_eq!(of, [(1, 1.0, 9.0)]);
        let flood =
            Ranges { robots: vec!["b".into(); 100_000], distances: vec![1.0; 100_000], ..Ranges::default() };
        assert_eq!(ranges(&flood, 0, &names(), 9.0).count(), 3);
    }
}
