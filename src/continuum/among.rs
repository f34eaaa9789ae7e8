//! What the ranks of a body in parts can only find out together of how its particles follow.

use super::layout::Layout;
use super::parts::agreed;
use super::pieces::{linkage, require_held};
use super::plan::{held_axes, is_led_to_rest, refuse_loose, update};
use super::weights;
use crate::engine::setup::RoleChange;
use crate::flock::action::ActionKind;
use crate::flock::body::Body;
use crate::flock::law::Weights;
use crate::flock::neighbourhood::Neighbours;
use crate::flock::rules::Mean;
use crate::flock::vectors::Vectors;
use crate::material::cells::Cells;
use crate::material::outline_loads::Load;
use crate::material::weights::WeightsError;
use crate::ranks::Team;
use crate::scene::{Scene, SceneError};
use crate::sweep::Update;

/// The ranks of a body in parts, and this one's part.
pub(super) struct Among<'a> {
    pub body: &'a Body,
    pub neighbours: &'a Neighbours,
    pub changes: &'a [RoleChange],
    pub team: &'a Team,
}

impl Among<'_> {
    /// Refuses what the parts can only together find wrong with how their particles follow, and sets the update and the rest offsets
    /// to what suits all of them.
    pub fn agree(
        &self,
        scene: &Scene,
        (weights, has_loads, cells): (&Weights, bool, Option<&Cells>),
        (own_update, rest): (&mut Update, &mut Option<Vectors>),
    ) -> Result<(), SceneError> {
        let Self { body, neighbours, team, .. } = *self;
        weights::require_joined(scene, (body, neighbours, weights), Some(team))?;
        self.require_held_together(scene, has_loads, cells)?;
        *own_update = update(scene, (body, self.changes), neighbours, weights, Some(team));
        // Those that stand at the ends of a part alone do.
        let is_held = |i: usize| match weights {
            Weights::Matrix(weights) => weights.held(i) != [false; 2],
            _ => false,
        };
        let is_needed = |rest: &Vectors| body.owned().any(|i| rest.get(i) != [0.0; 2] || is_held(i));
        let is_needed = team.any(rest.as_ref().is_some_and(is_needed));
        *rest = rest.take().or_else(|| Some(Vectors::zeros(body.count()))).filter(|_| is_needed);
        Ok(())
    }

    /// Refuses a material whose cells can move against each other, or all of them under a load.
    fn require_held_together(
        &self,
        scene: &Scene,
        has_loads: bool,
        cells: Option<&Cells>,
    ) -> Result<(), SceneError> {
        let Self { body, changes, team, .. } = *self;
        let (Some(cells), Mean::Material { .. }) = (cells, scene.mean) else { return Ok(()) };
        let incidence = cells.incidence(body.count());
        let (part, linkage) = linkage(body, (cells, &incidence), team);
        if has_loads || is_led_to_rest(scene) {
            let held = require_held(body, &incidence, (&part, &linkage), &held_axes(body, changes), team);
            held.map_err(|mechanism| refuse_loose(scene, mechanism))?;
        }
        let rigid = linkage.require_rigid(body.bounds());
        rigid.map_err(|mechanism| weights::refuse(scene, &WeightsError::Mechanism(mechanism)))
    }
}

/// Refuses loads that act on no part of the body.
pub(super) fn require_loaded(scene: &Scene, layout: &Layout, team: &Team) -> Result<(), SceneError> {
    let owned = layout.body.owned();
    for (k, load) in agreed(scene, team, layout.loads(scene))?.iter().enumerate() {
        if let Load::Particles { particles, .. } = load
            && !team.any(particles.iter().any(|&i| owned.contains(&(i as usize))))
        {
            return Err(layout.holds_none(scene, &format!("loads[{k}].region")));
        }
    }
    Ok(())
}

/// The actions by which particles follow otherwise, each with its number and the scene that says how.
pub(super) fn followed(scene: &Scene) -> impl Iterator<Item = (usize, &Scene)> {
    scene.actions.iter().enumerate().filter_map(|(k, action)| match &action.what {
        ActionKind::Follow(changed) => Some((k, &**changed)),
        ActionKind::Cut(_) => None,
    })
}
