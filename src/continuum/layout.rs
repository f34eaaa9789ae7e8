//! From a scene to its body: particles, their neighbours, the cells between them, and their roles.

mod loads;
pub(super) mod refusals;
pub(crate) mod regions;
pub mod roles;

use std::sync::Arc;

use self::refusals::{
    CORNERS, refuse_body, refuse_fit, refuse_outline, refuse_pieces, require_cell_neighbours, require_holes,
    require_in_range, require_resolved,
};
use crate::flock::body::{Body, BodyError, Cut, OutlineParticles};
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::outlay::Outlay;
use crate::flock::rules::Mean;
use crate::geometry::outline::Outline;
use crate::geometry::partition::{Partition, PartitionError};
use crate::material::boundary::Boundary;
use crate::material::cells::{Cells, templates};
use crate::material::fit::{Fitted, fit_regions};
use crate::scene::{BodySource, Scene, SceneError};

/// A body laid out, before any particle moves.
#[derive(Clone, Debug)]
pub struct Layout {
    /// The particles.
    pub body: Body,
    /// Which particle sees which.
    pub neighbours: Neighbours,
    /// Between the particles, where the scene has a material.
    pub cells: Option<Cells>,
    /// The outline of the body's shape; none where the shape has none that bounds an area, and for points.
    pub outline: Option<Outline>,
    /// The outline with the edges of inclusions, where there are any.
    pub partition: Option<Partition>,
    /// The boundary of the cells of the whole body, where this is a part of it and the boundary is needed.
    pub boundary: Option<Arc<Boundary>>,
    /// Whether the body, of which this is a part, is flat on its left, right, bottom and top: several particles of its outline stand
    /// there.
    pub flat: Option<[bool; 4]>,
}

impl Layout {
    /// # Errors
    /// Names the key of the scene that cannot be laid out: an empty or disconnected body, a
    /// neighbourhood that does not fit the lattice.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        require_in_range(scene)?;
        let fitted = fitted(scene)?;
        let layout = match fitted {
            Some((fitted, partition)) if !is_all_whole(&fitted.cells) => {
                Self::of_cut_cells(scene, fitted, partition)?
            }
            of_lattice => {
                let body = body_of(scene).map_err(|error| refuse_body(scene, &error))?;
                let is_same = |(fitted, _): &(Fitted, Partition)| fitted.body.sites == body.0.sites;
                let kept = of_lattice.filter(is_same);
                let kept = kept.map(|(fitted, partition)| (fitted.body.outline, partition));
                Self::of_whole_cells(scene, body, kept, None)?
            }
        };
        if !matches!(scene.neighbourhood, Neighbourhood::Dynamic { .. }) {
            let connected = layout.body.require_connected(&layout.neighbours);
            connected.map_err(|error| refuse_pieces(scene, &error))?;
        }
        Ok(layout)
    }

    /// A body, or a part of one, whose cells an outline has cut.
    pub(super) fn of_cut_cells(
        scene: &Scene,
        Fitted { body, mut cells }: Fitted,
        partition: Partition,
    ) -> Result<Self, SceneError> {
        require_in_range(scene)?;
        cells.inclusions = scene.inclusions.iter().map(|part| part.material).collect();
        require_resolved(scene, &body)?;
        require_cell_neighbours(scene)?;
        let mut neighbours = match &scene.material {
            Some(elastic) => cells.neighbours(body.count(), elastic),
            None => cells.cell_neighbours(body.count()),
        };
        if body.part.is_some() {
            // In the order of the whole body.
            let listed = |i: usize| {
                let mut seen = neighbours.of(i).to_vec();
                seen.sort_by_key(|&k| body.index(k as usize));
                seen
            };
            neighbours = Neighbours::from_lists((0..body.count()).map(listed));
        }
        let outline = Some(partition.outline().clone());
        let partition = Some(partition).filter(|_| !scene.inclusions.is_empty());
        Ok(Self { body, neighbours, cells: Some(cells), outline, partition, boundary: None, flat: None })
    }

    /// A part of a body of whole cells, or of particles alone, which stand on a lattice; where it keeps its outline, with that.
    ///
    /// # Errors
    /// As [`Layout::new`].
    pub(super) fn of_part(
        scene: &Scene,
        body: (Body, Neighbours),
        kept: Option<(Option<Arc<OutlineParticles>>, Partition)>,
        boundary: Option<Arc<Boundary>>,
    ) -> Result<Self, SceneError> {
        require_in_range(scene)?;
        Self::of_whole_cells(scene, body, kept, boundary)
    }

    /// A body of whole cells, or of particles alone; one that fits its outline as it is keeps that.
    fn of_whole_cells(
        scene: &Scene,
        (mut body, neighbours): (Body, Neighbours),
        kept: Option<(Option<Arc<OutlineParticles>>, Partition)>,
        boundary: Option<Arc<Boundary>>,
    ) -> Result<Self, SceneError> {
        require_resolved(scene, &body)?;
        if kept.is_none() {
            require_holes(scene)?;
        }
        let mut cells = scene.material.as_ref().map(|_| Cells::of_body(&body));
        let (outline, partition) = match (&scene.body, &cells, kept) {
            (_, _, Some((outline, partition))) => {
                body.outline = outline;
                (Some(partition.outline().clone()), Some(partition))
            }
            (BodySource::Cut(Cut::Shape(shape)), ..) => match Outline::of_shape(shape) {
                Ok(outline) => {
                    let partition = divided(scene, &outline)?;
                    (Some(partition.outline().clone()), Some(partition))
                }
                Err(error) if !scene.inclusions.is_empty() => return Err(refuse_outline(scene, &error)),
                Err(_) => (None, None),
            },
            (BodySource::Cut(Cut::Count { .. }), Some(cells), _) => {
                let outline = match (&boundary, &body.part) {
                    (Some(boundary), _) => boundary.outline().ok(),
                    (None, None) => cells.outline(&body.reference).ok(),
                    (None, Some(_)) => None,
                };
                (outline, None)
            }
            _ => (None, None),
        };
        let partition = partition.filter(|_| !scene.inclusions.is_empty());
        if let (Some(cells), Some(partition)) = (&mut cells, &partition) {
            let regions = scene.inclusions.len() + 1;
            cells.divide(&body.reference, regions, |p| partition.region(p));
            cells.inclusions = scene.inclusions.iter().map(|part| part.material).collect();
        }
        Ok(Self { body, neighbours, cells, outline, partition, boundary, flat: None })
    }

    /// Refuses an inclusion that has no cell: it would make no difference. `is_anywhere` is for all parts of a body, what one has.
    pub(super) fn require_inclusions(
        &self,
        scene: &Scene,
        is_anywhere: impl Fn(bool) -> bool,
    ) -> Result<(), SceneError> {
        for k in 0..scene.inclusions.len() {
            let is_of = |cells: &Cells| (0..cells.count()).any(|cell| cells.region_of(cell) == k as u32 + 1);
            if !is_anywhere(self.cells.as_ref().is_some_and(is_of)) {
                let shape = &scene.inclusions[k].shape;
                let is_within = |cells: &Cells| {
                    cells.centroids(&self.body.reference).any(|middle| shape.contains(middle, 0.0))
                };
                let (message, help) = match is_anywhere(self.cells.as_ref().is_some_and(is_within)) {
                    true => (
                        "later entries cover all of it",
                        "list it after them, so that it counts where they overlap, or leave it out",
                    ),
                    false => (
                        "no cell of the lattice has its middle in it",
                        "use a smaller lattice.spacing, or leave it out",
                    ),
                };
                return Err(scene.refuse(&format!("body.inclusions[{k}].shape"), message, help));
            }
        }
        Ok(())
    }
}

fn body_of(scene: &Scene) -> Result<(Body, Neighbours), BodyError> {
    match (&scene.body, &scene.neighbourhood) {
        (BodySource::Cut(cut), _) => outlay_of(scene, cut).lay_out(None),
        (BodySource::Points(cloud), Neighbourhood::Within { radius }) => Body::of_cloud(cloud, Some(*radius)),
        (BodySource::Points(cloud), _) => Body::of_cloud(cloud, None),
    }
}

/// The things that the body is laid out from; where the rule is a material sites in no cell, which carry nothing, are none.
pub(super) fn outlay_of<'a>(scene: &'a Scene, cut: &'a Cut) -> Outlay<'a> {
    let Scene { lattice, neighbourhood, frame, .. } = scene;
    let cells = match scene.mean {
        Mean::Material { .. } => templates(lattice),
        _ => Vec::new(),
    };
    Outlay { lattice, cut, neighbourhood, frame: *frame, cells }
}

/// The body fitted to its outline, where the scene asks for that.
///
/// # Errors
/// Names what in the shape has no outline that cells can follow.
fn fitted(scene: &Scene) -> Result<Option<(Fitted, Partition)>, SceneError> {
    let Some(partition) = to_be_fitted(scene)? else { return Ok(None) };
    let fitted = fit_regions(&scene.lattice, &partition).map_err(|error| refuse_fit(scene, &error))?;
    Ok(Some((fitted, partition)))
}

/// The outline that the body is to be fitted to, where the scene asks for that.
///
/// # Errors
/// Names what in the shape has no outline that cells can follow.
pub(super) fn to_be_fitted(scene: &Scene) -> Result<Option<Partition>, SceneError> {
    let (true, BodySource::Cut(Cut::Shape(shape))) = (scene.is_fitted, &scene.body) else { return Ok(None) };
    let outline = Outline::of_shape(shape).map_err(|error| refuse_outline(scene, &error))?;
    divided(scene, &outline).map(Some)
}

/// The outline with the edges of the scene's inclusions.
///
/// # Errors
/// Names an inclusion that has no outline, or no part of the body.
fn divided(scene: &Scene, outline: &Outline) -> Result<Partition, SceneError> {
    let shapes: Vec<_> = scene.inclusions.iter().map(|part| part.shape.clone()).collect();
    Partition::new(outline, &shapes).map_err(|error| {
        let (message, region, help) = match &error {
            PartitionError::Outline { region, reason } => (reason.to_string(), region, CORNERS),
            PartitionError::Outside { region } => {
                ("it has no part of the body".to_owned(), region, "move it into the body, or leave it out")
            }
        };
        scene.refuse(&format!("body.inclusions[{}].shape", region - 1), message, help)
    })
}

/// Whether the outline cuts no cell: then the body is that of the lattice.
fn is_all_whole(cells: &Cells) -> bool {
    cells.shapes.len() == cells.whole
}
