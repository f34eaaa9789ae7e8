//! Design of experiments: the runs of a parameter sweep, each a value for every varied key.
//!
//! A design is a function of what is asked for alone: grids count through the last key first, and what is drawn
//! is drawn from a seed. So every process, thread and shard has the same runs under the same numbers.

mod draws;
mod factor;

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use draws::{Draws, latin_column};
pub use factor::{Factor, Level};

use crate::scene::document::is_within;

/// Most runs of a design: their tables are kept in memory.
const MOST_RUNS: usize = 1_000_000;

/// Most values of a design, of all its runs together.
const MOST_VALUES: usize = 8 * MOST_RUNS;

/// Error in the description of a design.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DesignError {
    /// A text that names no key or no values.
    #[error(
        "--vary {text}: {reason}\n  help: give KEY=FROM:TO:COUNT, KEY=FROM:TO:COUNT:log or KEY=[VALUE, ...]; with --samples KEY=FROM:TO"
    )]
    Vary {
        /// The text given.
        text: String,
        /// The fault.
        reason: String,
    },
    /// Two entries that set one key, of which one may be a part of the other.
    #[error(
        "one key is given twice, by --vary {0} and by --vary {1}\n  help: give one list or range per key, of which none is a part of another"
    )]
    Twice(String, String),
    /// More runs than are kept.
    #[error(
        "the sweep has more than {MOST_RUNS} runs, or {MOST_VALUES} values in all of them\n  help: vary fewer keys, take fewer values, or draw --samples"
    )]
    TooMany,
    /// A text that is no shard.
    #[error("--shard {0} is no part of a whole\n  help: give I/N with I from 1 to N, such as 1/4")]
    Shard(String),
}

/// How values are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Sampling {
    /// One from each of as many equal parts of every range, or list, as there are runs
    #[default]
    LatinHypercube,
    /// Independent and uniform
    Random,
}

/// Runs of a sweep, by number from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The varied keys.
    pub factors: Vec<Factor>,
    /// A value for each key in its order, shape \[runs, keys\].
    pub runs: Vec<Vec<Level>>,
}

impl Design {
    /// Every combination of the keys' values; the last key changes from each run to the next.
    ///
    /// # Errors
    /// A key that is given twice, a range without a number of values or with one value twice, or too many runs.
    pub fn grid(factors: Vec<Factor>) -> Result<Self, DesignError> {
        require_distinct(&factors)?;
        // Counted before anything is laid out: what is too much for the memory is refused, not tried.
        let counts: Vec<usize> = factors.iter().map(Factor::count).collect::<Result<_, _>>()?;
        let product = counts.iter().try_fold(1_usize, |product, &count| product.checked_mul(count));
        let count = product.filter(|&runs| fits(runs, factors.len())).ok_or(DesignError::TooMany)?;
        let levels: Vec<Vec<Level>> =
            factors.iter().zip(counts).map(|(one, count)| one.levels(count)).collect::<Result<_, _>>()?;
        let run = |number: usize| {
            let mut rest = number;
            let mut values: Vec<Level> = levels
                .iter()
                .rev()
                .map(|levels| {
                    let level = levels[rest % levels.len()].clone();
                    rest /= levels.len();
                    level
                })
                .collect();
            values.reverse();
            values
        };
        Ok(Self { runs: (0..count).map(run).collect(), factors })
    }

    /// So many runs with values drawn from the keys' ranges and lists; the same seed gives the same runs, and a
    /// key's draws depend on its position among the keys and not on what the others are.
    ///
    /// # Errors
    /// A key that is given twice, a range with a number of values of its own, or too many runs.
    pub fn sampled(
        factors: Vec<Factor>,
        samples: usize,
        sampling: Sampling,
        seed: u64,
    ) -> Result<Self, DesignError> {
        require_distinct(&factors)?;
        factors.iter().try_for_each(Factor::require_open)?;
        if !fits(samples, factors.len()) {
            return Err(DesignError::TooMany);
        }
        let columns = factors.iter().enumerate().map(|(k, factor)| {
            let mut draws = Draws::new(seed, k as u64);
            let parts = match sampling {
                Sampling::Random => (0..samples).map(|_| draws.part()).collect(),
                Sampling::LatinHypercube => latin_column(samples, &mut draws),
            };
            parts.into_iter().map(|part| factor.at(part)).collect::<Vec<Level>>()
        });
        let columns: Vec<Vec<Level>> = columns.collect();
        let run = |number: usize| columns.iter().map(|column| column[number].clone()).collect();
        Ok(Self { runs: (0..samples).map(run).collect(), factors })
    }

    /// The overrides of a run.
    pub fn overrides(&self, number: usize) -> Vec<String> {
        let of = |(factor, level): (&Factor, &Level)| format!("{}={}", factor.key, level.text);
        self.factors.iter().zip(&self.runs[number]).map(of).collect()
    }
}

/// Whether so many runs of so many keys can be kept.
fn fits(runs: usize, keys: usize) -> bool {
    runs <= MOST_RUNS && runs.saturating_mul(keys) <= MOST_VALUES
}

fn require_distinct(factors: &[Factor]) -> Result<(), DesignError> {
    for (k, Factor { key, .. }) in factors.iter().enumerate() {
        let clashes =
            |other: &&Factor| *key == other.key || is_within(key, &other.key) || is_within(&other.key, key);
        if let Some(other) = factors[..k].iter().find(clashes) {
            return Err(DesignError::Twice(other.key.clone(), key.clone()));
        }
    }
    Ok(())
}

/// A part of a sweep's runs: every `of`th one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "WrittenShard")]
pub struct Shard {
    /// From 1.
    pub number: usize,
    /// Number of parts.
    pub of: usize,
}

impl Shard {
    /// All runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    fn new(number: usize, of: usize) -> Option<Self> {
        (1..=of).contains(&number).then_some(Self { number, of })
    }

    /// Whether the shard has this run.
    pub fn has(self, run: usize) -> bool {
        run % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = DesignError;

    fn from_str(text: &str) -> Result<Self, DesignError> {
        let refuse = || DesignError::Shard(text.to_owned());
        let (number, of) = text.split_once('/').ok_or_else(refuse)?;
        let read = |part: &str| part.trim().parse::<usize>().map_err(|_| refuse());
        Self::new(read(number)?, read(of)?).ok_or_else(refuse)
    }
}

/// A shard as a file has it.
#[derive(Deserialize)]
struct WrittenShard {
    number: usize,
    of: usize,
}

impl TryFrom<WrittenShard> for Shard {
    type Error = DesignError;

    fn try_from(WrittenShard { number, of }: WrittenShard) -> Result<Self, DesignError> {
        Self::new(number, of).ok_or_else(|| DesignError::Shard(format!("{number}/{of}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factors(texts: &[&str]) -> Vec<Factor> {
        texts.iter().map(|text| text.parse().unwrap_or_else(|error| panic!("{error}"))).collect()
    }

    fn column(design: &Design, key: usize) -> Vec<&str> {
        design.runs.iter().map(|run| run[key].text.as_str()).collect()
    }

    #[test]
    fn a_grid_has_every_combination_with_the_last_key_first() {
        let grid = Design::grid(factors(&["a.b=0.1:0.5:3", "frame=[lagged, \"mirror\"]"])).unwrap();
        assert_eq!(column(&grid, 0), ["0.1", "0.1", "0.3", "0.3", "0.5", "0.5"]);
        assert_eq!(
            column(&grid, 1),
            ["lagged", "\"mirror\"", "lagged", "\"mirror\"", "lagged", "\"mirror\""]
        );
        assert_eq!(grid.overrides(3), ["a.b=0.3", "frame=\"mirror\""]);
    }

    #[test]
    fn whole_numbers_are_written_as_integers_and_logarithmic_ranges_by_their_ratios() {
        assert_eq!(
            column(&Design::grid(factors(&["stop.steps=10:40:4"])).unwrap(), 0),
            ["10", "20", "30", "40"]
        );
        let decades = Design::grid(factors(&["material.young=1e-3:1e9:5:log", "k=1e-3:1e4:8:log"])).unwrap();
        let of_tens = |key: usize, step: usize| -> Vec<&str> {
            column(&decades, key).into_iter().step_by(step).take(5).collect()
        };
        assert_eq!(of_tens(0, 8), ["0.001", "1", "1000", "1000000", "1000000000"]);
        assert_eq!(of_tens(1, 1), ["0.001", "0.01", "0.1", "1", "10"]);
        let even = Design::grid(factors(&["k=-0.3:0.3:7"])).unwrap();
        assert_eq!(column(&even, 0), ["-0.3", "-0.2", "-0.1", "0", "0.1", "0.2", "0.3"]);
        let across = Design::grid(factors(&["k=-0.7:0.3:11"])).unwrap();
        assert_eq!(column(&across, 0)[6..9], ["-0.1", "0", "0.1"]);
        let log = Design::grid(factors(&["k=1e-4:1:5:log"])).unwrap();
        let values: Vec<f64> = log.runs.iter().map(|run| run[0].number.unwrap()).collect();
        for (value, expected) in values.iter().zip([1e-4, 1e-3, 1e-2, 0.1, 1.0]) {
            assert!((value / expected - 1.0).abs() < 1e-12, "{values:?}");
        }
        assert_eq!(column(&Design::grid(factors(&["k=2.5:9:1"])).unwrap(), 0), ["2.5"]);
    }

    #[test]
    fn keys_that_take_whole_numbers_get_them() {
        let whole = |key: &str, start: f64| key == "stop.steps" && start == 100.0;
        let of = |texts: &[&str]| -> Vec<Factor> {
            factors(texts).into_iter().map(|one| one.in_whole_numbers(whole)).collect()
        };
        let grid = Design::grid(of(&["stop.steps=100:200:4", "a=0:1:4"])).unwrap();
        assert_eq!(grid.overrides(6), ["stop.steps=133", "a=0.6666666666666666"]);
        // A range between others is of a key that takes those.
        assert_eq!(column(&Design::grid(of(&["stop.steps=100:200.5:3"])).unwrap(), 0)[1], "150.25");
        let error = Design::grid(of(&["stop.steps=100:102:6"])).expect_err("the same twice").to_string();
        assert!(error.contains("two of its 6 values are 100: take fewer"), "{error}");
    }

    #[test]
    fn all_whole_numbers_of_a_range_are_drawn_as_often() {
        for (text, sampling, off) in [
            ("k=1:4", Sampling::LatinHypercube, 0),
            ("k=4:1", Sampling::LatinHypercube, 0),
            ("k=-2:1", Sampling::Random, 50),
        ] {
            let factor = text.parse::<Factor>().expect("a factor").in_whole_numbers(|_, _| true);
            let design = Design::sampled(vec![factor], 1200, sampling, 0).unwrap();
            let mut counts = std::collections::BTreeMap::new();
            column(&design, 0).into_iter().for_each(|value| *counts.entry(value).or_insert(0_i32) += 1);
            assert!(
                counts.len() == 4 && counts.values().all(|n| (n - 300).abs() <= off),
                "{text}: {counts:?}"
            );
        }
        // By ratios, from one to two has as much as from two to four.
        let factor = "k=1:3:log".parse::<Factor>().expect("a factor").in_whole_numbers(|_, _| true);
        let design = Design::sampled(vec![factor], 1000, Sampling::LatinHypercube, 0).unwrap();
        let ones = column(&design, 0).into_iter().filter(|value| *value == "1").count();
        assert_eq!(ones, 500);
    }

    #[test]
    fn the_values_of_a_list_may_be_lists_and_tables() {
        let grid = Design::grid(factors(&["v=[[0.1, 0], { kind = \"a,b\" }, x]"])).unwrap();
        assert_eq!(column(&grid, 0), ["[0.1, 0]", "{ kind = \"a,b\" }", "x"]);
    }

    #[test]
    fn a_latin_hypercube_has_one_run_in_each_part_of_each_key() {
        let draw = |seed| {
            Design::sampled(factors(&["a=0:10", "b=1:100:log"]), 50, Sampling::LatinHypercube, seed).unwrap()
        };
        let design = draw(7);
        let parts = |key: usize, part: &dyn Fn(f64) -> f64| {
            let mut found: Vec<usize> =
                design.runs.iter().map(|run| (50.0 * part(run[key].number.unwrap())) as usize).collect();
            found.sort_unstable();
            found
        };
        let all: Vec<usize> = (0..50).collect();
        assert_eq!(parts(0, &|value| value / 10.0), all);
        assert_eq!(parts(1, &|value| value.log10() / 2.0), all);
        assert_eq!(draw(7), design);
        assert_ne!(draw(8), design);
        // Ranks of the two keys are not those of each other: the correlation is far from 1.
        let middle = |key: usize| move |run: &Vec<Level>| run[key].number.unwrap();
        let (a, b): (Vec<f64>, Vec<f64>) =
            design.runs.iter().map(|run| (middle(0)(run) - 5.0, middle(1)(run).log10() - 1.0)).unzip();
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        assert!(dot(&a, &b).abs() < 0.5 * (dot(&a, &a) * dot(&b, &b)).sqrt());
    }

    #[test]
    fn a_keys_draws_do_not_depend_on_the_other_keys() {
        let one = Design::sampled(factors(&["a=0:1"]), 9, Sampling::Random, 3).unwrap();
        let two = Design::sampled(factors(&["a=0:1", "b=[x, y]"]), 9, Sampling::Random, 3).unwrap();
        assert_eq!(column(&one, 0), column(&two, 0));
        assert!(column(&two, 1).contains(&"x") && column(&two, 1).contains(&"y"));
    }

    #[test]
    fn shards_part_the_runs() {
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].iter().map(|text| text.parse().unwrap()).collect();
        for run in 0..10 {
            assert_eq!(shards.iter().filter(|shard| shard.has(run)).count(), 1, "{run}");
        }
        for wrong in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
        let read = |text: &str| serde_json::from_str::<Shard>(text);
        assert_eq!(read("{\"number\":2,\"of\":3}").expect("a part"), shards[1]);
        assert!(read("{\"number\":1,\"of\":0}").is_err() && read("{\"number\":0,\"of\":2}").is_err());
    }

    #[test]
    fn what_is_no_variation_is_refused_with_its_text() {
        for wrong in [
            "a",
            "=1:2:3",
            "a=",
            "a=1",
            "a=1:2:0",
            "a=1:x:3",
            "a=1:2:3:4",
            "a=[1,2",
            "a=[1,,2]",
            "a=[]",
            "a=0:1:3:log",
            "a=1:inf:3",
            "a=1:2:9999999",
        ] {
            let error = wrong.parse::<Factor>().expect_err(wrong).to_string();
            assert!(error.contains(&format!("--vary {wrong}: ")), "{error}");
        }
        let refused = |design: Result<Design, DesignError>| design.expect_err("refused").to_string();
        assert!(refused(Design::grid(factors(&["a=1:2"]))).contains("number of values is missing"));
        assert!(refused(Design::grid(factors(&["a=1:2:3", "a=[1]"]))).contains("twice"));
        for [one, other] in [
            ["update=[{damping=0.5}]", "update.damping=[0.6]"],
            ["update.damping=[0.6]", "update=[{damping=0.5}]"],
            ["update.damping=[0.6]", "update . damping=[0.5]"],
            ["update.damping=[0.6]", "update.\"damping\"=[0.5]"],
            ["roles[1].motion=[1]", "roles[01].motion.kind=[2]"],
            ["roles[1].motion=[1]", "roles.1.motion=[2]"],
        ] {
            assert!(refused(Design::grid(factors(&[one, other]))).contains("twice"), "{one} {other}");
        }
        assert!(
            Design::grid(factors(&["roles[1].from=[1]", "roles[2].from=[2]", "roles[1].until=[3]"])).is_ok()
        );
        assert!(refused(Design::grid(factors(&["a=0:1:2000", "b=0:1:2000"]))).contains("more than"));
        // A thousand values of each of nine keys would not fit into memory before they are counted.
        let many = |count: &str| -> Vec<Factor> {
            (0..9).map(|k| format!("k{k}=0:1{count}").parse().expect("a factor")).collect()
        };
        assert!(refused(Design::grid(many(":1000"))).contains("more than"));
        assert!(refused(Design::sampled(many(""), MOST_RUNS, Sampling::Random, 0)).contains("more than"));
        let counted = Design::sampled(factors(&["a=0:1:5"]), 3, Sampling::Random, 0);
        assert!(refused(counted).contains("--samples"));
    }

    #[test]
    fn a_list_is_split_as_toml_has_it() {
        let of = |text: &str| {
            let design = Design::grid(factors(&[text])).expect("a grid");
            design.runs.iter().map(|run| run[0].text.clone()).collect::<Vec<_>>()
        };
        assert_eq!(
            of(r#"a=["p", "a \" b", "q \" r", 'z\', x]"#),
            ["\"p\"", r#""a \" b""#, r#""q \" r""#, r"'z\'", "x"]
        );
        assert_eq!(of("a=[[1, 2,], [3],]"), ["[1, 2,]", "[3]"]);
    }
}
