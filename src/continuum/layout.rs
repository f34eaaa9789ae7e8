//! From a scene to its body: particles, their neighbours, the cells between them, and their roles.

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use crate::engine::setup::RoleChange;
use crate::flock::body::{Body, BodyError, Cut, OutlineParticles};
use crate::flock::lattice::Site;
use crate::flock::motion::Motion;
use crate::flock::neighbourhood::{Neighbourhood, NeighbourhoodError, Neighbours};
use crate::flock::outlay::Outlay;
use crate::flock::region::{Region, Side};
use crate::flock::role::Role;
use crate::flock::rules::{Axis, Mean};
use crate::flock::vectors::{Vectors, distance};
use crate::geometry::locate::Finder;
use crate::geometry::outline::{Outline, OutlineError, Place};
use crate::geometry::partition::{Partition, PartitionError};
use crate::geometry::portion::{Portion, Selection};
use crate::material::boundary::Boundary;
use crate::material::cells::{Cells, neighbourhood, neighbourhood_of, templates};
use crate::material::fit::{FitError, Fitted, Part, fit_regions};
use crate::material::outline_loads::{self, Loader, OutlineLoad, Push};
use crate::scene::{BodySource, LeaderMotion, Load, RoleEntry, Scene, SceneError, SceneRegion};
use crate::solve::linear::HeldComponent;

/// A reference solution: displacements \[length\] of the body at these places of it at rest \[length\], shape \[count\].
pub type ReferenceMotion<'a> = &'a dyn Fn(&Vectors) -> Vec<[f64; 2]>;

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

    /// Role changes in the order in which they are written. Leaders led by a reference
    /// solution have no motion where that is not known.
    ///
    /// # Errors
    /// Names a region without particles, an id that does not exist, a table that misses a particle.
    pub fn role_changes(
        &self,
        scene: &Scene,
        solution: Option<ReferenceMotion<'_>>,
    ) -> Result<Vec<RoleChange>, SceneError> {
        let change = |(k, entry): (usize, &RoleEntry)| {
            let particles = self.pick(scene, &format!("roles[{k}]"), &entry.region)?;
            let motion = self.motion(scene, k, entry, &particles, solution)?;
            let RoleEntry { role, axis, from, when, .. } = *entry;
            Ok(RoleChange { particles, role, axis, from, when, motion })
        };
        scene.roles.iter().enumerate().map(change).collect()
    }

    /// Forces of each of the scene's loads on the particles \[force\], shape \[loads\]\[count\]; none without a
    /// material.
    ///
    /// # Errors
    /// Names the load that has nothing to act on.
    pub fn forces_by_load(
        &self,
        scene: &Scene,
        loads: &[outline_loads::Load],
    ) -> Result<Vec<Vectors>, SceneError> {
        let Some(cells) = &self.cells else { return Ok(Vec::new()) };
        if loads.is_empty() {
            return Ok(Vec::new());
        }
        let boundary = self.boundary();
        let loader = Loader::new(cells, &self.body, (self.outline.as_ref(), &boundary));
        let of_load = |k: usize| {
            let mut forces = Vectors::zeros(self.body.count());
            loader.add(&loads[k], &mut forces).map_err(|error| {
                let help = match error {
                    outline_loads::LoadError::NotFinite => "give finite numbers",
                    _ => "move the region onto particles that belong to cells",
                };
                scene.refuse(&format!("loads[{k}]"), error.to_string(), help)
            })?;
            Ok(forces)
        };
        (0..loads.len()).map(of_load).collect()
    }

    /// The scene's loads, each with the region that it acts on, in their order.
    ///
    /// # Errors
    /// Names a load whose region holds no particle or no part of the outline.
    pub fn loads(&self, scene: &Scene) -> Result<Vec<outline_loads::Load>, SceneError> {
        (0..scene.loads.len()).map(|k| self.load(scene, k)).collect()
    }

    fn load(&self, scene: &Scene, number: usize) -> Result<outline_loads::Load, SceneError> {
        let thickness = scene.material.as_ref().map_or(1.0, |elastic| elastic.thickness());
        let key = format!("loads[{number}]");
        Ok(match &scene.loads[number] {
            Load::Outline { region, push, profile } => {
                let portions = self.portions(scene, &key, region)?;
                let push = match push {
                    Push::Traction(traction) => Push::Traction(traction.map(|t| t * thickness)),
                    Push::Pressure(pressure) => Push::Pressure(pressure * thickness),
                };
                outline_loads::Load::Outline(OutlineLoad { portions, push, profile: *profile })
            }
            Load::Force { region, force } => {
                let particles = self.pick(scene, &key, region)?;
                let particles = particles.into_iter().map(|i| i as u32).collect();
                outline_loads::Load::Particles { particles, force: *force }
            }
            Load::Body { force } => outline_loads::Load::Body(force.map(|f| f * thickness)),
        })
    }

    /// The parts of the outline in the region that stands at `key`.
    ///
    /// # Errors
    /// Names a region without any, and a shape that has no outline.
    pub fn portions(
        &self,
        scene: &Scene,
        key: &str,
        region: &SceneRegion,
    ) -> Result<Vec<Portion>, SceneError> {
        let key = format!("{key}.region");
        check_ids(scene, &key, region, &self.body)?;
        let Some(outline) = &self.outline else {
            let message = "the shape has no outline that bounds one area: it crosses or touches itself";
            return Err(scene.refuse("body.shape", message, "mend the shape and its holes"));
        };
        check_pieces(scene, &key, region, outline)?;
        let portions = self.portions_of(region, outline);
        if portions.is_empty() {
            let (low, high) = outline.bounds();
            let message = format!(
                "no part of the outline lies in this region; the shape spans [{}, {}] to [{}, {}]",
                low[0], low[1], high[0], high[1]
            );
            let help = "move or widen the region; a curved side needs a depth";
            return Err(scene.refuse(&key, message, help));
        }
        Ok(portions)
    }

    fn portions_of(&self, region: &SceneRegion, outline: &Outline) -> Vec<Portion> {
        let spacing = self.body.lattice.spacing();
        let grain = 1e-9 * spacing;
        let (low, high) = outline.bounds();
        let band = |side: Side, depth: f64| {
            let (mut min, mut max) = (low, high);
            match side {
                Side::Left => max[0] = low[0] + depth,
                Side::Right => min[0] = high[0] - depth,
                Side::Bottom => max[1] = low[1] + depth,
                Side::Top => min[1] = high[1] - depth,
            }
            outline.portions(&Selection::Box { min, max }, grain)
        };
        match region {
            SceneRegion::Outline(selection) => outline.portions(selection, grain),
            SceneRegion::Outermost(side) => match band(*side, 0.0) {
                flat if !flat.is_empty() => flat,
                _ => band(*side, outermost_depth(*side, &self.body)),
            },
            SceneRegion::Known(region) => match region {
                Region::All | Region::Boundary => outline.portions(&Selection::All, grain),
                Region::Edge { side, depth } => band(*side, *depth),
                Region::Box { min, max } => outline.portions(&Selection::Box { min: *min, max: *max }, grain),
                Region::Disc { centre, radius } => {
                    outline.portions(&Selection::Disc { centre: *centre, radius: *radius }, grain)
                }
                Region::Ids(ids) => self.portions_between(ids, outline),
            },
        }
    }

    /// The outline along those sides of the cells' boundary both of whose particles have these ids.
    fn portions_between(&self, ids: &[usize], outline: &Outline) -> Vec<Portion> {
        let inside: HashSet<usize> = ids.iter().filter_map(|&id| self.body.index_of(id)).collect();
        let boundary = self.boundary();
        let sides = boundary.ends.iter().zip(&boundary.places);
        let sides = sides.filter(|(ends, _)| ends.iter().all(|end| inside.contains(end)));
        let grain = 1e-9 * self.body.lattice.spacing();
        let between = |&[from, to]: &[[f64; 2]; 2]| outline.portions(&Selection::Between { from, to }, grain);
        sides.flat_map(|(_, places)| between(places)).collect()
    }

    fn boundary(&self) -> Arc<Boundary> {
        let of_cells = || self.cells.as_ref().map(|cells| Boundary::of(cells, &self.body.reference));
        self.boundary.clone().unwrap_or_else(|| Arc::new(of_cells().unwrap_or_default()))
    }

    /// The particles on parts of the outline, or, of a body of whole cells, nearest to them, ascending.
    fn pick_along(&self, selection: &Selection, outline: &Outline) -> Vec<usize> {
        let near = 1e-6 * self.body.lattice.spacing();
        let portions = outline.portions(selection, 0.0);
        let candidates: Vec<(usize, Place)> = match &self.body.outline {
            Some(known) => (0..self.body.count()).filter_map(|i| Some((i, known.places[i]?))).collect(),
            None => {
                let boundary = Region::Boundary.pick(&self.body, &self.neighbours).into_iter();
                let finder = Finder::new(outline);
                boundary.map(|i| (i, finder.nearest(self.body.reference.get(i)).0)).collect()
            }
        };
        let is_on = |place: &Place| {
            let p = outline.point(*place);
            portions.iter().any(|portion| {
                let piece = outline.piece(portion.ring, portion.piece);
                let t = piece.nearest(p).clamp(portion.t[0], portion.t[1]);
                distance(piece.point(t), p) <= near
            })
        };
        candidates.into_iter().filter(|(_, place)| is_on(place)).map(|(i, _)| i).collect()
    }

    /// Particles of the region that stands at `key`.
    ///
    /// # Errors
    /// Names a region without particles and an id that does not exist.
    pub fn pick(&self, scene: &Scene, key: &str, region: &SceneRegion) -> Result<Vec<usize>, SceneError> {
        let key = format!("{key}.region");
        check_ids(scene, &key, region, &self.body)?;
        let mut particles = match (region, &self.outline) {
            (SceneRegion::Outline(selection), Some(outline)) => {
                check_pieces(scene, &key, region, outline)?;
                self.pick_along(selection, outline)
            }
            (SceneRegion::Outline(_), None) => {
                let message = "the body has no outline of its own";
                return Err(scene.refuse(&key, message, "pick the particles by place or by id"));
            }
            (SceneRegion::Known(region), _) => region.pick(&self.body, &self.neighbours),
            (SceneRegion::Outermost(side), _) => self.outermost(*side),
        };
        let exact = self.body.exact();
        particles.retain(|i| exact.contains(i));
        // Of a part it is nothing wrong if others have them.
        if particles.is_empty() && self.body.part.is_none() {
            return Err(self.holds_none(scene, &key));
        }
        Ok(particles)
    }

    /// The error for the region at `key` if it holds no particle.
    pub(super) fn holds_none(&self, scene: &Scene, key: &str) -> SceneError {
        let (low, high) = self.body.bounds();
        let message = format!(
            "no particle of the body lies in this region; the body spans [{}, {}] to [{}, {}]",
            low[0], low[1], high[0], high[1]
        );
        scene.refuse(key, message, "move or widen the region")
    }

    /// The particles at the outermost coordinate on a side; of a body that has no flat side there, those about half
    /// a spacing deep.
    fn outermost(&self, side: Side) -> Vec<usize> {
        let within = |depth: f64| Region::Edge { side, depth }.pick(&self.body, &self.neighbours);
        if self.body.outline.is_some() {
            let flat = within(FLAT * self.body.lattice.spacing());
            if self.flat.map_or(flat.len() > 1, |flat| flat[side as usize]) {
                return flat;
            }
        }
        within(outermost_depth(side, &self.body))
    }

    fn motion(
        &self,
        scene: &Scene,
        entry_number: usize,
        entry: &RoleEntry,
        particles: &[usize],
        solution: Option<ReferenceMotion<'_>>,
    ) -> Result<Option<Motion>, SceneError> {
        let reference = &self.body.reference;
        let (displacements, steps) = match &entry.motion {
            None => return Ok(None),
            Some(LeaderMotion::Program(motion)) => return Ok(Some(motion.clone())),
            Some(LeaderMotion::Table { rows, steps }) => {
                let of_rows = rows.of(particles, &self.body);
                let displacements = of_rows.map_err(|message| {
                    let key = format!("roles[{entry_number}].motion.file");
                    let help = "give every particle of the region a row, or narrow the region";
                    scene.refuse(&key, message, help)
                })?;
                (displacements, *steps)
            }
            Some(LeaderMotion::Reference { steps }) => {
                let Some(solution) = solution else { return Ok(None) };
                (solution(&particles.iter().map(|&i| reference.get(i)).collect()), *steps)
            }
        };
        Ok(Some(Motion::Table { displacements, steps: steps as f64 }))
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

/// Displacement \[length\] of each particle that does not follow, at `step`; `None` for followers and for leaders
/// led by a reference solution that is not known, shape \[count\]. Only roles that hold from the start count.
pub fn held(changes: &[RoleChange], body: &Body, step: f64) -> Vec<Option<[f64; 2]>> {
    let mut held = vec![None; body.count()];
    for change in changes.iter().filter(|change| change.is_at_once()) {
        for (which, &i) in change.particles.iter().enumerate().filter(|_| change.axis.is_none()) {
            let base = body.reference.get(i);
            held[i] = match (change.role, &change.motion) {
                (Role::Leader, Some(motion)) => Some(motion.displacement(step, which, base)),
                (Role::Clamped, _) => Some([0.0; 2]),
                _ => None,
            };
        }
    }
    held
}

/// The single components that are held at `step`, by particle and axis; later roles win, and none of a particle that is
/// held altogether.
pub fn held_components(changes: &[RoleChange], body: &Body, step: f64) -> Vec<HeldComponent> {
    let mut components: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for change in changes.iter().filter(|change| change.is_at_once()) {
        for (which, &i) in change.particles.iter().enumerate() {
            let Some(axis) = change.axis else {
                components.retain(|(particle, _), _| *particle != i);
                continue;
            };
            let moved = match &change.motion {
                Some(motion) => motion.displacement(step, which, body.reference.get(i)),
                None => [0.0; 2],
            };
            components.insert((i, axis as usize), moved[axis as usize]);
        }
    }
    let component = |((particle, axis), displacement)| {
        let axis = if axis == 0 { Axis::X } else { Axis::Y };
        HeldComponent { particle, axis, displacement }
    };
    components.into_iter().map(component).collect()
}

/// Depth within which particles stand on a flat side \[spacings\].
pub(super) const FLAT: f64 = 1e-6;

/// Least spacing over the distance of two doubles at the body's largest coordinate: six digits of a
/// displacement of one spacing.
const LEAST_RESOLUTION: f64 = 1e6;

/// Cells \[length\] within which areas, strains and pseudo-energies fit a double.
const CELLS: std::ops::RangeInclusive<f64> = 1e-152..=1e152;

/// Refuses a lattice whose squares of lengths no double holds.
fn require_in_range(scene: &Scene) -> Result<(), SceneError> {
    let sides = [[1, 0], [0, 1]].map(|step| distance(scene.lattice.vector(step), [0.0; 2]));
    match sides.into_iter().find(|side| !CELLS.contains(side)) {
        None => Ok(()),
        Some(side) => {
            let message = format!("particles {side:e} apart: no double holds the squares of such lengths");
            let help = "use another unit of length, with distances from 1e-152 to 1e152";
            Err(scene.refuse(key_of_spacing(scene), message, help))
        }
    }
}

/// The key that says how far apart particles are.
fn key_of_spacing(scene: &Scene) -> &'static str {
    match scene.body {
        BodySource::Cut(_) => "lattice",
        BodySource::Points(_) => "body.shape",
    }
}

/// Refuses a body whose places, or small displacements from them, doubles cannot resolve.
fn require_resolved(scene: &Scene, body: &Body) -> Result<(), SceneError> {
    let spacing = body.lattice.spacing();
    let Vectors { x, y } = &*body.reference;
    let farthest = x.iter().chain(y).fold(0.0, |most: f64, v| most.max(v.abs()));
    let grain = farthest.next_up() - farthest;
    // Not a number where the body reaches beyond the doubles.
    let is_resolved = spacing >= LEAST_RESOLUTION * grain;
    if !is_resolved {
        let message = format!(
            "particles {spacing:e} apart with coordinates up to {farthest:e}: a double has steps of {grain:.1e} there, and \
             displacements would be rounded to them"
        );
        let key = if scene.raw.body.anchor.is_some() { "body.anchor" } else { "body.shape" };
        return Err(scene.refuse(key, message, "put the origin of the coordinates near the body"));
    }
    Ok(())
}

pub(super) fn refuse_pieces(scene: &Scene, error: &BodyError) -> SceneError {
    let help = "close the gap, use a wider neighbourhood, or run the parts as scenes of their own";
    scene.refuse("body.shape", error.to_string(), help)
}

pub(super) fn refuse_body(scene: &Scene, error: &BodyError) -> SceneError {
    let (key, help) = match error {
        BodyError::Alone { .. } => {
            ("neighbours.radius", "use a wider radius, or leave the point out of the file")
        }
        BodyError::TooManyNeighbours { .. }
        | BodyError::ManyNeighbours { .. }
        | BodyError::Neighbourhood(NeighbourhoodError::TooLarge { .. }) => {
            ("neighbours.radius", "use a smaller radius")
        }
        BodyError::Neighbourhood(_) => ("neighbours", "choose a neighbourhood that the lattice has"),
        BodyError::TooLarge { .. } => ("body.shape", "use a wider spacing or a smaller shape"),
        _ => ("body.shape", "use a smaller spacing or a larger shape"),
    };
    scene.refuse(key, error.to_string(), help)
}

fn check_ids(scene: &Scene, key: &str, region: &SceneRegion, body: &Body) -> Result<(), SceneError> {
    let SceneRegion::Known(Region::Ids(ids)) = region else { return Ok(()) };
    for (n, &id) in ids.iter().enumerate() {
        let message = match body.particle(id).map(|i| body.is_frame[i]) {
            Some(false) => continue,
            Some(true) => format!("particle {id} belongs to the frame, whose role is fixed"),
            None if body.part.is_some() && (1..=body.total()).contains(&id) => continue,
            None => no_particle(id, body),
        };
        let help = match body.numbering {
            Some(_) => "ids are those of the body's file, or the numbers of its rows",
            None => {
                "particles count from 1, column by column from the bottom left, the frame's included; in a report a \
                 particle that is pointed at shows its number"
            }
        };
        return Err(scene.refuse(&format!("{key}.ids[{n}]"), message, help));
    }
    Ok(())
}

/// Message that no particle has this id.
pub(super) fn no_particle(id: usize, body: &Body) -> String {
    let ids = body.rows().map(|i| body.id(i));
    let (low, high) = match &body.part {
        Some(part) => (1, part.total),
        None => ids.fold((usize::MAX, 0), |(low, high), id| (low.min(id), high.max(id))),
    };
    format!("there is no particle {id}: ids run from {low} to {high}")
}

/// Refuses a hole or a piece that the outline does not have.
fn check_pieces(scene: &Scene, key: &str, region: &SceneRegion, outline: &Outline) -> Result<(), SceneError> {
    let SceneRegion::Outline(Selection::Pieces { ring, pieces, .. }) = region else { return Ok(()) };
    let rings = outline.rings();
    if *ring >= rings.len() {
        let message = match rings.len() - 1 {
            0 => "the body has no holes".to_owned(),
            holes => format!("there is no hole {ring}: the body has {holes}"),
        };
        return Err(scene.refuse(&format!("{key}.hole"), message, "count body.holes from 1"));
    }
    let known: HashSet<usize> = rings[*ring].iter().map(|piece| piece.number).collect();
    match pieces.iter().position(|number| !known.contains(number)) {
        None => Ok(()),
        Some(k) => {
            let most = rings[*ring].iter().map(|piece| piece.number + 1).max().unwrap_or(0);
            let message = format!("there is no piece {}: they run from 1 to {most}", pieces[k] + 1);
            Err(scene.refuse(&format!("{key}.pieces[{k}]"), message, "`flockform plan` prints the pieces"))
        }
    }
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

/// Names the part of the body that is too narrow, or too large, for the lattice.
pub(super) fn refuse_fit(scene: &Scene, error: &FitError) -> SceneError {
    let help = match error {
        FitError::TooLarge { .. } => "use a wider spacing or a smaller shape",
        _ => "use a smaller spacing, leave the detail out, or set body.outline = \"lattice\"",
    };
    let key = match error {
        FitError::SmallHole { hole, .. } => format!("body.holes[{}]", hole - 1),
        FitError::Narrow { part, .. } => part_key(*part),
        FitError::Detail { .. } | FitError::TooLarge { .. } => "body.shape".into(),
    };
    scene.refuse(&key, error.to_string(), help)
}

/// The key of what bounds the body: its shape, one of its holes, one of its inclusions.
fn part_key(part: Part) -> String {
    match part {
        Part::Outer => "body.shape".into(),
        Part::Hole(hole) => format!("body.holes[{}]", hole - 1),
        Part::Region(region) => format!("body.inclusions[{}].shape", region - 1),
    }
}

/// The outline with the edges of the scene's inclusions.
///
/// # Errors
/// Names an inclusion that has no outline, or no part of the body.
fn divided(scene: &Scene, outline: &Outline) -> Result<Partition, SceneError> {
    let shapes: Vec<_> = scene.inclusions.iter().map(|part| part.shape.clone()).collect();
    Partition::new(outline, &shapes).map_err(|error| {
        let (message, region, help) = match &error {
            PartitionError::Outline { region, reason } => {
                (reason.to_string(), region, "give its corners in order, once around")
            }
            PartitionError::Outside { region } => {
                ("it has no part of the body".to_owned(), region, "move it into the body, or leave it out")
            }
        };
        scene.refuse(&format!("body.inclusions[{}].shape", region - 1), message, help)
    })
}

fn refuse_outline(scene: &Scene, error: &OutlineError) -> SceneError {
    let (key, help) = match error {
        OutlineError::Touching { rings: [_, hole], .. }
        | OutlineError::Outside { hole, .. }
        | OutlineError::Nested { inner: hole, .. } => (
            format!("body.holes[{}]", hole - 1),
            "keep holes inside and apart, draw a notch as part of a polygon, or set body.outline = \"lattice\"",
        ),
        OutlineError::SelfCrossing { ring, .. } | OutlineError::NoArea { ring, .. } => {
            let key = if *ring == 0 { "body.shape".into() } else { format!("body.holes[{}]", ring - 1) };
            (key, "give its corners in order, once around")
        }
        OutlineError::TooDense { .. } => ("body.shape".into(), "or set body.outline = \"lattice\""),
    };
    scene.refuse(&key, error.to_string(), help)
}

/// Refuses neighbours as written that leave out a particle sharing a cell.
fn require_cell_neighbours(scene: &Scene) -> Result<(), SceneError> {
    let refuse = |message: String| {
        let help = "use kind = \"cells\", or leave the neighbours out: the rule takes those that it needs";
        scene.refuse("neighbours", message, help)
    };
    let offsets = |neighbourhood: &Neighbourhood| {
        neighbourhood.offsets(&scene.lattice).map_err(|error| refuse(error.to_string()))
    };
    let needed = match scene.farthest_seeing() {
        Some(elastic) => neighbourhood_of(&scene.lattice, elastic),
        None => neighbourhood(&scene.lattice),
    };
    let (given, needed) = (offsets(&scene.neighbourhood)?, offsets(&needed)?);
    let has_all = |(given, needed): (&Vec<Site>, &Vec<Site>)| needed.iter().all(|site| given.contains(site));
    if given.iter().zip(&needed).all(has_all) {
        return Ok(());
    }
    Err(refuse(format!(
        "{} neighbours cannot carry shear coupling: particles share a cell but are no neighbours, so the cell's \
         stiffness is cut",
        given[0].len()
    )))
}

/// Whether the outline cuts no cell: then the body is that of the lattice.
fn is_all_whole(cells: &Cells) -> bool {
    cells.shapes.len() == cells.whole
}

/// Deep enough for a staggered edge: less than one period of the lattice's rows across the side.
fn outermost_depth(side: Side, body: &Body) -> f64 {
    let k = usize::from(matches!(side, Side::Bottom | Side::Top));
    let steps =
        body.lattice.first_neighbours(0).into_iter().map(|offset| body.lattice.vector(offset)[k].abs());
    let spacing = body.lattice.spacing();
    let shortest = steps.clone().filter(|&step| step > 1e-6 * spacing).fold(f64::INFINITY, f64::min);
    let longest = steps.fold(0.0, f64::max);
    // Rows that are staggered by part of a period count as one edge.
    if longest > 1.5 * shortest { 0.75 * longest } else { shortest / 2.0 }
}
