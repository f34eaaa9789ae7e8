//! Material and loads; the checks that a rule with a material needs.

use super::{Refuse, roles};
use crate::flock::lattice::Lattice;
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::rules::Mean;
use crate::material::cells;
use crate::material::elastic::{Constants, Elastic, ElasticError, Plane};
use crate::material::gradient::SAFE_DAMPING;
use crate::material::homogenise::Crystal;
use crate::material::outline_loads::{Profile, Push};
use crate::scene::document::problem::SceneError;
use crate::scene::raw::*;
use crate::scene::{Inclusion, Load};

/// Part of the largest damping at which no wave grows: room for edges, whose rows are not a wave's.
const OF_DAMPING_LIMIT: f64 = 0.9;

/// The constants of the material written at `at`.
pub fn elastic(raw: &RawMaterial, at: &str, refuse: Refuse<'_>) -> Result<Elastic, SceneError> {
    let (constants, thickness) = match *raw {
        RawMaterial::Isotropic { young, poisson, plane, thickness } => {
            (Constants::Isotropic { young, poisson, plane: plane.into() }, thickness)
        }
        RawMaterial::Orthotropic { young, poisson_12, shear, angle, thickness } => {
            let angle = angle.to_radians();
            (Constants::Orthotropic { young, poisson_12, shear, angle }, thickness)
        }
    };
    let refused = |error: ElasticError| {
        let (key, help) = match &error {
            ElasticError::NotPositive { name, .. } => match *name {
                "the thickness" => (".thickness", "give a positive thickness"),
                name if name.contains("hear") => (".shear", "give a positive modulus"),
                _ => (".young", "give a positive modulus"),
            },
            ElasticError::Poisson { .. } => (".poisson", "give a ratio inside the range"),
            ElasticError::PoissonOrthotropic { .. } => {
                (".poisson_12", "give a smaller ratio, or the moduli in the other order")
            }
            ElasticError::Angle { .. } => (".angle", "give an angle in degrees"),
            ElasticError::Range => ("", "give the constants in larger or smaller units"),
        };
        refuse(&format!("{at}{key}"), error.to_string(), help)
    };
    Elastic::new(constants, thickness).map_err(refused)
}

/// Parts of the body that are of another material.
pub fn inclusions(
    raw: &RawScene,
    body: Option<&Elastic>,
    refuse: Refuse<'_>,
) -> Result<Vec<Inclusion>, SceneError> {
    let inclusion = |(k, part): (usize, &RawInclusion)| {
        let key = format!("body.inclusions[{k}]");
        let refuse_part =
            |at: &str, message: &str, help: &str| refuse(&format!("{key}{at}"), message.into(), help);
        let Some(body) = body.filter(|_| is_material(raw)) else {
            let help = "use rule.mean.kind = \"material\" with [material], or leave the inclusions out";
            return Err(refuse_part("", "a part of another material needs a rule that is a material", help));
        };
        if matches!(raw.body.shape, RawShape::Grid { .. }) {
            let help = "give the body as kind = \"rectangle\" with min and max";
            return Err(refuse_part("", "a rectangle by count takes no inclusions", help));
        }
        let at = format!("{key}.shape");
        let shape = super::solid(&part.shape, &at, refuse)?.ok_or_else(|| {
            let help = "use kind = \"rectangle\", \"disc\", \"polygon\" or \"path\"";
            refuse(
                &at,
                "an inclusion has to have a shape of its own, not a count of sites or points".into(),
                help,
            )
        })?;
        let material = elastic(&part.material, &format!("{key}.material"), refuse)?;
        if material.thickness() != body.thickness() {
            let message =
                format!("the body is {} thick, and this part {}", body.thickness(), material.thickness());
            let help = "give both the same thickness; for a thicker part multiply its moduli instead";
            return Err(refuse_part(".material.thickness", &message, help));
        }
        let is_strain = |elastic: &Elastic| {
            matches!(elastic.constants(), Constants::Isotropic { plane: Plane::Strain, .. })
        };
        if is_strain(&material) != is_strain(body) {
            let message = "one part is in plane stress and the other in plane strain";
            return Err(refuse_part(".material", message, "give both the same plane"));
        }
        Ok(Inclusion { shape, material })
    };
    raw.body.inclusions.iter().enumerate().map(inclusion).collect()
}

/// The neighbourhood as written, or what the rule needs where none is.
pub fn neighbourhood(raw: &RawScene, lattice: &Lattice, elastic: Option<&Elastic>) -> Neighbourhood {
    match &raw.neighbours {
        Some(neighbours) => super::neighbourhood(neighbours, lattice, elastic),
        None if is_material(raw) => of_cells(lattice, elastic),
        None => Neighbourhood::First { keep: None },
    }
}

/// The neighbours that the cells of this material need, or any material.
pub fn of_cells(lattice: &Lattice, elastic: Option<&Elastic>) -> Neighbourhood {
    match elastic {
        Some(elastic) => cells::neighbourhood_of(lattice, elastic),
        None => cells::neighbourhood(lattice),
    }
}

pub fn is_material(raw: &RawScene) -> bool {
    matches!(raw.rule.mean, Some(RawMean::Material { .. }))
}

/// The damping as written; unless it is, 1, or what keeps every wave of a material or a second gradient from growing, and lets a mean that
/// depends on distances settle, also where feedback over-relaxes.
pub fn damping(
    raw: &RawScene,
    mean: Mean,
    lattice: &Lattice,
    body: Option<&Elastic>,
    inclusions: &[Inclusion],
) -> f64 {
    let synchronous = raw.update.order == RawOrder::Synchronous;
    let limit = |elastic: &Elastic| {
        Crystal::material(lattice, elastic).ok()?.zone().ok().map(|zone| zone.damping_limit)
    };
    let over = raw.rule.feedback.as_ref().map_or(1.0, |raw| super::feedback(raw).over_relaxation().max(1.0));
    let of_waves = || {
        if synchronous && matches!(raw.rule.weights, Some(RawWeights::Gradient { .. })) {
            return OF_DAMPING_LIMIT * SAFE_DAMPING / over;
        }
        if synchronous && mean.overshoots() {
            return mean.settling_damping() / over;
        }
        let body = body.filter(|_| is_material(raw) && synchronous);
        let all = body.into_iter().flat_map(|body| {
            std::iter::once(body).chain(inclusions.iter().map(|part| &part.material)).filter_map(limit)
        });
        all.fold(1.0, |least: f64, limit| least.min(OF_DAMPING_LIMIT * limit / over))
    };
    raw.update.damping.unwrap_or_else(of_waves)
}

/// Why a material has no cuts.
const UNCUT: &str = "a material is in cells, not in bonds that could be cut";

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
    let present = matches!(raw.neighbours, Some(RawNeighbours::Dynamic { .. }));
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
        ("cuts", !raw.cuts.is_empty(), UNCUT, "cut the body's shape instead (body.holes, a polygon)"),
        ("actions", super::actions::cuts(raw), UNCUT, "leave cuts out, or use a rule without material"),
        ("roles", ghosts, "ghosts leave the body by breaking bonds, and a material is in cells", {
            "use other roles, or a rule without material"
        }),
        ("rule.weights", raw.rule.weights.is_some(), "a material sets the weights itself", "leave them out"),
        ("rule.poisson", raw.rule.poisson.is_some(), "a material has a Poisson's ratio of its own", {
            "set material.poisson and leave the Poisson term out"
        }),
        ("rule.rest", raw.rule.rest == RawRest::Literal, "a material is at rest where nothing pulls it", {
            "use rule.rest = \"balanced\""
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
            RawLoad::Traction { region: r, traction, profile: p } => Load::Outline {
                region: region(r)?,
                push: Push::Traction(*traction),
                profile: profile(k, p, refuse)?,
            },
            RawLoad::Pressure { region: r, pressure, profile: p } => Load::Outline {
                region: region(r)?,
                push: Push::Pressure(*pressure),
                profile: profile(k, p, refuse)?,
            },
            RawLoad::Force { region: r, force } => Load::Force { region: region(r)?, force: *force },
            RawLoad::Body { force } => Load::Body { force: *force },
        })
    };
    raw.iter().enumerate().map(load).collect()
}

fn profile(load: usize, raw: &Option<RawProfile>, refuse: Refuse<'_>) -> Result<Option<Profile>, SceneError> {
    match raw {
        Some(RawProfile { from, to, .. }) if from == to => {
            let message = format!("from = to = [{}, {}]: nothing can vary along no length", from[0], from[1]);
            Err(refuse(&format!("loads[{load}].profile.to"), message, "give another point"))
        }
        given => Ok(given.map(|RawProfile { from, to, factors }| Profile { from, to, factors })),
    }
}

/// Whether the body keeps its outline: as written, or what suits the rule.
pub fn is_fitted(raw: &RawScene, refuse: Refuse<'_>) -> Result<bool, SceneError> {
    let has_outline = raw.body.shape.has_outline();
    match raw.body.outline {
        None => Ok(is_material(raw) && has_outline),
        Some(RawOutline::Lattice) => Ok(false),
        Some(RawOutline::Fitted) if !is_material(raw) => {
            let message = "cells that the outline cuts carry a material, which this rule has not".into();
            Err(refuse(
                "body.outline",
                message,
                "use rule.mean.kind = \"material\", or outline = \"lattice\"",
            ))
        }
        Some(RawOutline::Fitted) if !has_outline => {
            let message = "a body by count or by points has no outline of its own".into();
            Err(refuse("body.outline", message, "give a shape with lengths, such as kind = \"rectangle\""))
        }
        Some(RawOutline::Fitted) => Ok(true),
    }
}

/// Single components are held in a material alone: other rules have no force to leave free.
pub fn check_axes(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    for (k, entry) in raw.roles.iter().enumerate().filter(|(_, entry)| entry.axis.is_some()) {
        let key = format!("roles[{k}].axis");
        if !is_material(raw) {
            let message = "one component can be held in a material only".into();
            return Err(refuse(&key, message, "use rule.mean = { kind = \"material\" }, or leave axis out"));
        }
        if !matches!(entry.role, RawRole::Clamped | RawRole::Leader) {
            return Err(refuse(&key, "only clamped and led particles have an axis".into(), "leave axis out"));
        }
        if entry.from > 1 || entry.when.is_some() {
            let message = "a component is held from the start and for good".into();
            return Err(refuse(&key, message, "leave `from` and `when` out, or axis"));
        }
    }
    Ok(())
}
