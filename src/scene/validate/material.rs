//! What the body is made of and what pushes it; the checks that a rule with a material needs.

use super::{Refuse, roles};
use crate::flock::lattice::Lattice;
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::rules::Rotation;
use crate::material::cells;
use crate::material::elastic::{Constants, Elastic, ElasticError, Plane};
use crate::material::homogenise::Crystal;
use crate::scene::Load;
use crate::scene::document::problem::SceneError;
use crate::scene::raw::*;

/// Part of the largest damping at which no wave grows: room for edges, whose rows are not a wave's.
const OF_DAMPING_LIMIT: f64 = 0.9;

pub fn elastic(raw: &Option<RawMaterial>, refuse: Refuse<'_>) -> Result<Option<Elastic>, SceneError> {
    let Some(raw) = raw else { return Ok(None) };
    let (constants, thickness) = match *raw {
        RawMaterial::Isotropic { young, poisson, plane, thickness } => {
            let plane = match plane {
                RawPlane::Stress => Plane::Stress,
                RawPlane::Strain => Plane::Strain,
            };
            (Constants::Isotropic { young, poisson, plane }, thickness)
        }
        RawMaterial::Orthotropic { young, poisson_12, shear, angle, thickness } => {
            let angle = angle.to_radians();
            (Constants::Orthotropic { young, poisson_12, shear, angle }, thickness)
        }
    };
    let refused = |error: ElasticError| {
        let (key, help) = match &error {
            ElasticError::NotPositive { name, .. } => match *name {
                "the thickness" => ("material.thickness", "give a positive thickness"),
                name if name.contains("hear") => ("material.shear", "give a positive modulus"),
                _ => ("material.young", "give a positive modulus"),
            },
            ElasticError::Poisson { .. } => ("material.poisson", "give a ratio inside the range"),
            ElasticError::PoissonOrthotropic { .. } => {
                ("material.poisson_12", "give a smaller ratio, or the moduli in the other order")
            }
            ElasticError::Angle { .. } => ("material.angle", "give an angle in degrees"),
            ElasticError::Range => ("material", "give the constants in larger or smaller units"),
        };
        refuse(key, error.to_string(), help)
    };
    Elastic::new(constants, thickness).map(Some).map_err(refused)
}

pub fn rotation(raw: RawRotation) -> Rotation {
    match raw {
        RawRotation::Small => Rotation::Small,
        RawRotation::Corotated => Rotation::Corotated,
    }
}

/// The neighbourhood as written, or what the rule needs where none is.
pub fn neighbourhood(raw: &RawScene, lattice: &Lattice) -> Neighbourhood {
    match &raw.neighbours {
        Some(neighbours) => super::neighbourhood(neighbours, lattice),
        None if is_material(raw) => cells::neighbourhood(lattice),
        None => Neighbourhood::First { keep: None },
    }
}

pub fn is_material(raw: &RawScene) -> bool {
    matches!(raw.rule.mean, Some(RawMean::Material { .. }))
}

/// The damping as written; unless it is, 1, or what keeps every wave of a material from growing.
pub fn damping(raw: &RawScene, lattice: &Lattice, elastic: Option<&Elastic>) -> f64 {
    let synchronous = raw.update.order == RawOrder::Synchronous;
    let limit = || {
        let elastic = elastic.filter(|_| is_material(raw) && synchronous)?;
        Crystal::material(lattice, elastic).ok()?.zone().ok().map(|zone| zone.damping_limit)
    };
    raw.update.damping.unwrap_or_else(|| limit().map_or(1.0, |limit| (OF_DAMPING_LIMIT * limit).min(1.0)))
}

/// A material lives in cells: it has no bonds to break, no need of a frame, and weights of its own.
pub fn check_rule(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    if !is_material(raw) {
        return match (&raw.material, raw.loads.is_empty()) {
            (None, false) => Err(refuse(
                "loads",
                "a load needs a material to act on".into(),
                "add [material], and rule.mean.kind = \"material\" if the rule itself should carry the load",
            )),
            _ => Ok(()),
        };
    }
    let present = matches!(raw.neighbours, Some(RawNeighbours::Present { .. }));
    let ghosts = raw.roles.iter().any(|entry| entry.role == RawRole::Ghost);
    let clash = [
        ("material", raw.material.is_none(), "the rule has no material to take its weights from", {
            "add [material] with kind = \"isotropic\", young and poisson"
        }),
        (
            "frame",
            raw.frame != RawFrame::None,
            "a material needs no frame: missing cells are the free edge",
            { "use frame = \"none\"" },
        ),
        ("neighbours", present, "a material has neighbours for life: its cells lie between them", {
            "leave the neighbours out, or use a rule without material"
        }),
        ("fracture", raw.fracture.is_some(), "a material is in cells, not in bonds that could break", {
            "leave this out, or use a rule without material"
        }),
        ("cuts", !raw.cuts.is_empty(), "a material is in cells, not in bonds that could be cut", {
            "cut the body's shape instead (body.holes, a polygon)"
        }),
        ("roles", ghosts, "ghosts leave the body by breaking bonds, and a material is in cells", {
            "use other roles, or a rule without material"
        }),
        ("rule.weights", raw.rule.weights.is_some(), "a material sets the weights itself", "leave them out"),
        ("rule.poisson", raw.rule.poisson.is_some(), "a material has a Poisson's ratio of its own", {
            "set material.poisson and leave the Poisson term out"
        }),
        ("rule.rest", raw.rule.rest == RawRest::Literal, "a material is at rest where nothing pulls it", {
            "use rule.rest = \"kept\""
        }),
    ];
    match clash.into_iter().find(|(_, clashes, ..)| *clashes) {
        None => Ok(()),
        Some((key, _, message, help)) => Err(refuse(key, message.into(), help)),
    }
}

pub fn loads(raw: &[RawLoad], refuse: Refuse<'_>) -> Result<Vec<Load>, SceneError> {
    let load = |(k, load): (usize, &RawLoad)| {
        let region = |region| roles::region(&format!("loads[{k}]"), region, refuse);
        Ok(match load {
            RawLoad::Traction { region: r, traction } => {
                Load::Traction { region: region(r)?, traction: *traction }
            }
            RawLoad::Force { region: r, force } => Load::Force { region: region(r)?, force: *force },
            RawLoad::Body { force } => Load::Body { force: *force },
        })
    };
    raw.iter().enumerate().map(load).collect()
}
