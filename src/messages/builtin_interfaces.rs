//! `builtin_interfaces`: time.

use super::messages;

messages! { "builtin_interfaces";
    /// A point in time, since an epoch that the clock chooses.
    #[derive(Copy, Eq, PartialOrd, Ord)]
    Time {
        /// Whole seconds, rounded down.
        sec: i32,
        /// Nanoseconds after them, below 1e9.
        nanosec: u32,
    }

    /// A span of time.
    #[derive(Copy, Eq, PartialOrd, Ord)]
    Duration {
        /// Whole seconds, rounded down.
        sec: i32,
        /// Nanoseconds after them, below 1e9.
        nanosec: u32,
    }
}

impl Time {
    /// From seconds since the epoch, to the nearest nanosecond; beyond what 32 bits hold (the year
    /// 2038) the last second they do, and the epoch for what is no number.
    pub fn from_seconds(seconds: f64) -> Self {
        let whole = seconds.floor();
        let nanoseconds = ((seconds - whole) * 1e9).round();
        // The rounding may have reached the next second. `as` saturates and maps what is no number to 0.
        if nanoseconds >= 1e9 {
            Self { sec: (whole + 1.0) as i32, nanosec: 0 }
        } else {
            Self { sec: whole as i32, nanosec: nanoseconds as u32 }
        }
    }

    /// Seconds since the epoch; in this century exact to about 2e-7 s.
    pub fn seconds(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

impl Duration {
    /// From seconds, to the nearest nanosecond, as [`Time::from_seconds`].
    pub fn from_seconds(seconds: f64) -> Self {
        let Time { sec, nanosec } = Time::from_seconds(seconds);
        Self { sec, nanosec }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_survive_the_way_there_and_back() {
        for seconds in [0.0, 0.25, 1.5, -0.25, -1.0, 1.7e9, 12.000_000_001] {
            assert!((Time::from_seconds(seconds).seconds() - seconds).abs() < 1e-9, "{seconds}");
        }
        assert_eq!(Time::from_seconds(-0.25), Time { sec: -1, nanosec: 750_000_000 });
        assert_eq!(Duration::from_seconds(0.1), Duration { sec: 0, nanosec: 100_000_000 });
    }

    #[test]
    fn nanoseconds_stay_below_a_second() {
        assert_eq!(Time::from_seconds(0.999_999_999_9), Time { sec: 1, nanosec: 0 });
        assert_eq!(Time::from_seconds(1e12).sec, i32::MAX);
        assert_eq!(Time::from_seconds(f64::NAN), Time::default());
        assert!(Time::from_seconds(f64::INFINITY).nanosec < 1_000_000_000);
    }
}
