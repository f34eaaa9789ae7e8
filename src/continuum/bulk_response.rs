//! The rule of an interior particle of a scene, as on an infinite lattice: what its waves say about the
//! scene before it runs, and what material it is.

use crate::flock::block::Block;
use crate::flock::lattice::Site;
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::rules::{FeedbackReference, Mean};
use crate::material::gradient::{GradientError, GradientWeights, SAFE_DAMPING, layer_note};
use crate::material::homogenise::{Bond, Crystal, HomogeniseError};
use crate::material::report::MaterialReport;
use crate::material::zone::Zone;
use crate::scene::{Scene, SceneError, Weights};
use crate::sweep::Order;

/// The material that a scene's rule is.
///
/// # Errors
/// Refuses rules that are no homogeneous material, naming the key that makes them so.
pub fn material(scene: &Scene) -> Result<MaterialReport, SceneError> {
    let mut report = undamped(scene)?;
    let over = scene.over_relaxation();
    report.waves.damping_limit = report.waves.damping_limit.filter(|_| over > 0.0).map(|limit| limit / over);
    Ok(report)
}

fn undamped(scene: &Scene) -> Result<MaterialReport, SceneError> {
    if let (Mean::Material { .. }, Some(elastic)) = (scene.mean, &scene.material) {
        let report = MaterialReport::of_material(&scene.lattice, elastic);
        let mut report =
            report.map_err(|error| scene.refuse("material", error.to_string(), remedy(&error)))?;
        if !scene.inclusions.is_empty() {
            report.notes.push("this is [material]; inclusions of the scene are other materials".into());
        }
        return Ok(report);
    }
    if scene.is_of_points() {
        let message = "a body of points has no lattice: no particle's neighbours stand for all";
        let help = "ask about a lattice: flockform material --lattice hexagonal --neighbours first";
        return Err(scene.refuse("body.shape", message, help));
    }
    check_homogeneous(scene)?;
    if let Mean::Distance { power } = scene.mean
        && power <= 2.0 * FALLS_TOO_FAST
    {
        let message = format!(
            "weights that fall with the distance as d^{power} hold no particle: they are no material"
        );
        return Err(scene.refuse(
            "rule.mean.power",
            message,
            "use one above -2; those up to -1 are unstable",
        ));
    }
    let (crystal, divisors) = about_rest(scene)?;
    let mut report = MaterialReport::of_rule_over(&scene.lattice, rule_name(scene), &crystal, &divisors)
        .map_err(|error| scene.refuse("neighbours", error.to_string(), remedy(&error)))?;
    if let Some(Weights::Gradient { length }) = scene.weights {
        report.notes.push(layer_note(length));
    }
    if matches!(scene.mean, Mean::Distance { .. }) {
        report.notes.push(
            "weights that depend on the present distance are taken for small displacements about rest, K = d^p (1 + p n n')"
                .into(),
        );
    }
    Ok(report)
}

/// The remedy for a rule that is no material.
pub fn remedy(error: &HomogeniseError) -> &'static str {
    match error {
        HomogeniseError::NotSymmetric { .. } => {
            "give opposite neighbours and equal weights to them: a whole neighbourhood, not a reduced one"
        }
        HomogeniseError::NoStiffness => "give far neighbours weights that are less negative",
        HomogeniseError::Range => "use units in which they are of ordinary size",
        HomogeniseError::Loose => "use neighbours that join the two kinds of site",
        HomogeniseError::Singular { .. } => "give weights whose sum is positive",
        HomogeniseError::Weights { .. } => "give one weight for each neighbour, in the neighbourhood's order",
        HomogeniseError::Shape(_) => "use a lattice whose cells are less slender",
    }
}

fn check_homogeneous(scene: &Scene) -> Result<(), SceneError> {
    let no_fixed = |what: &str| format!("{what} has no fixed weights, so no material");
    let (key, message) = if let Neighbourhood::Dynamic { .. } = scene.neighbourhood {
        ("neighbours.kind", no_fixed("a rule whose neighbours are found anew at every step"))
    } else if !scene.mean.is_affine() && !matches!(scene.mean, Mean::Distance { .. }) {
        ("rule.mean", no_fixed(&format!("the rule \"{}\"", scene.mean)))
    } else if scene.poisson.is_some() {
        (
            "rule.poisson",
            "the Poisson term (Eq. 2) depends on the distance from an axis: no homogeneous material".into(),
        )
    } else if scene.feedback.is_some_and(|f| f.reference == FeedbackReference::Initial) {
        (
            "rule.feedback",
            "feedback from the initial position ties each particle to its place, which no material does"
                .into(),
        )
    } else {
        return Ok(());
    };
    Err(scene.refuse(key, message, "ask about the rule without it: --set, or --lattice and --neighbours"))
}

fn rule_name(scene: &Scene) -> String {
    let mean = scene.mean.to_string();
    match &scene.weights {
        // A whole neighbourhood reproduces its particle's place by equal weights.
        None | Some(Weights::Solved) => mean,
        Some(Weights::Distance { power }) => format!("{mean} with weights reference distance^{power}"),
        Some(Weights::List(_)) => format!("{mean} with weights given"),
        Some(Weights::Gradient { length }) => format!("second gradient of length {length}"),
    }
}

/// The fixed weights of an interior particle.
fn scalar_crystal(scene: &Scene) -> Result<Crystal, SceneError> {
    let offsets = scene.neighbourhood.offsets(&scene.lattice).map_err(|error| {
        scene.refuse("neighbours", error.to_string(), "choose a neighbourhood that the lattice has")
    })?;
    let weights: Option<Vec<Vec<f64>>> = match &scene.weights {
        None | Some(Weights::Solved) => None,
        Some(Weights::Gradient { length }) => {
            let crystal = gradient(scene, *length)?.crystal(&scene.lattice);
            return crystal.map_err(|error| refuse_gradient(scene, &error));
        }
        Some(Weights::List(values)) => {
            check_count(scene, values, &offsets)?;
            Some(vec![values.clone(); offsets.len()])
        }
        Some(Weights::Distance { power }) => {
            let spacing = scene.lattice.spacing();
            let weight = |&offset: &Site| {
                let [x, y] = scene.lattice.vector(offset);
                (x.hypot(y) / spacing).powf(*power)
            };
            Some(offsets.iter().map(|offsets| offsets.iter().map(weight).collect()).collect())
        }
    };
    Crystal::scalar(&scene.lattice, &offsets, weights.as_deref())
        .map_err(|error| scene.refuse("rule.weights", error.to_string(), remedy(&error)))
}

/// Power of the distance at and below which its weights let a chain run together: its shortest wave changes by `-1 - 2 p` at each step.
pub(super) const FALLS_TOO_FAST: f64 = -1.0;

/// The rule for small displacements about rest, and what its update divides by on each sublattice.
fn about_rest(scene: &Scene) -> Result<(Crystal, Vec<Block>), SceneError> {
    let scalar = scalar_crystal(scene)?;
    Ok(match scene.mean {
        Mean::Distance { power } => {
            (linearised(&scalar, power, power), linearised(&scalar, power, 0.0).diagonals())
        }
        _ => {
            let divisors = scalar.diagonals();
            (scalar, divisors)
        }
    })
}

/// Weights `d^p` of the present distance `d`, for small displacements about rest: their derivative adds
/// a pull along the bond, `K = d^p (1 + p n n')`; the rule divides by the sum of the weights, without `along`.
fn linearised(crystal: &Crystal, power: f64, along: f64) -> Crystal {
    let linear = |bond: &Bond| {
        let [x, y] = bond.vector;
        let distance = x.hypot(y);
        let ([nx, ny], size) = ([x / distance, y / distance], distance.powf(power) * bond.block[0][0]);
        let along = size * along;
        let block = [[size + along * nx * nx, along * nx * ny], [along * nx * ny, size + along * ny * ny]];
        Bond { block, ..*bond }
    };
    let bonds = crystal.bonds.iter().map(|bonds| bonds.iter().map(linear).collect()).collect();
    Crystal { bonds, ..*crystal }
}

/// Refuses listed weights that are not as many as the neighbours.
pub(super) fn check_count(scene: &Scene, values: &[f64], offsets: &[Vec<Site>]) -> Result<(), SceneError> {
    let size = offsets.first().map_or(0, Vec::len);
    if size == values.len() {
        return Ok(());
    }
    let message = format!("{} weights are given for {size} neighbours", values.len());
    let help = "give one weight for each neighbour, in the neighbourhood's order";
    Err(scene.refuse("rule.weights.values", message, help))
}

/// The weights of a second gradient.
pub(super) fn gradient(scene: &Scene, length: f64) -> Result<GradientWeights, SceneError> {
    GradientWeights::new(&scene.lattice, length).map_err(|error| refuse_gradient(scene, &error))
}

fn refuse_gradient(scene: &Scene, error: &GradientError) -> SceneError {
    let (key, help) = match error {
        GradientError::TooShort { shortest, .. } => {
            ("rule.weights.length", format!("give a length of {shortest:.4} or more, or a finer lattice"))
        }
        GradientError::TooLong { .. } | GradientError::Unstable { .. } => {
            ("rule.weights.length", "give a shorter length".into())
        }
        GradientError::Neighbours(_) => ("lattice.kind", "use one of the five Bravais lattices".into()),
        GradientError::NotPositive { .. } | GradientError::Wave(_) => {
            ("rule.weights.length", "give a positive length".into())
        }
    };
    scene.refuse(key, error.to_string(), help)
}

/// Refuses a synchronous update that makes the fastest wave of a second gradient grow.
pub(super) fn require_damped(scene: &Scene, gradient: &GradientWeights) -> Result<(), SceneError> {
    if scene.update.order == Order::Sequential || scene.raw.equilibrium.is_some() {
        return Ok(());
    }
    let crystal = gradient.crystal(&scene.lattice).map_err(|error| refuse_gradient(scene, &error))?;
    let limit = crystal.zone().map_or(SAFE_DAMPING, |zone| zone.damping_limit) / scene.over_relaxation();
    if scene.update.damping < limit || scene.over_relaxation() <= 0.0 {
        return Ok(());
    }
    let message = format!(
        "a synchronous update of this second gradient diverges with damping {}: the limit is {limit:.4}",
        scene.update.damping
    );
    Err(scene.refuse(
        "update.damping",
        message,
        "leave update.damping out, use update.order = \"sequential\", or update.damping = 0.65",
    ))
}

/// Warnings about a run from the waves of the scene's fixed weights.
pub(crate) fn cautions(scene: &Scene) -> Vec<String> {
    if let Mean::Distance { power } = scene.mean
        && power <= FALLS_TOO_FAST
    {
        return vec![format!(
            "weights that fall with the distance as d^{power} are unstable: particles run to their nearest neighbours in any update; use a \
             rule.mean.power above {FALLS_TOO_FAST}"
        )];
    }
    // Rules that have no waves (not symmetric, say) are no error here.
    let Some((crystal, zone)) = waves_in_doubt(scene) else { return Vec::new() };
    let by_distance = matches!(scene.mean, Mean::Distance { .. });
    let gradient = matches!(scene.weights, Some(Weights::Gradient { .. }));
    let (damping, over) = (scene.update.damping, scene.over_relaxation());
    if !zone.stable || crystal.effective() == Err(HomogeniseError::NoStiffness) {
        let length = std::f64::consts::TAU / zone.worst[0].hypot(zone.worst[1]);
        return vec![format!(
            "these weights are unstable: a wave of length {length:.4} {} costs nothing or gives energy and does not die out in any update; \
             weights of far neighbours are too negative (on a chain, w2 must be above -w1/4)",
            scene.unit()
        )];
    }
    let limit = zone.damping_limit / over;
    if by_distance && scene.update.order == Order::Synchronous && damping > limit * (1.0 - 1e-9) {
        return vec![format!(
            "weights that grow with distance let the shortest waves of a synchronous update grow unless it is damped below {limit:.4}: \
             what is moved does not settle; lower update.damping or use update.order = \"sequential\""
        )];
    }
    if scene.update.order == Order::Synchronous && damping > limit * (1.0 + 1e-9) {
        return vec![format!(
            "a synchronous update of these weights may diverge unless damped below {:.4}: set update.damping or use update.order = \"sequential\"",
            limit
        )];
    }
    if gradient && scene.update.order == Order::Synchronous && damping * over >= SAFE_DAMPING {
        let limit = if over == 1.0 { "2/3".to_owned() } else { format!("{:.4}", SAFE_DAMPING / over) };
        return vec![format!(
            "a synchronous update of a second gradient is stable on any body only if damped below {limit}; here damping is {damping}, \
             and edges may grow"
        )];
    }
    Vec::new()
}

/// The rule and its waves, where the answer is not known beforehand: a mean with positive weights is
/// stable, and an update that does not overshoot it never grows.
fn waves_in_doubt(scene: &Scene) -> Option<(Crystal, Zone)> {
    let is_of_lattice =
        !scene.is_of_points() && !matches!(scene.neighbourhood, Neighbourhood::Dynamic { .. });
    let by_distance = matches!(scene.mean, Mean::Distance { .. });
    if (scene.mean != Mean::Barycentre && !by_distance) || !is_of_lattice {
        return None;
    }
    let (crystal, divisors) = about_rest(scene).ok()?;
    let positive = crystal.bonds.iter().flatten().all(|bond| bond.block[0][0] >= 0.0);
    if positive
        && !by_distance
        && (scene.update.order == Order::Sequential || scene.update.damping * scene.over_relaxation() <= 1.0)
    {
        return None;
    }
    let zone = crystal.zone_over(&divisors).ok()?;
    Some((crystal, zone))
}
