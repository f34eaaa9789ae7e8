//! Neighbourhoods and weights as words of the command line.

use flockform::flock::lattice::{Lattice, Site};
use flockform::flock::neighbourhood::Neighbourhood;

use super::{WrongOption, number, wrong};

const FORMS: &str = "give first, first:3, chebyshev:1, second, collinear, within:1.5, or offsets in columns and rows, offsets:1,0;-1,0";

/// Farthest a neighbour may be, in spacings: more would be no neighbourhood.
const FARTHEST: f64 = 32.0;

/// Largest offset in columns or rows.
const MOST_STEPS: i32 = 64;

/// Offsets to the neighbours of each sublattice, in summation order.
pub fn neighbourhood(text: &str, lattice: &Lattice) -> Result<Vec<Vec<Site>>, WrongOption> {
    let option = "--neighbours";
    let (kind, value) = text.split_once(':').map_or((text, None), |(kind, value)| (kind, Some(value)));
    let unknown = || wrong(option, format!("`{text}` is no neighbourhood"), FORMS);
    let count = |value: &str, most: u32| match value.parse::<u32>() {
        Ok(count) if (1..=most).contains(&count) => Ok(count),
        _ => Err(wrong(option, format!("`{value}` is not a whole number from 1 to {most}"), FORMS)),
    };
    let neighbourhood = match (kind, value) {
        ("first", None) => Neighbourhood::First { keep: None },
        ("first", Some(keep)) => Neighbourhood::First { keep: Some(count(keep, 6)? as usize) },
        ("chebyshev", None) => Neighbourhood::Chebyshev { radius: 1 },
        ("chebyshev", Some(radius)) => Neighbourhood::Chebyshev { radius: count(radius, 8)? as i32 },
        ("second", None) => Neighbourhood::Second,
        ("collinear", None) => Neighbourhood::Collinear,
        ("within", Some(radius)) => {
            let (radius, most) = (number(option, radius)?, FARTHEST * lattice.spacing());
            if radius > most {
                let message = format!("a radius of {radius} is more than {FARTHEST} spacings");
                return Err(wrong(option, message, format!("give a radius up to {most}")));
            }
            Neighbourhood::Within { radius }
        }
        ("offsets", Some(list)) => Neighbourhood::Offsets(offsets(list)?),
        _ => return Err(unknown()),
    };
    neighbourhood.offsets(lattice).map_err(|error| wrong(option, error.to_string(), FORMS))
}

fn offsets(list: &str) -> Result<Vec<Site>, WrongOption> {
    let mut all: Vec<Site> = Vec::new();
    for pair in list.split(';') {
        let steps =
            pair.split_once(',').and_then(|(i, j)| Some([i.trim().parse().ok()?, j.trim().parse().ok()?]));
        let fits = |offset: &Site| *offset != [0, 0] && offset.iter().all(|step| step.abs() <= MOST_STEPS);
        match steps.filter(fits) {
            Some(offset) if all.contains(&offset) => {
                let message = format!("offset {},{} is given twice", offset[0], offset[1]);
                return Err(wrong("--neighbours", message, "give it once, and its weight with --weights"));
            }
            Some(offset) => all.push(offset),
            None => {
                let message = format!("`{pair}` is not a pair of steps, not both 0, up to {MOST_STEPS} each");
                return Err(wrong("--neighbours", message, FORMS));
            }
        }
    }
    Ok(all)
}

/// Weights of each sublattice in the order of `offsets`.
pub fn weights(text: &str, lattice: &Lattice, offsets: &[Vec<Site>]) -> Result<Vec<Vec<f64>>, WrongOption> {
    if let Some(power) = text.strip_prefix("distance:") {
        let power = number("--weights", power)?;
        let weight = |&offset: &Site| {
            let [x, y] = lattice.vector(offset);
            (x.hypot(y) / lattice.spacing()).powf(power)
        };
        let all: Vec<Vec<f64>> = offsets.iter().map(|offsets| offsets.iter().map(weight).collect()).collect();
        if all.iter().flatten().any(|weight| !weight.is_finite()) {
            let message = format!("the power {power} of a distance does not fit a double");
            return Err(wrong("--weights", message, "give a smaller power"));
        }
        return Ok(all);
    }
    let values = text.split(',').map(|value| number("--weights", value)).collect::<Result<Vec<f64>, _>>()?;
    let size = offsets.first().map_or(0, Vec::len);
    if values.len() != size {
        let message = format!("{} weights are given for {size} neighbours", values.len());
        let help =
            "give one weight for each neighbour, nearest first, equally near ones in opposite pairs by angle";
        return Err(wrong("--weights", message, help));
    }
    Ok(vec![values; offsets.len()])
}
