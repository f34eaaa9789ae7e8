//! Degenerate bodies and leaders: coincident leaders, one follower, no leaders, far from the origin.

use super::{AT_REST, Case, End, MATERIAL, OWN, Outcome, SHEET, patch, small, worst};
use crate::flock::rules::{Mean, Rotation};
use crate::flock::vectors::distance;
use crate::scene::{Scene, SceneError};
use crate::study::stability::scaling;
use crate::study::stability::subject::Subject;

const OF_THE_RULE: &str = "a small body of its own with the scene's mean";

/// All of the outline in one point.
const TO_A_POINT: &str = "roles=[{region={kind=\"boundary\"},role=\"leader\",motion={kind=\"affine\",about=[3.0,2.0],\
                          stretch=[0.0,0.0],steps=1}}]";
const ONE_FOLLOWER: &str = r#"body={shape={kind="grid",columns=3,rows=3}}"#;
const NO_LEADERS: &str = "roles=[]";
const IN_TWO: &str = r#"body={shape={kind="rectangle",max=[8.0,3.0]},holes=[{kind="rectangle",min=[3.5,-1.0],max=[4.5,4.0]}]}"#;
const ALONE: &str = r#"body={shape={kind="grid",columns=1,rows=1}}"#;

pub fn cases(scene: &Scene) -> Vec<Case> {
    let mut all = vec![
        Case::new("coincident leaders", OF_THE_RULE, coincident(scene)),
        Case::new("coincident leaders, material", OWN, collapsed(&[SHEET, MATERIAL, AT_REST, TO_A_POINT])),
        Case::new("a body of one follower", OWN, patch(&[ONE_FOLLOWER, "stop.steps=2"], 1e-14)),
        Case::new(
            "a body of one follower, material",
            OWN,
            patch(&[ONE_FOLLOWER, SHEET, MATERIAL, AT_REST], 1e-14),
        ),
        Case::new("one particle and no leader, stepped", OWN, stays(&[ALONE, NO_LEADERS])),
        Case::new("no leaders, stepped", OWN, stays(&[NO_LEADERS])),
        Case::new("no leaders, solved", OWN, stays(&[NO_LEADERS, AT_REST])),
        Case::new("no leaders, material, solved", OWN, stays(&[NO_LEADERS, SHEET, MATERIAL, AT_REST])),
        Case::new("no leaders, thresholds", OWN, thresholds(&[NO_LEADERS])),
        Case::new("followers in a part of their own without leaders", OWN, stays(&[IN_TWO])),
    ];
    for exponent in [9, 12, 15, 17, 300] {
        let anchor = format!("body.anchor=[1e{exponent},-1e{exponent}]");
        let about = format!(
            "roles=[{{region={{kind=\"boundary\"}},role=\"leader\",motion={{kind=\"affine\",about=[1e{exponent},-1e{exponent}],\
             stretch=[1.01,0.995],shear=[0.004,0.002],steps=1}}}}]"
        );
        for (rule, more) in [("", &[][..]), (", material", &[SHEET, MATERIAL, AT_REST])] {
            let overrides = [&[&anchor[..], &about[..], "stop.steps=400"], more].concat();
            let name = format!("1e{exponent} spacings from the origin{rule}");
            all.push(Case::new(name, OWN, patch(&overrides, 1e-6)));
        }
    }
    all
}

/// The scene's mean, without terms, on a small body whose outline is drawn into one point.
fn coincident(scene: &Scene) -> Result<Outcome, SceneError> {
    // A rest offset would keep particles off the point as it keeps them off the mean of their neighbours.
    let rest = if matches!(scene.mean, Mean::Material { .. }) { "balanced" } else { "literal" };
    let rule = &scene.raw.rule;
    let mean = serde_json::json!({ "mean": rule.mean, "weights": rule.weights, "rest": rest });
    let mut overrides = vec![TO_A_POINT.to_owned(), format!("rule={}", scaling::toml(&mean))];
    overrides
        .extend(["lattice", "neighbours", "material"].iter().filter_map(|key| scaling::table(scene, key)));
    // Weights that grow with distance let waves of an undamped synchronous update grow.
    overrides.push("update.order=\"sequential\"".into());
    let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
    if let Mean::Spaced { .. } = scene.mean {
        return near(&overrides);
    }
    // Cells that are drawn into a point have no direction to be turned back by.
    if let Mean::Material { rotation: Rotation::Corotated } = scene.mean {
        return near(&[&overrides[..], &["stop.steps=200"]].concat());
    }
    collapsed(&[&overrides[..], &["stop={steps=20000,tolerance=1e-14}"]].concat())
}

/// Every particle ends in the point.
fn collapsed(overrides: &[&str]) -> Result<Outcome, SceneError> {
    let scene = small(overrides)?;
    let end = End::of(&scene)?;
    let apart = |p: [f64; 2]| distance(p, [3.0, 2.0]) / end.spacing;
    let error = worst(end.present.iter().map(apart));
    Ok(Outcome::judged(error, 1e-9, "every particle ends where the leaders are"))
}

/// A mean that keeps its distance has no such place; it stays within reach.
fn near(overrides: &[&str]) -> Result<Outcome, SceneError> {
    let end = End::of(&small(&[overrides, &["stop.steps=200"]].concat())?)?;
    let reach = 100.0 * end.spacing;
    let error = worst(end.present.iter().map(|p| distance(p, [3.0, 2.0]) / reach));
    Ok(Outcome::judged(error, 1.0, "every particle stays within a hundred spacings"))
}

/// Without leaders no particle moves.
fn stays(overrides: &[&str]) -> Result<Outcome, SceneError> {
    let end = End::of(&small(&[overrides, &["stop.steps=100"]].concat())?)?;
    let error = worst((0..end.reference.len()).map(|i| distance(end.moved(i, end.spacing), [0.0; 2])));
    Ok(Outcome::judged(error, 1e-12, "a body at rest without leaders stays at rest"))
}

fn thresholds(overrides: &[&str]) -> Result<Outcome, SceneError> {
    let subject = Subject::of(&small(overrides)?)?;
    let error = (subject.sweep().radius().radius - 1.0).abs();
    // A spectrum with the eigenvalue 1 has no threshold: an answer would be wrong.
    Ok(Outcome::Wrong {
        error: Some(error),
        within: 0.0,
        check: "a body without clamps and leaders has no threshold".into(),
    })
}
