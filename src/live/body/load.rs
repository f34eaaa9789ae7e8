//! The load of a side that a hand drags, as a key of the scene.

use super::state::State;
use crate::live::session::Refused;
use crate::scene::Scene;
use crate::scene::raw::{RawLoad, RawRegion, RawSide};

/// The override that loads a side so that it would go as far as `by` \[length\], were the body held at the opposite side
/// and kept from contracting. `scene` has the keys that hold now.
///
/// # Errors
/// A scene without a material.
pub(super) fn load_key(state: &State, scene: &Scene, side: RawSide, by: [f64; 2]) -> Result<String, Refused> {
    let Some(elastic) = scene.material else {
        return Err("only a material can be loaded: drag a leader, or begin with a scene that has one".into());
    };
    let body = state.engine.body();
    let (low, high) = body.bounds();
    let across = usize::from(matches!(side, RawSide::Bottom | RawSide::Top));
    let extent = (high[across] - low[across]).max(body.lattice.spacing());
    let part = by.map(|along| along / extent);
    // Of a strain along the normal of the side and a shear there is this traction on it.
    let traction = match across {
        0 => {
            let [xx, _, xy] = elastic.stress([part[0], 0.0, part[1]]);
            [xx, xy]
        }
        _ => {
            let [_, yy, xy] = elastic.stress([0.0, part[1], part[0]]);
            [xy, yy]
        }
    };
    let loads = &scene.raw.loads;
    if let Some(k) = loads.iter().position(|load| is_traction_on(load, side)) {
        return Ok(format!("loads[{k}].traction=[{:?}, {:?}]", traction[0], traction[1]));
    }
    let region = RawRegion::Edge { side, depth: None };
    let own = RawLoad::Traction { region, traction, profile: None };
    let all: Vec<&RawLoad> = loads.iter().chain([&own]).collect();
    let written = toml::Value::try_from(all).map_err(|error| error.to_string())?;
    Ok(format!("loads={written}"))
}

/// Whether a load is one that a hand can have given a side.
fn is_traction_on(load: &RawLoad, wanted: RawSide) -> bool {
    matches!(
        load,
        RawLoad::Traction { region: RawRegion::Edge { side, depth: None }, profile: None, .. } if *side == wanted
    )
}
