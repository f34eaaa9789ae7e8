//! From the scene as written to the scene as meant: degrees to radians, choices to rules, and the
//! checks that concern several keys at once.

pub(super) mod actions;
pub(super) mod equilibrium;
mod load_steps;
mod material;
mod points;
pub(super) mod roles;

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use super::document::problem::{Problem, SceneError};
use super::document::{Document, schema_of};
use super::raw::*;
use super::{BodySource, Fracture, PoissonTerm, Scene, Weights, text};
use crate::flock::body::Cut;
use crate::flock::fracture::Threshold;
use crate::flock::frame::FrameRule;
use crate::flock::lattice::{Lattice, LatticeKind};
use crate::flock::neighbourhood::Neighbourhood;
use crate::flock::rules::{Feedback, Mean, Origin};
use crate::geometry::piece::Piece;
use crate::geometry::shape::{Segment, Shape};
use crate::geometry::specimen::Specimen;
use crate::material::elastic::Elastic;
use crate::sweep::Update;

impl Scene {
    /// Reads a scene file from disk; `overrides` are `KEY.PATH=VALUE` texts applied on top.
    pub fn from_file(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let help = "give the path of a scene file, or a name that `flockform list scenes` lists";
        let File { name, file, text } = File::read(path, help)?;
        Self::parse(&name, &file, &text, overrides, path.parent())
    }

    /// Reads a scene from text. `file` names it in messages; CSV files are looked up in `folder`.
    pub fn parse(
        name: &str,
        file: &str,
        text: &str,
        overrides: &[String],
        folder: Option<&Path>,
    ) -> Result<Self, SceneError> {
        build(name, Document::parse(file, text, overrides)?, folder)
    }

    /// The scene with more keys set after those that it was read with, from the text that was read then. Files are
    /// looked up in `folder`.
    ///
    /// # Errors
    /// Keys that cannot be set so.
    pub fn with(&self, set: &[String], folder: Option<&Path>) -> Result<Self, SceneError> {
        build(&self.name, self.document.with(set)?, folder)
    }

    /// The scene without what puts its body to rest at once: a body to be stepped. Files are looked up in `folder`.
    ///
    /// # Errors
    /// Names a key that needs what was left out.
    pub fn stepped(&self, folder: Option<&Path>) -> Result<Self, SceneError> {
        let mut raw = self.raw.clone();
        if raw.equilibrium.take().is_some() {
            raw.load_steps = None;
        }
        validate(&self.name, raw, self.document.clone(), folder)
    }
}

fn build(name: &str, document: Document, folder: Option<&Path>) -> Result<Scene, SceneError> {
    let raw = document.read(&schema())?;
    validate(name, raw, document, folder)
}

/// The JSON Schema of a scene file.
pub fn schema() -> serde_json::Value {
    schema_of::<RawScene>()
}

/// A file as read from disk.
pub(super) struct File {
    /// Without its folder and ending.
    pub name: String,
    /// As messages name it.
    pub file: String,
    pub text: String,
}

/// Bytes of a file of keys at most: it takes some thirty times as much to read, and what is long, places and recordings, has files
/// of its own.
const MOST_BYTES: u64 = 32 << 20;

impl File {
    /// # Errors
    /// Why it cannot be read, with `help`.
    pub(super) fn read(path: &Path, help: &str) -> Result<Self, SceneError> {
        match text::read_at_most(path, MOST_BYTES) {
            Ok(text) => Ok(Self::of(path, text)),
            Err(error) => {
                let message = format!("cannot be read: {error}");
                let file = path.display().to_string();
                Err(Problem::of_file(&file, message, Some(help.to_owned())).into())
            }
        }
    }

    /// The file at `path`, of which the text is known.
    pub(super) fn of(path: &Path, text: String) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Self { name, file: path.display().to_string(), text }
    }
}

/// Makes the error for a key, a message and a remedy.
pub(super) type Refuse<'a> = &'a dyn Fn(&str, String, &str) -> SceneError;

/// What `parse` reads from the CSV file that stands at `key`, looked up in `folder`.
fn read_table<T>(
    (key, file): (&str, &str),
    folder: Option<&Path>,
    refuse: Refuse<'_>,
    parse: impl FnOnce(&str) -> Result<T, String>,
) -> Result<T, SceneError> {
    let path = folder.unwrap_or(Path::new("")).join(file);
    let text = text::read(&path).map_err(|error| {
        let message = format!("cannot read {}: {error}", path.display());
        refuse(key, message, "the path is relative to the scene file")
    })?;
    parse(&text).map_err(|error| {
        refuse(key, format!("{}: {error}", path.display()), "mend the file, or name another")
    })
}

pub(super) fn validate(
    name: &str,
    mut raw: RawScene,
    document: Document,
    folder: Option<&Path>,
) -> Result<Scene, SceneError> {
    let refuse: Refuse<'_> =
        &|key, message, help| SceneError::from(document.problem(key, message, Some(help.to_owned())));
    // A scene that asks for an accuracy and names no rule gets the material rule, which can reach it.
    let is_asked = raw.equilibrium.as_ref().is_some_and(|asked| asked.accuracy.is_some());
    if is_asked && raw.rule.mean.is_none() && raw.material.is_some() {
        raw.rule.mean = Some(RawMean::Material { rotation: RawRotation::Small });
    }
    let (body, lattice) = body(&raw, folder, refuse)?;
    let spacing = lattice.spacing();
    check_present_neighbours(&raw, refuse)?;
    material::check_rule(&raw, refuse)?;
    check_reference(&raw, refuse)?;
    let elastic = raw.material.as_ref().map(|raw| material::elastic(raw, "material", refuse)).transpose()?;
    let inclusions = material::inclusions(&raw, elastic.as_ref(), refuse)?;
    let farthest = crate::scene::farthest_seeing(elastic.as_ref(), &inclusions);
    require_others(&raw, refuse)?;
    let neighbourhood = material::neighbourhood(&raw, &lattice, farthest);
    let equilibrium = equilibrium::equilibrium(&raw, refuse)?;
    let load_steps = load_steps::load_steps(&raw, refuse)?;
    let is_fitted = material::is_fitted(&raw, refuse)?;
    material::check_axes(&raw, refuse)?;
    check_gradient(&raw, refuse)?;
    let roles = raw
        .roles
        .iter()
        .enumerate()
        .map(|(k, entry)| roles::role_entry(&format!("roles[{k}]"), entry, folder, refuse))
        .collect::<Result<_, _>>()?;
    let mean = mean(raw.rule.mean.as_ref().unwrap_or(&RawMean::Barycentre), spacing, refuse)?;
    Ok(Scene {
        name: name.to_owned(),
        body,
        is_fitted,
        frame: frame(raw.frame),
        neighbourhood,
        mean,
        equilibrium,
        load_steps,
        weights: weights(&raw.rule.weights, refuse)?,
        // Neighbours found anew every step have no reference configuration to be at rest in.
        keeps_rest: raw.rule.rest == RawRest::Balanced
            && !matches!(raw.neighbours, Some(RawNeighbours::Dynamic { .. })),
        poisson: raw.rule.poisson.as_ref().map(|p| PoissonTerm {
            k: p.k,
            axis: p.axis.into(),
            centre: p.centre,
            exponent: p.exponent,
        }),
        feedback: raw.rule.feedback.as_ref().map(feedback),
        update: Update {
            order: raw.update.order.into(),
            damping: material::damping(&raw, mean, &lattice, elastic.as_ref(), &inclusions),
        },
        loads: material::loads(&raw.loads, refuse)?,
        material: elastic,
        inclusions,
        roles,
        fracture: fracture(&raw.fracture, refuse)?,
        cuts: cuts(&raw.cuts, refuse)?,
        actions: actions::actions(&raw, (name, &document, folder), refuse)?,
        stop: raw.stop,
        record: raw.record.clone(),
        lattice,
        raw,
        document,
    })
}

/// The body's particles, and the lattice that they are on or that stands in for their spacing.
fn body(
    raw: &RawScene,
    folder: Option<&Path>,
    refuse: Refuse<'_>,
) -> Result<(BodySource, Lattice), SceneError> {
    if let Some(cloud) = points::cloud(raw, folder, refuse)? {
        let lattice = Lattice::new(LatticeKind::Square { spacing: cloud.spacing }, [0.0; 2], 0.0);
        return Ok((BodySource::Points(Arc::new(cloud)), lattice));
    }
    let shape = shape(&raw.body, refuse)?;
    let Some(lattice) = lattice(raw, shape.as_ref()) else {
        let help = "add `lattice = { kind = \"square\", spacing = 1.0 }`, or give the body as points";
        return Err(refuse("lattice", "is missing".into(), help));
    };
    if lattice.kind().is_out_of_proportion() {
        let message = "the cell is more than a million times as long as it is high".into();
        return Err(refuse(
            "lattice",
            message,
            "give edges `a` and `b` of a like length, and an angle farther from 0 and 180 degrees",
        ));
    }
    Ok((BodySource::Cut(cut(&raw.body, shape)), lattice))
}

fn lattice(raw: &RawScene, shape: Option<&Shape>) -> Option<Lattice> {
    let (kind, orientation) = match *raw.lattice.as_ref()? {
        RawLattice::Square { spacing, orientation } => (LatticeKind::Square { spacing }, orientation),
        RawLattice::Rectangular { a, b, orientation } => (LatticeKind::Rectangular { a, b }, orientation),
        RawLattice::CentredRectangular { a, b, orientation } => {
            (LatticeKind::CentredRectangular { a, b }, orientation)
        }
        RawLattice::Hexagonal { spacing, orientation } => (LatticeKind::Hexagonal { spacing }, orientation),
        RawLattice::Oblique { a, b, angle, orientation } => {
            (LatticeKind::Oblique { a, b, angle: angle.to_radians() }, orientation)
        }
        RawLattice::Honeycomb { spacing, orientation } => (LatticeKind::Honeycomb { spacing }, orientation),
    };
    let anchor = raw.body.anchor.unwrap_or_else(|| shape.map_or([0.0; 2], Shape::anchor));
    Some(Lattice::new(kind, anchor, orientation.to_radians()))
}

/// The shape with its holes; `None` for a rectangle by count.
fn shape(body: &RawBody, refuse: Refuse<'_>) -> Result<Option<Shape>, SceneError> {
    let Some(whole) = solid(&body.shape, "body.shape", refuse)? else {
        if body.holes.is_empty() {
            return Ok(None);
        }
        let message = "a rectangle by count takes no holes".into();
        return Err(refuse("body.holes", message, "give the body as kind = \"rectangle\" with min and max"));
    };
    let mut holes = Vec::new();
    for (k, hole) in body.holes.iter().enumerate() {
        let key = format!("body.holes[{k}]");
        let message = "a hole has to have a shape of its own, not a count of sites or points".into();
        let help = "use kind = \"rectangle\", \"disc\" or \"polygon\"";
        holes.push(solid(hole, &key, refuse)?.ok_or_else(|| refuse(&key, message, help))?);
    }
    let body = Box::new(whole);
    Ok(Some(if holes.is_empty() { *body } else { Shape::WithHoles { body, holes } }))
}

fn solid(raw: &RawShape, key: &str, refuse: Refuse<'_>) -> Result<Option<Shape>, SceneError> {
    Ok(Some(match raw {
        RawShape::Grid { .. } | RawShape::Points { .. } => return Ok(None),
        RawShape::Rectangle { min, max } => {
            ordered_box(key, *min, *max, refuse)?;
            Shape::Rectangle { min: *min, max: *max }
        }
        RawShape::Disc { centre, radius } => Shape::Disc { centre: *centre, radius: *radius },
        RawShape::Polygon { vertices } => Shape::Polygon { vertices: vertices.clone() },
        RawShape::Path { from, steps } => path(*from, steps, key, refuse)?,
        RawShape::E8Sheet { scale, lying } => {
            Shape::Specimen(Specimen { lying: *lying, ..Specimen::e8_sheet(*scale) })
        }
        RawShape::D638TypeI { scale, lying } => {
            Shape::Specimen(Specimen { lying: *lying, ..Specimen::d638_type_i(*scale) })
        }
    }))
}

/// How much farther from its end than from its beginning the centre of an arc may be, over the radius.
const ROUND: f64 = 1e-6;

fn path(from: [f64; 2], steps: &[RawStep], key: &str, refuse: Refuse<'_>) -> Result<Shape, SceneError> {
    let away = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
    let mut pieces = Vec::new();
    let mut at = from;
    for (k, step) in steps.iter().enumerate() {
        match step.centre {
            Some(centre) => {
                let radii = [away(at, centre), away(step.to, centre)];
                let is_round = (radii[0] - radii[1]).abs() <= ROUND * radii[0];
                if !is_round {
                    let message =
                        format!("the arc begins {} from its centre and ends {} from it", radii[0], radii[1]);
                    let help = "move the centre, or the end, so that both are the radius";
                    return Err(refuse(&format!("{key}.steps[{k}].centre"), message, help));
                }
                pieces.push(Piece::arc_between(at, step.to, centre, step.clockwise));
            }
            None if at == step.to => {
                let message = "the edge has no length".into();
                return Err(refuse(&format!("{key}.steps[{k}].to"), message, "give its other end"));
            }
            None => pieces.push(Piece::edge(at, step.to)),
        }
        at = step.to;
    }
    if at != from {
        pieces.push(Piece::edge(at, from));
    }
    // Where pieces go on in the same direction there is no corner to keep.
    let count = pieces.len();
    for k in 0..count {
        let (before, after) = (pieces[(k + count - 1) % count].tangent(1.0), pieces[k].tangent(0.0));
        let turn = before[0] * after[1] - before[1] * after[0];
        let is_smooth = turn.abs() < ROUND && before[0] * after[0] + before[1] * after[1] > 0.0;
        pieces[k].begins_at_corner = count > 1 && !is_smooth;
        pieces[k].number = k;
    }
    Ok(Shape::Path { pieces })
}

fn ordered_box(key: &str, min: [f64; 2], max: [f64; 2], refuse: Refuse<'_>) -> Result<(), SceneError> {
    if (0..2).all(|k| min[k] <= max[k]) {
        return Ok(());
    }
    let message = format!("max = [{}, {}] lies below min = [{}, {}]", max[0], max[1], min[0], min[1]);
    Err(refuse(
        &format!("{key}.max"),
        message,
        "give the lower left corner as min and the upper right one as max",
    ))
}

fn cut(body: &RawBody, shape: Option<Shape>) -> Cut {
    match (&body.shape, shape) {
        (RawShape::Grid { columns, rows }, _) => Cut::Count { columns: *columns, rows: *rows },
        (_, shape) => Cut::Shape(shape.expect("every shape but the grid is solid")),
    }
}

fn frame(raw: RawFrame) -> Option<FrameRule> {
    match raw {
        RawFrame::None => None,
        RawFrame::Lagged => Some(FrameRule::Lagged),
        RawFrame::Immediate => Some(FrameRule::Immediate),
        RawFrame::Mirror => Some(FrameRule::Mirror),
    }
}

/// A particle would be a neighbour of itself, or of another twice, by such an offset.
fn require_others(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let Some(RawNeighbours::Offsets { offsets }) = &raw.neighbours else { return Ok(()) };
    let mut named = HashMap::new();
    for (k, offset) in offsets.iter().enumerate() {
        let (message, help) = if *offset == [0, 0] {
            ("[0, 0] is the particle itself, which is not its own neighbour".into(), "leave it out")
        } else if let Some(first) = named.insert(offset, k) {
            let help = "name it once; rule.weights of kind \"list\" let a neighbour count for more";
            (format!("the particle of neighbours.offsets[{first}] again"), help)
        } else {
            continue;
        };
        return Err(refuse(&format!("neighbours.offsets[{k}]"), message, help));
    }
    Ok(())
}

fn neighbourhood(raw: &RawNeighbours, lattice: &Lattice, elastic: Option<&Elastic>) -> Neighbourhood {
    match raw {
        RawNeighbours::First { keep } => Neighbourhood::First { keep: *keep },
        RawNeighbours::Chebyshev { radius } => Neighbourhood::Chebyshev { radius: *radius },
        RawNeighbours::Cells {} => material::of_cells(lattice, elastic),
        RawNeighbours::Second {} => Neighbourhood::Second,
        RawNeighbours::Collinear {} => Neighbourhood::Collinear,
        RawNeighbours::Offsets { offsets } => Neighbourhood::Offsets(offsets.clone()),
        RawNeighbours::Within { radius } => Neighbourhood::Within { radius: *radius },
        RawNeighbours::Dynamic { radius } => Neighbourhood::Dynamic { radius: *radius },
    }
}

/// Neighbours found anew at every step have no bonds, so whatever needs bonds is refused with them.
fn check_present_neighbours(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    if !matches!(raw.neighbours, Some(RawNeighbours::Dynamic { .. })) {
        return Ok(());
    }
    let clash = [
        ("frame", raw.frame != RawFrame::None, "a frame"),
        ("fracture", raw.fracture.is_some(), "fracture"),
        ("cuts", !raw.cuts.is_empty(), "cuts"),
        ("actions", actions::cuts(raw), "cuts"),
        ("rule.weights", raw.rule.weights.is_some(), "fixed weights"),
    ];
    match clash.into_iter().find(|(_, used, _)| *used) {
        None => Ok(()),
        Some((key, _, what)) => Err(refuse(
            key,
            format!("{what} cannot go with neighbours that are found anew at every step"),
            "use neighbours of kind \"within\", which are fixed at the start, or leave this out",
        )),
    }
}

/// Leaders led by the truth need a material to compute it for.
fn check_reference(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    let led = raw.roles.iter().position(|entry| matches!(entry.motion, Some(RawMotion::Reference { .. })));
    match led {
        Some(k) if raw.material.is_none() => Err(refuse(
            &format!("roles[{k}].motion"),
            "the truth is that of a material, and the scene has none".into(),
            "add [material] with kind = \"isotropic\", young and poisson",
        )),
        _ => Ok(()),
    }
}

/// A second gradient holds only with the neighbours, the mean and the unbroken bonds it is derived for.
fn check_gradient(raw: &RawScene, refuse: Refuse<'_>) -> Result<(), SceneError> {
    if !matches!(raw.rule.weights, Some(RawWeights::Gradient { .. })) {
        return Ok(());
    }
    if !matches!(raw.neighbours, Some(RawNeighbours::Collinear {})) {
        let message = "weights of kind \"gradient\" reach the sites behind the first neighbours".into();
        return Err(refuse("neighbours", message, "give `neighbours = { kind = \"collinear\" }`"));
    }
    if !matches!(raw.rule.mean, None | Some(RawMean::Barycentre)) {
        let message = "weights of kind \"gradient\" have negative parts, which this mean cannot take".into();
        return Err(refuse("rule.mean", message, "use kind = \"barycentre\""));
    }
    if raw.fracture.is_some() {
        let message = "weights of kind \"gradient\" are stable only while the bonds between a particle and \
                       the site behind its neighbour hold: bonds cannot break one by one"
            .into();
        return Err(refuse("fracture", message, "leave fracture out, or use other weights"));
    }
    Ok(())
}

pub(super) fn mean(raw: &RawMean, spacing: f64, refuse: Refuse<'_>) -> Result<Mean, SceneError> {
    let origin = |origin: RawOrigin| match origin {
        RawOrigin::Moving => Origin::Moving { margin: spacing },
        RawOrigin::World => Origin::World,
    };
    Ok(match *raw {
        RawMean::Barycentre => Mean::Barycentre,
        RawMean::Distance { power } => Mean::Distance { power },
        RawMean::Geometric { origin: from } => Mean::Power { exponent: 0.0, origin: origin(from) },
        RawMean::Power { exponent: 0.0, .. } => {
            let message = "exponent = 0 has no power mean".into();
            return Err(refuse(
                "rule.mean.exponent",
                message,
                "use kind = \"geometric\", which is its limit",
            ));
        }
        RawMean::Power { exponent, origin: from } => Mean::Power { exponent, origin: origin(from) },
        RawMean::Median => Mean::Median,
        RawMean::Spaced { spacing, power } => Mean::Spaced { spacing, power },
        RawMean::Material { rotation } => Mean::Material { rotation: rotation.into() },
    })
}

pub(super) fn feedback(raw: &RawFeedback) -> Feedback {
    Feedback { factor: raw.factor, reference: raw.reference.into() }
}

fn weights(raw: &Option<RawWeights>, refuse: Refuse<'_>) -> Result<Option<Weights>, SceneError> {
    Ok(match raw {
        None => None,
        Some(RawWeights::Distance { power }) => Some(Weights::Distance { power: *power }),
        Some(RawWeights::Solved {}) => Some(Weights::Solved),
        Some(RawWeights::Gradient { length }) => Some(Weights::Gradient { length: *length }),
        Some(RawWeights::List { values }) => {
            // Also refuses a sum that is nothing but rounding, whose mean would be noise.
            let (sum, size) = values.iter().fold((0.0, 0.0), |(s, a), v| (s + v, a + f64::abs(*v)));
            if !f64::is_finite(size) {
                let message = "the weights are too large to be added up".into();
                return Err(refuse(
                    "rule.weights.values",
                    message,
                    "give smaller ones: only their ratios count",
                ));
            }
            if sum.abs() <= 1e-12 * size {
                let message = format!("the weights add up to {sum}: no mean can be taken with them");
                return Err(refuse("rule.weights.values", message, "give weights with a sum other than 0"));
            }
            Some(Weights::List(values.clone()))
        }
    })
}

fn fracture(raw: &Option<RawFracture>, refuse: Refuse<'_>) -> Result<Option<Fracture>, SceneError> {
    let Some(raw) = raw else { return Ok(None) };
    let threshold = match (raw.distance, raw.stretch) {
        (Some(df), None) => Some(Threshold::Distance(df)),
        (None, Some(ratio)) => Some(Threshold::Stretch(ratio)),
        (None, None) => None,
        (Some(_), Some(_)) => {
            let message = "both a distance and a stretch are given".to_owned();
            return Err(refuse(
                "fracture.stretch",
                message,
                "keep the one that breaks the bonds of this scene",
            ));
        }
    };
    Ok(Some(Fracture { threshold, ghosts: raw.ghosts.into() }))
}

fn cuts(raw: &[RawCut], refuse: Refuse<'_>) -> Result<Vec<Segment>, SceneError> {
    if let Some(k) = raw.iter().position(|cut| cut.from == cut.to) {
        let message = format!("from = to = [{}, {}]: the cut has no length", raw[k].from[0], raw[k].from[1]);
        return Err(refuse(&format!("cuts[{k}].to"), message, "give its other end"));
    }
    Ok(raw.iter().map(|cut| (cut.from, cut.to)).collect())
}
