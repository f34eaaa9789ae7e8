//! The scene in other units of length, from the smallest numbers to the largest.

use super::{Case, End, Load, Outcome, THE_SCENE, plan};
use crate::flock::neighbourhood::Neighbourhood;
use crate::scene::raw::RawMotion;
use crate::scene::{Scene, SceneError};
use crate::study::stability::scaling;

/// Steps after which both are looked at.
const STEPS: usize = 60;

pub fn cases(load: Load<'_>, scene: &Scene) -> Vec<Case> {
    let from_file = scene.raw.roles.iter().any(|r| matches!(r.motion, Some(RawMotion::Csv { .. })));
    if from_file {
        let message = "leaders' places are read from a file, which is in the scene's own unit".to_owned();
        let outcome = Outcome::Refused { message };
        return vec![Case::new("the scene in other units", THE_SCENE, Ok(outcome))];
    }
    let steps = format!("stop.steps={}", scene.stop.steps.min(STEPS));
    let base = load(std::slice::from_ref(&steps)).and_then(|scene| End::of(&scene));
    let spacing = scene.lattice.spacing();
    let asked = [
        ("coordinates times 1e-150", 1e-150),
        ("coordinates times 1e150", 1e150),
        ("spacing 1e-9", 1e-9 / spacing),
        ("spacing 1e9", 1e9 / spacing),
        ("spacing 1e-310, a subnormal number", 1e-310 / spacing),
        ("spacing 1e-320, a subnormal number", 1e-320 / spacing),
        ("spacing 1e300", 1e300 / spacing),
        ("spacing 1e308, at the end of the doubles", 1e308 / spacing),
    ];
    let case = |(name, factor): (&str, f64)| {
        let outcome = match &base {
            Ok(base) => scaled(load, scene, &steps, factor, base),
            Err(error) => Err(error.clone()),
        };
        Case::new(name, THE_SCENE, outcome)
    };
    asked.into_iter().map(case).collect()
}

fn scaled(
    load: Load<'_>,
    scene: &Scene,
    steps: &str,
    factor: f64,
    base: &End,
) -> Result<Outcome, SceneError> {
    // Dynamic neighbours depend on the last digit of a distance: only a power of two keeps it.
    let present = matches!(scene.neighbourhood, Neighbourhood::Dynamic { .. });
    let factor = if present { factor.log2().round().exp2() } else { factor };
    let mut overrides = scaling::overrides(scene, factor);
    overrides.push(steps.to_owned());
    let scaled = load(&overrides)?;
    plan(&scaled)?;
    let end = End::of(&scaled)?;
    let check = if present {
        "the scene in its own unit does the same; by the nearest power of two, since neighbours are found anew"
    } else {
        "the scene in its own unit does the same"
    };
    // As far as the solver itself says that it knows.
    let within = f64::max(1e-9, 2.0 * end.known_to);
    Ok(Outcome::judged(base.apart_from(&end, factor), within, check))
}
