//! The cheapest setting for an accuracy, found without a truth.
//!
//! What the studies show (`flockform trade`): the paper's rule ends at an error that no spacing removes, the
//! material rule's falls with the spacing, and a solver's tolerance a hundredth of the accuracy is not seen
//! in the result. The rule, the tolerance and the precision follow from that (see the scene's
//! validation); what is left is the spacing. It is halved until two bodies agree: where the error falls with
//! the power `p` of the spacing, that of the finer is their distance over `2^p - 1` (L. F. Richardson, 1911).

use std::collections::HashMap;

use super::grid::{RuleChoice, body_overrides};
use super::study::Load;
use crate::compare::run::plan;
use crate::continuum::equilibrium::settle;
use crate::continuum::run::Outcome;
use crate::flock::points::distance;
use crate::flock::role::Role;
use crate::scene::raw::{RawMean, RawRegion};
use crate::scene::{Scene, SceneError};

/// A little below what corners of clamped ends let through; smooth bodies have 2.
const ORDER: f64 = 1.5;

/// Halvings tried before giving up.
const MOST_HALVINGS: u32 = 5;

/// A scene in the setting that was chosen.
#[derive(Debug)]
pub struct Chosen {
    pub scene: Scene,
    /// What was chosen, in words.
    pub words: String,
}

/// Chooses the widest spacing, the written one at most, at which the scene's followers are as near to
/// elasticity as its accuracy asks; a scene without an accuracy is returned as it is. `load` loads `scene`
/// with more overrides.
///
/// # Errors
/// Names what keeps the scene from being refined, or how near it came.
pub fn choose(scene: Scene, load: Load<'_>) -> Result<Chosen, SceneError> {
    let Some(accuracy) = scene.equilibrium.and_then(|asked| asked.accuracy) else {
        return Ok(Chosen { scene, words: String::new() });
    };
    if !matches!(scene.raw.rule.mean, Some(RawMean::Material { .. })) {
        let words = format!("accuracy {} %: the paper's rule at the written spacing\n", 100.0 * accuracy);
        return Ok(Chosen { scene, words });
    }
    let at = |part: f64| {
        let scene = load(&body_overrides(&scene, RuleChoice::Material, part))?;
        let settled = rest(&scene)?;
        Ok::<_, SceneError>((scene, settled))
    };
    // A body too coarse to be one says nothing.
    let mut coarse = at(2.0).ok().map(|(_, settled)| settled);
    let mut nearest = f64::INFINITY;
    for halvings in 0..=MOST_HALVINGS {
        let part = 0.5f64.powi(halvings as i32);
        if halvings > 0 {
            require_refinable(&scene)?;
        }
        let (finer, settled) = at(part)?;
        let apart = coarse.as_ref().and_then(|coarse| apart(coarse, &settled));
        if let Some(apart) = apart {
            nearest = apart / (2f64.powf(ORDER) - 1.0);
            if nearest <= accuracy {
                let words = words(&finer, accuracy, part, nearest);
                return Ok(Chosen { scene: finer, words });
            }
        }
        coarse = Some(settled);
    }
    let message = if nearest.is_finite() {
        format!(
            "the estimated error is still {:.2} % after {MOST_HALVINGS} halvings of the spacing",
            100.0 * nearest
        )
    } else {
        "no two bodies have particles in the same places, so their error cannot be estimated".into()
    };
    let help = "ask for less, write a smaller spacing, or leave the accuracy out and set the tolerance";
    Err(scene.refuse("equilibrium.accuracy", message, help))
}

fn words(scene: &Scene, accuracy: f64, part: f64, estimate: f64) -> String {
    let spacing = match part {
        1.0 => "the written spacing".to_owned(),
        _ => format!("{part} of the written spacing"),
    };
    let request = scene.equilibrium.map(|asked| asked.request).unwrap_or_default();
    format!(
        "accuracy {} %: material rule at {spacing} (estimated error {:.3} %), tolerance {:e}, {:?}\n",
        100.0 * accuracy,
        100.0 * estimate,
        request.tolerance,
        request.precision
    )
}

/// Ids name other particles in a finer body.
fn require_refinable(scene: &Scene) -> Result<(), SceneError> {
    let by_id = |region: &RawRegion| matches!(region, RawRegion::Ids { .. });
    let role = scene.raw.roles.iter().position(|entry| by_id(&entry.region));
    let key = match role {
        Some(k) => format!("roles[{k}].region"),
        None if !scene.record.probes.is_empty() => "record.probes".into(),
        None => return Ok(()),
    };
    let message = "the accuracy takes a finer body, in which these ids are other particles";
    Err(scene.refuse(&key, message, "pick particles by place, write a smaller spacing, or ask for less"))
}

fn rest(scene: &Scene) -> Result<Outcome, SceneError> {
    let request = scene.equilibrium.map(|asked| asked.request).unwrap_or_default();
    settle(scene, &request, plan(scene)?)
}

/// Relative L2 distance of two bodies at the coarse one's followers that the fine one has too; `None` where
/// it has less than half of them.
fn apart(coarse: &Outcome, fine: &Outcome) -> Option<f64> {
    let body = fine.engine.body();
    let grain = 1e-3 * body.lattice.spacing();
    let cell = |p: [f64; 2]| p.map(|v| (v / grain).round() as i64);
    let places: HashMap<[i64; 2], usize> =
        (0..body.count()).map(|i| (cell(body.reference.get(i)), i)).collect();
    let reference = &coarse.engine.body().reference;
    let followers = (0..reference.len()).filter(|&i| coarse.engine.roles()[i] == Role::Follower);
    let (mut off, mut size, mut met, mut all) = (0.0, 0.0, 0usize, 0usize);
    for i in followers {
        all += 1;
        let Some(&j) = places.get(&cell(reference.get(i))) else { continue };
        let (u, v) = (coarse.engine.displacement(i), fine.engine.displacement(j));
        off += distance(u, v).powi(2);
        size += v[0] * v[0] + v[1] * v[1];
        met += 1;
    }
    let enough = all > 0 && 2 * met >= all;
    enough.then(|| if off == 0.0 { 0.0 } else { (off / size).sqrt() })
}
