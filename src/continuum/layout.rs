//! From a scene to its body: particles, who sees whom, the cells between them, and who has which role.

use crate::flock::body::{Body, BodyError};
use crate::flock::motion::Motion;
use crate::flock::neighbourhood::{Neighbourhood, Neighbours};
use crate::flock::points::{Points, distance};
use crate::flock::region::{Region, Side};
use crate::flock::role::Role;
use crate::flock::rules::Mean;
use crate::material::cells::{Cells, without_loose_sites};
use crate::material::loads::{LoadError, Loads, Traction};
use crate::scene::{BodySource, Condition, LeaderMotion, Load, RoleEntry, Scene, SceneError, SceneRegion};

/// Where finite elements have points of the body: their displacements \[length\] at these reference
/// places \[length\], shape \[count\].
pub type Truth<'a> = &'a dyn Fn(&Points) -> Vec<[f64; 2]>;

/// A body laid out, before anybody moves.
#[derive(Clone, Debug)]
pub struct Layout {
    pub body: Body,
    pub neighbours: Neighbours,
    /// Between the particles, where the scene has a material.
    pub cells: Option<Cells>,
}

/// A role that some particles take.
#[derive(Clone, Debug)]
pub struct RoleChange {
    pub particles: Vec<usize>,
    pub role: Role,
    /// First step at which it holds.
    pub from: usize,
    pub when: Option<Condition>,
    /// How leaders move; none for those led by a truth that is not known yet.
    pub motion: Option<Motion>,
}

impl Layout {
    /// # Errors
    /// Names the key of the scene that cannot be laid out: an empty or disconnected body, a
    /// neighbourhood that does not fit the lattice.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        require_in_range(scene)?;
        let (body, neighbours) = body_of(scene).map_err(|error| refuse_body(scene, &error))?;
        require_resolved(scene, &body)?;
        let layout = match scene.mean {
            Mean::Material { .. } => {
                // Sites in no cell carry nothing; they stick out of a curved edge.
                let (body, neighbours, cells) = without_loose_sites(&body, &neighbours);
                if body.count() == 0 {
                    let message = "the body has no cell of the lattice, so there is no material";
                    return Err(scene.refuse(
                        "body.shape",
                        message,
                        "use a smaller spacing or a larger shape",
                    ));
                }
                Self { body, neighbours, cells: Some(cells) }
            }
            _ => {
                let cells = scene.material.as_ref().map(|_| Cells::of_body(&body));
                Self { body, neighbours, cells }
            }
        };
        if !matches!(scene.neighbourhood, Neighbourhood::Present { .. }) {
            layout.body.require_connected(&layout.neighbours).map_err(|error| {
                let help =
                    "close the gap, use a wider neighbourhood, or run the parts as scenes of their own";
                scene.refuse("body.shape", error.to_string(), help)
            })?;
        }
        Ok(layout)
    }

    /// Who takes which role when, in the order in which it is written. Leaders led by the truth have no
    /// motion where `truth` is not known.
    ///
    /// # Errors
    /// Names a region without particles, an id that does not exist, a table that misses a particle.
    pub fn role_changes(
        &self,
        scene: &Scene,
        truth: Option<Truth<'_>>,
    ) -> Result<Vec<RoleChange>, SceneError> {
        let change = |(k, entry): (usize, &RoleEntry)| {
            let particles = self.pick(scene, &format!("roles[{k}]"), &entry.region)?;
            let motion = self.motion(scene, k, entry, &particles, truth)?;
            Ok(RoleChange { particles, role: entry.role, from: entry.from, when: entry.when, motion })
        };
        scene.roles.iter().enumerate().map(change).collect()
    }

    /// Forces of the scene's loads on the particles \[force\], shape \[count\]; `None` without loads.
    ///
    /// # Errors
    /// Names the load that has nothing to act on.
    pub fn forces(&self, scene: &Scene) -> Result<Option<Points>, SceneError> {
        let Some(cells) = &self.cells else { return Ok(None) };
        if scene.loads.is_empty() {
            return Ok(None);
        }
        self.loads(scene)?.on_particles(cells, &self.body.reference).map(Some).map_err(|error| {
            let help = match error {
                LoadError::NotFinite => "give finite numbers",
                _ => "move the region onto particles that belong to cells",
            };
            scene.refuse("loads", error.to_string(), help)
        })
    }

    /// The scene's loads on the sides and particles that they act on; none without a material.
    ///
    /// # Errors
    /// Names a load whose region holds no particle or no side.
    pub fn loads(&self, scene: &Scene) -> Result<Loads, SceneError> {
        let mut loads = Loads::default();
        let (Some(cells), Some(elastic)) = (&self.cells, &scene.material) else { return Ok(loads) };
        let thickness = elastic.thickness();
        for (k, load) in scene.loads.iter().enumerate() {
            match load {
                Load::Traction { region, traction } => {
                    let sides = self.boundary_sides(scene, k, region, cells)?;
                    let traction = traction.map(|t| t * thickness);
                    loads.tractions.extend(sides.into_iter().map(|side| Traction::uniform(side, traction)));
                }
                Load::Force { region, force } => {
                    let particles = self.pick(scene, &format!("loads[{k}]"), region)?;
                    loads.forces.extend(particles.into_iter().map(|i| (i as u32, *force)));
                }
                Load::Body { force } => {
                    loads.body = [0, 1].map(|axis| loads.body[axis] + thickness * force[axis]);
                }
            }
        }
        Ok(loads)
    }

    /// Sides of the boundary both of whose particles are in the region.
    fn boundary_sides(
        &self,
        scene: &Scene,
        load: usize,
        region: &SceneRegion,
        cells: &Cells,
    ) -> Result<Vec<[u32; 2]>, SceneError> {
        let key = format!("loads[{load}]");
        let mut inside = vec![false; self.body.count()];
        self.pick(scene, &key, region)?.into_iter().for_each(|i| inside[i] = true);
        let mut sides = cells.boundary_sides(&cells.incidence(self.body.count()));
        sides.retain(|side| side.iter().all(|&i| inside[i as usize]));
        if sides.is_empty() {
            let message = "no side of the boundary has both its particles in this region";
            return Err(scene.refuse(&format!("{key}.region"), message, "move or widen the region"));
        }
        Ok(sides)
    }

    /// Particles of the region that stands at `key`.
    ///
    /// # Errors
    /// Names a region without particles and an id that does not exist.
    pub fn pick(&self, scene: &Scene, key: &str, region: &SceneRegion) -> Result<Vec<usize>, SceneError> {
        let key = format!("{key}.region");
        check_ids(scene, &key, region, &self.body)?;
        let particles = known_region(region, &self.body).pick(&self.body, &self.neighbours);
        if particles.is_empty() {
            let (low, high) = self.body.bounds();
            let message = format!(
                "no particle of the body lies in this region; the body spans [{}, {}] to [{}, {}]",
                low[0], low[1], high[0], high[1]
            );
            return Err(scene.refuse(&key, message, "move or widen the region"));
        }
        Ok(particles)
    }

    fn motion(
        &self,
        scene: &Scene,
        entry_number: usize,
        entry: &RoleEntry,
        particles: &[usize],
        truth: Option<Truth<'_>>,
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
            Some(LeaderMotion::Truth { steps }) => {
                let Some(truth) = truth else { return Ok(None) };
                (truth(&particles.iter().map(|&i| reference.get(i)).collect()), *steps)
            }
        };
        Ok(Some(Motion::Table { displacements, steps: steps as f64 }))
    }
}

fn body_of(scene: &Scene) -> Result<(Body, Neighbours), BodyError> {
    match (&scene.body, &scene.neighbourhood) {
        (BodySource::Cut(cut), neighbourhood) => {
            Body::build(scene.lattice.clone(), cut, neighbourhood, scene.frame)
        }
        (BodySource::Points(cloud), Neighbourhood::Within { radius }) => Body::of_cloud(cloud, Some(*radius)),
        (BodySource::Points(cloud), _) => Body::of_cloud(cloud, None),
    }
}

/// Displacement \[length\] of everybody who does not follow, at `step`; `None` for followers and for leaders
/// led by a truth that is not known, shape \[count\]. Only roles that hold from the start count.
pub fn held(changes: &[RoleChange], body: &Body, step: f64) -> Vec<Option<[f64; 2]>> {
    let mut held = vec![None; body.count()];
    for change in changes.iter().filter(|change| change.from <= 1 && change.when.is_none()) {
        for (which, &i) in change.particles.iter().enumerate() {
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

/// Refuses a body whose places, or small displacements from them, doubles cannot tell apart.
fn require_resolved(scene: &Scene, body: &Body) -> Result<(), SceneError> {
    let spacing = body.lattice.spacing();
    let Points { x, y } = &*body.reference;
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

fn refuse_body(scene: &Scene, error: &BodyError) -> SceneError {
    let (key, help) = match error {
        BodyError::Alone { .. } => {
            ("neighbours.radius", "use a wider radius, or leave the point out of the file")
        }
        BodyError::TooManyNeighbours { .. } => ("neighbours.radius", "use a smaller radius"),
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
            None => no_particle(id, body),
        };
        let help = match body.numbering {
            Some(_) => "ids are those of the body's file, or the numbers of its rows",
            None => "`flockform plan` prints the numbering",
        };
        return Err(scene.refuse(&format!("{key}.ids[{n}]"), message, help));
    }
    Ok(())
}

/// Why nobody has this id.
pub(super) fn no_particle(id: usize, body: &Body) -> String {
    let ids = body.rows().map(|i| body.id(i));
    let (low, high) = ids.fold((usize::MAX, 0), |(low, high), id| (low.min(id), high.max(id)));
    format!("there is no particle {id}: ids run from {low} to {high}")
}

fn known_region(region: &SceneRegion, body: &Body) -> Region {
    match region {
        SceneRegion::Known(region) => region.clone(),
        SceneRegion::Outermost(side) => Region::Edge { side: *side, depth: outermost_depth(*side, body) },
    }
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
