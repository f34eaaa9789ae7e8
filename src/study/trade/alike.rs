//! Whether bodies of other spacings are held and pushed alike.

use crate::continuum::layout::Layout;
use crate::flock::region::Region;
use crate::flock::vectors::distance;
use crate::geometry::point::bounds;
use crate::scene::{Load, Scene, SceneError, SceneRegion};

/// A key, and from where to where the particles are that it picks \[length\].
pub(super) type Extent = (String, [[f64; 2]; 2]);

/// The roles that particles take by place.
///
/// # Errors
/// Names a region that holds none.
pub(super) fn extents_of_roles(scene: &Scene, layout: &Layout) -> Result<Vec<Extent>, SceneError> {
    let by_place =
        |region: &SceneRegion| matches!(region, SceneRegion::Known(Region::In(_) | Region::Edge { .. }));
    let by_place = scene.roles.iter().enumerate().filter(|(_, entry)| by_place(&entry.region));
    by_place
        .map(|(k, entry)| {
            let particles = layout.pick(scene, &format!("roles[{k}]"), &entry.region)?;
            let (low, high) = bounds(particles.iter().map(|&i| layout.body.reference.get(i)));
            Ok((format!("roles[{k}].region"), [low, high]))
        })
        .collect()
}

/// The first key that picks other places of one body than of another, and from where to where.
pub(super) fn held_elsewhere(before: &[Extent], now: &[Extent], spacing: f64) -> Option<(String, String)> {
    let apart =
        |(a, b): &(&Extent, &Extent)| [0, 1].iter().any(|&k| distance(a.1[k], b.1[k]) > 1e-6 * spacing);
    let ((key, before), (_, now)) = before.iter().zip(now).find(apart)?;
    let held = format!(
        "of which it holds particles from {:?} to {:?} instead of {:?} to {:?}",
        now[0], now[1], before[0], before[1]
    );
    Some((key.clone(), held))
}

/// Refuses what another spacing has others of, or more: particles with these ids, outermost ones, pushed ones. `takes` says
/// what takes another spacing.
///
/// # Errors
/// Names the key.
pub(super) fn require_alike(
    scene: &Scene,
    layout: &Layout,
    (takes, or): (&str, &str),
) -> Result<(), SceneError> {
    let refuse = |key: &str, what: &str, help: &str| {
        Err(scene.refuse(key, format!("{takes}, {what}"), format!("{help}, {or}")))
    };
    if let Some(k) = scene.loads.iter().position(|load| matches!(load, Load::Force { .. })) {
        return refuse(&format!("loads[{k}].force"), "in which it pushes more particles", "give a traction");
    }
    for (key, region) in scene.regions() {
        match region {
            SceneRegion::Known(Region::Ids(_)) => {
                return refuse(&key, "in which these ids are other particles", "pick particles by place");
            }
            SceneRegion::Outermost(side) if !layout.is_flat(*side) => {
                return refuse(
                    &key,
                    "in which less of a side that is not straight is outermost",
                    "pick pieces of the outline",
                );
            }
            _ => {}
        }
    }
    Ok(())
}
