//! The sources of an error: the solver, the outline of the cells, the cells themselves.
//!
//! Between the rule's run and the truth of the shape stand two more displacements of the same body: the rule's own
//! equilibrium, solved as far as doubles go, and the truth of the shape that the cells have, whose outline is made of
//! their sides. The three steps from one to the next are what the solver, the cells and their outline leave.

use serde::{Deserialize, Serialize};

use super::reference::{Reference, Setting};
use super::run::{SceneReference, plan_led_by, refused};
use super::supports::supports;
use crate::continuum::equilibrium::solve_equilibrium;
use crate::continuum::layout::Layout;
use crate::fem::{Effort, Holding};
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::Point;
use crate::geometry::outline::Outline;
use crate::geometry::piece::Piece;
use crate::geometry::portion::Portion;
use crate::material::outline_loads::{Load, OutlineLoad};
use crate::scene::{Scene, SceneError};
use crate::solve::equilibrium::{Precision, Request};

/// Residual over load beyond which nothing of a solver's error is left to see.
const TIGHT: f64 = 1e-10;

/// An outline of more sides than this is not meshed to measure its cost.
const MOST_SIDES: usize = 600;

/// Parts of an error, each relative to the truth in the L2 norm over the followers \[1\]; they need not add up. `None`
/// where a part cannot be measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorParts {
    /// From the rule's equilibrium to the truth of the shape of its cells.
    pub discretisation: Option<f64>,
    /// From there to the truth of the shape itself.
    pub outline: Option<f64>,
    /// From the run's end to the rule's equilibrium.
    pub solver: Option<f64>,
}

impl ErrorParts {
    /// The parts of the error of displacements `rule` \[length\], shape \[particles\], at those that follow.
    ///
    /// # Errors
    /// Names what in the scene has no plan; a part that cannot be computed is left out.
    pub fn of(
        scene: &Scene,
        truth: &SceneReference,
        rule: &Vectors,
        follows: &[bool],
    ) -> Result<Self, SceneError> {
        let own = equilibrium(scene, &truth.solution);
        let cells = reference_of_cells(scene, truth)?;
        let known = &truth.solution.displacement;
        let apart = |a: &Vectors, b: &Vectors| {
            let (mut off, mut size) = (0.0, 0.0);
            for i in (0..follows.len()).filter(|&i| follows[i]) {
                off += distance(a.get(i), b.get(i)).powi(2);
                size += distance(known.get(i), [0.0; 2]).powi(2);
            }
            if off == 0.0 { 0.0 } else { (off / size).sqrt() }
        };
        Ok(Self {
            discretisation: cells.as_ref().map(|cells| apart(own.as_ref().unwrap_or(rule), cells)),
            outline: cells.as_ref().map(|cells| apart(cells, known)),
            solver: own.as_ref().map(|own| apart(rule, own)),
        })
    }
}

/// The place of rest of the rule, if it can be solved for.
fn equilibrium(scene: &Scene, truth: &Reference) -> Option<Vectors> {
    let request = Request { tolerance: TIGHT, precision: Precision::F64, ..Request::default() };
    let outcome = solve_equilibrium(scene, &request, plan_led_by(scene, truth).ok()?).ok()?;
    let is_known = outcome.solved.as_ref().is_some_and(|solved| solved.is_at_rest());
    is_known.then(|| outcome.engine.displacements())
}

/// The outline of the shape, and that of its cells.
pub(super) fn outlines(layout: &Layout) -> Option<(&Outline, Outline)> {
    let of_cells = layout.cells.as_ref()?.outline(&layout.body.reference).ok()?;
    Some((layout.outline.as_ref()?, of_cells))
}

/// Whether the cells have the shape itself.
pub(super) fn are_alike(outline: &Outline, of_cells: &Outline) -> bool {
    let agrees = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b;
    agrees(of_cells.area(), outline.area()) && agrees(of_cells.length(), outline.length())
}

/// The truth of the shape that the cells have; the same where that is the shape itself.
fn reference_of_cells(scene: &Scene, truth: &SceneReference) -> Result<Option<Vectors>, SceneError> {
    let layout = &truth.layout;
    let Some((outline, of_cells)) = outlines(layout) else { return Ok(None) };
    if are_alike(outline, &of_cells) {
        return Ok(Some(truth.solution.displacement.clone()));
    }
    // Edges of inclusions that end on the outline do not end on that of the cells.
    if of_cells.pieces().count() > MOST_SIDES || layout.partition.is_some() {
        return Ok(None);
    }
    let changes = layout.role_changes(scene, None)?;
    let mut supports = supports(scene, layout, outline, &changes, scene.stop.steps as f64)?;
    for support in &mut supports {
        if let Holding::Portions(portions) = &mut support.on {
            *portions = carried(portions, outline, &of_cells);
        }
    }
    supports.retain(|support| !matches!(&support.on, Holding::Portions(portions) if portions.is_empty()));
    let loads = layout.loads(scene)?;
    let others: Vec<Load> = loads.iter().filter(|load| !matches!(load, Load::Outline(_))).cloned().collect();
    let elastic = &truth.elastic;
    let setting = Setting { scene, layout, elastic, outline: &of_cells, supports, loads: &others };
    let pushed = loads.iter().filter_map(|load| match load {
        Load::Outline(load) => Some((carried(&load.portions, outline, &of_cells), pushed(load, outline))),
        _ => None,
    });
    match Reference::solve_with(setting, pushed.collect(), &Effort::default()) {
        Ok(found) => Ok(Some(found.displacement)),
        // The shape of the cells may have no truth where the shape itself has one.
        Err(error) => {
            tracing::debug!("{}", refused(scene, &error));
            Ok(None)
        }
    }
}

/// A load of the true outline, per length of a side that stands for it \[force / length\]: as much of it as the side
/// hides when looked at along the true normal.
fn pushed<'a>(load: &'a OutlineLoad, outline: &'a Outline) -> impl Fn(Point, Point) -> Point + 'a {
    move |p, normal| {
        let pieces = load.portions.iter().map(|portion| [portion.ring, portion.piece]);
        let Some((place, _)) = outline.nearest_among(p, pieces) else { return [0.0; 2] };
        let piece = outline.piece(place.ring, place.piece);
        let own = piece.normal(place.t);
        let share = (normal[0] * own[0] + normal[1] * own[1]).max(0.0);
        load.at(piece.point(place.t), own).map(|f| share * f)
    }
}

/// Parts in which a piece is asked for where its places belong.
const SAMPLES: usize = 24;

/// Sides whose normal is turned further than this from the outline's stand for another part of it: a cosine \[1\].
const TURNED: f64 = 0.3;

/// The parts of another outline whose nearest places on an outline that faces the same way lie in portions of it.
fn carried(portions: &[Portion], from: &Outline, to: &Outline) -> Vec<Portion> {
    let belongs = |p: Point, normal: Point| {
        let faces = |piece: &Piece| {
            let own = piece.normal(piece.nearest(p));
            own[0] * normal[0] + own[1] * normal[1] > TURNED
        };
        let facing = from.pieces().filter(|(.., piece)| faces(piece)).map(|(ring, number, _)| [ring, number]);
        let Some((place, _)) = from.nearest_among(p, facing) else { return false };
        portions.iter().any(|portion| portion.has(place))
    };
    let mut found = Vec::new();
    for (ring, number, piece) in to.pieces() {
        let middle = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
        let inside: Vec<bool> =
            (0..SAMPLES).map(|k| belongs(piece.point(middle(k)), piece.normal(middle(k)))).collect();
        let mut begin = inside[0].then_some(0.0);
        for k in 1..SAMPLES {
            if inside[k] == inside[k - 1] {
                continue;
            }
            let (mut a, mut b) = (middle(k - 1), middle(k));
            for _ in 0..40 {
                let half = 0.5 * (a + b);
                let is_before = belongs(piece.point(half), piece.normal(half)) == inside[k - 1];
                if is_before { a = half } else { b = half }
            }
            match begin.take() {
                Some(from) => found.push(Portion { ring, piece: number, t: [from, a] }),
                None => begin = Some(b),
            }
        }
        found.extend(begin.map(|from| Portion { ring, piece: number, t: [from, 1.0] }));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn portions_are_carried_to_the_sides_of_a_staircase() {
        let slope = Outline::of_polygons(&[vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]]]).unwrap();
        let stairs =
            [[1.0, 0.0], [4.0, 0.0], [4.0, 3.0], [3.0, 3.0], [3.0, 2.0], [2.0, 2.0], [2.0, 1.0], [1.0, 1.0]];
        let stairs = Outline::of_polygons(&[stairs.to_vec()]).unwrap();
        let found = carried(&[Portion::whole(0, 2)], &slope, &stairs);
        let length: f64 = found.iter().map(|portion| portion.length(&stairs)).sum();
        assert!((length - 6.0).abs() < 1e-6, "all steps of the stairs: {length}");
        let right = carried(&[Portion { ring: 0, piece: 1, t: [0.25, 0.5] }], &slope, &stairs);
        let length: f64 = right.iter().map(|portion| portion.length(&stairs)).sum();
        assert!((length - 1.0).abs() < 1e-6, "{length}");
    }
}
