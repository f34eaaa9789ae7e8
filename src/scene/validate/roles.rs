//! Roles: the leaders, their times and motions.

use std::path::Path;

use super::{Refuse, ordered_box, read_table};
use crate::flock::condition::Condition;
use crate::flock::motion::{Keyframe, Motion};
use crate::flock::region::Region;
use crate::flock::role::Role;
use crate::flock::rules::Axis;
use crate::geometry::portion::{Area, Selection};
use crate::scene::document::problem::SceneError;
use crate::scene::raw::*;
use crate::scene::table::DisplacementTable;
use crate::scene::{LeaderMotion, RoleEntry, SceneRegion};

pub fn role_entry(
    key: &str,
    raw: &RawRoles,
    folder: Option<&Path>,
    refuse: Refuse<'_>,
) -> Result<RoleEntry, SceneError> {
    let role = Role::from(raw.role);
    match (role, &raw.motion) {
        (Role::Leader, None) => {
            let help =
                "add `motion = { kind = \"velocity\", per_step = [0.6, 0.0] }`, or use role = \"clamped\"";
            return Err(refuse(&format!("{key}.role"), "a leader needs a motion".into(), help));
        }
        (Role::Leader, _) | (_, None) => {}
        (_, Some(_)) => {
            let message = format!("a {} has no motion of its own", role.name());
            return Err(refuse(&format!("{key}.motion"), message, "remove it, or use role = \"leader\""));
        }
    }
    let when = raw.when.as_ref().map(|when| condition(key, when, refuse)).transpose()?;
    let motion = raw.motion.as_ref().map(|motion| leader_motion(key, motion, folder, refuse)).transpose()?;
    let axis = raw.axis.map(Axis::from);
    let (led, other, across) = if axis == Some(Axis::Y) { ("y", "x", 0) } else { ("x", "y", 1) };
    let goes_across = match &motion {
        Some(LeaderMotion::Program(motion)) => motion.goes_along(across),
        Some(LeaderMotion::Table { rows, .. }) => rows.go_along(across),
        Some(LeaderMotion::Reference { .. }) | None => false,
    };
    if axis.is_some() && goes_across {
        let message =
            format!("axis = \"{led}\" leads along {led} alone, and the motion goes along {other} too");
        let help = "make the other component of the motion zero, or leave `axis` out";
        return Err(refuse(&format!("{key}.motion"), message, help));
    }
    let region = region(key, &raw.region, refuse)?;
    Ok(RoleEntry { region, role, axis, from: raw.from.max(1), when, motion })
}

pub fn region(key: &str, raw: &RawRegion, refuse: Refuse<'_>) -> Result<SceneRegion, SceneError> {
    Ok(SceneRegion::Known(match raw {
        RawRegion::All {} => Region::All,
        RawRegion::Edge { side, depth: None } => return Ok(SceneRegion::Outermost((*side).into())),
        RawRegion::Edge { side, depth: Some(depth) } => Region::Edge { side: (*side).into(), depth: *depth },
        RawRegion::Box { min, max } => {
            ordered_box(&format!("{key}.region"), *min, *max, refuse)?;
            Region::In(Area::Box { min: *min, max: *max })
        }
        RawRegion::Disc { centre, radius } => Region::In(Area::Disc { centre: *centre, radius: *radius }),
        RawRegion::Ids { ids } => Region::Ids(ids.clone()),
        RawRegion::Boundary {} => Region::Boundary,
        RawRegion::Outline { hole, pieces, angles, between } => {
            return outline_region(key, (*hole, pieces), *angles, *between, refuse).map(SceneRegion::Outline);
        }
    }))
}

fn outline_region(
    key: &str,
    (hole, pieces): (Option<usize>, &[usize]),
    angles: Option<[f64; 2]>,
    between: Option<[[f64; 2]; 2]>,
    refuse: Refuse<'_>,
) -> Result<Selection, SceneError> {
    if let Some([from, to]) = between {
        if hole.is_some() || !pieces.is_empty() || angles.is_some() {
            let message = "the two points say all: hole, pieces and angles cannot go with them".into();
            return Err(refuse(&format!("{key}.region.between"), message, "leave the others out"));
        }
        return Ok(Selection::Between { from, to });
    }
    if hole == Some(0) || pieces.contains(&0) {
        let which = if hole == Some(0) { "hole" } else { "pieces" };
        let message = "holes and pieces are counted from 1".into();
        return Err(refuse(&format!("{key}.region.{which}"), message, "`flockform plan` prints the pieces"));
    }
    if let Some([from, to]) = angles.filter(|[from, to]| from >= to) {
        let message = format!("{from} is not below {to}");
        let help = "give the lower angle first; beyond 360 degrees is allowed: [300, 420]";
        return Err(refuse(&format!("{key}.region.angles"), message, help));
    }
    Ok(Selection::Pieces {
        ring: hole.unwrap_or(0),
        pieces: pieces.iter().map(|piece| piece - 1).collect(),
        angles: angles.map(|angles| angles.map(f64::to_radians)),
    })
}

fn condition(key: &str, raw: &RawWhen, refuse: Refuse<'_>) -> Result<Condition, SceneError> {
    if raw.above.is_none() && raw.below.is_none() {
        let message = "the condition has no bound".into();
        return Err(refuse(&format!("{key}.when"), message, "add `above = VALUE`, `below = VALUE` or both"));
    }
    if let (Some(above), Some(below)) = (raw.above, raw.below)
        && above >= below
    {
        let message = format!("nothing is above {above} and below {below}: the role would never be taken");
        let help = "give the lower bound as above, or two entries, one for each bound";
        return Err(refuse(&format!("{key}.when.above"), message, help));
    }
    Ok(Condition { quantity: raw.quantity.into(), above: raw.above, below: raw.below })
}

fn leader_motion(
    key: &str,
    raw: &RawMotion,
    folder: Option<&Path>,
    refuse: Refuse<'_>,
) -> Result<LeaderMotion, SceneError> {
    Ok(LeaderMotion::Program(match raw {
        RawMotion::Velocity { per_step } => Motion::Velocity { per_step: *per_step },
        RawMotion::Keyframes { frames, interpolation } => {
            if let Some(late) = frames.windows(2).position(|pair| pair[0].step >= pair[1].step) {
                let message =
                    format!("step {} does not come after step {}", frames[late + 1].step, frames[late].step);
                let key = format!("{key}.motion.frames[{}].step", late + 1);
                return Err(refuse(&key, message, "list keyframes by ascending step, each step once"));
            }
            let frame = |f: &RawKeyframe| Keyframe { step: f.step as f64, displacement: f.displacement };
            Motion::Keyframes {
                frames: frames.iter().map(frame).collect(),
                interpolation: (*interpolation).into(),
            }
        }
        RawMotion::Affine { about, rotate, stretch, shear, steps } => Motion::Affine {
            about: *about,
            angle: rotate.to_radians(),
            stretch: *stretch,
            shear: *shear,
            steps: *steps as f64,
        },
        RawMotion::Sinusoid { amplitude, period, phase } => {
            Motion::Sinusoid { amplitude: *amplitude, period: *period, phase: *phase }
        }
        RawMotion::Reference { steps } => return Ok(LeaderMotion::Reference { steps: *steps }),
        RawMotion::Csv { file, scale, steps } => {
            let key = format!("{key}.motion.file");
            let parse = |text: &str| DisplacementTable::parse(text, *scale);
            let rows = read_table((&key, file), folder, refuse, parse)?;
            return Ok(LeaderMotion::Table { rows, steps: *steps });
        }
    }))
}
