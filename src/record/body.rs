//! A continuum run as messages: its particles as poses, markers and, for small bodies, members of a formation.
//!
//! A step is a twentieth of a second, so that players show twenty of them a second. Messages are in SI units, as their types
//! say, where the scene's unit of length is known; the diagnostics name it.

use super::RecordError;
use crate::engine::Engine;
use crate::flock::role::Role;
use crate::flock::strain::Strain;
use crate::flock::vectors::distance;
use crate::messages::builtin_interfaces::Time;
use crate::messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::messages::flockform_msgs::{FormationState, MemberState};
use crate::messages::formation::NAME;
use crate::messages::formation::markers::{of_strain, point};
use crate::messages::geometry_msgs::{Point, Pose, PoseArray, Vector3};
use crate::messages::names::Names;
use crate::messages::recorder::{MessageRecorder, RecordSink};
use crate::messages::std_msgs::{ColorRGBA, Header};
use crate::messages::visualization_msgs::{Marker, MarkerArray};
use crate::scene::Scene;
use crate::scene::units::metres;

/// \[s\]
pub const STEP: f64 = 0.05;
/// Steps recorded at most, unless the scene says how often.
const FRAMES: usize = 500;
/// Larger bodies are recorded without what a player could not show of them: members, then bonds.
const MOST_MEMBERS: usize = 5_000;
const MOST_BONDS: usize = 200_000;
/// Of more particles ranks may have a part each, and no rank all bonds (`export::figures::is_raster`).
const MOST_BONDED: usize = 60_000;

/// Writes down a run, step by step.
pub struct BodyMessages {
    /// Of the rank that writes.
    recorder: Option<MessageRecorder>,
    name: String,
    every: usize,
    solved: bool,
    is_solved_at_once: bool,
    /// The scene's.
    unit: String,
    /// Metres in one unit of the scene, where its length is known.
    metres: Option<f64>,
    last: Option<usize>,
    poses: String,
    markers: String,
    state: String,
    diagnostics: String,
}

impl BodyMessages {
    /// Every `record.vtk_every` steps, or about 500 of them all. Where ranks have a part of the body each, all of them look at it
    /// and the first one alone has a sink.
    ///
    /// # Errors
    /// None for the names of this program.
    pub fn new(scene: &Scene, sink: Option<RecordSink>) -> Result<Self, RecordError> {
        let names = Names::new(NAME, "/", &[])?;
        let every = match scene.record.vtk_every {
            0 => scene.stop.steps.div_ceil(FRAMES).max(1),
            every => every,
        };
        Ok(Self {
            recorder: sink.map(|sink| MessageRecorder::new(&names, "world", sink)).transpose()?,
            name: scene.name.clone(),
            solved: scene.equilibrium.is_some(),
            is_solved_at_once: scene.is_solved_at_once(),
            unit: scene.unit().to_owned(),
            metres: metres(scene.unit()),
            every,
            last: None,
            poses: names.topic("~/poses")?,
            markers: names.topic("~/markers")?,
            state: names.topic("~/state")?,
            diagnostics: names.topic("/diagnostics")?,
        })
    }

    /// The next step, after `step`, that is recorded.
    pub fn next(&self, step: usize) -> usize {
        if self.solved { step + 1 } else { (step / self.every + 1) * self.every }
    }

    /// A step; most are passed over.
    pub fn step(&mut self, engine: &Engine, residual: f64) {
        if self.solved || engine.step().is_multiple_of(self.every) {
            self.take(engine, residual);
        }
    }

    /// The last step is always recorded.
    pub fn finish(mut self, engine: &Engine, residual: f64) {
        if self.last != Some(engine.step()) {
            self.take(engine, residual);
        }
    }

    fn take(&mut self, engine: &Engine, residual: f64) {
        self.last = Some(engine.step());
        // Of one that was solved for at once there is no way there.
        let step = if self.is_solved_at_once { 0 } else { engine.step() };
        let time = step as f64 * STEP;
        let header = Header { stamp: Time::from_seconds(time), frame_id: "world".into() };
        let times = [time; 2];
        let present = engine.present();
        let seen = engine
            .of_all(|i| [present.x[i].to_bits(), present.y[i].to_bits(), engine.roles()[i].number().into()]);
        let metres = self.metres.unwrap_or(1.0);
        let state = state(engine, &self.name, metres, step, header.clone());
        let diagnostics = self.diagnostics(engine, header.clone(), residual);
        let Some(recorder) = &mut self.recorder else { return };
        let place = |[x, y, _]: &[u64; 3]| [x, y].map(|&bits| metres * f64::from_bits(bits));
        let poses = seen.iter().map(|one| Pose::planar(place(one), 0.0)).collect();
        recorder.take(&self.poses, &PoseArray { header: header.clone(), poses }, times);
        let role = |[.., number]: &[u64; 3]| Role::ALL[*number as usize];
        let of_all = seen.iter().map(|one| (place(one), role(one)));
        recorder.take(&self.markers, &markers(engine, metres, &header, of_all), times);
        recorder.take(&self.state, &state, times);
        recorder.take(&self.diagnostics, &diagnostics, times);
    }

    fn diagnostics(&self, engine: &Engine, header: Header, residual: f64) -> DiagnosticArray {
        let pair = |key: &str, value: String| KeyValue { key: key.into(), value };
        let unit = match self.metres {
            Some(_) => "m".to_owned(),
            None => {
                format!("{}, as in the scene: set `unit` to m, cm, mm, in or ft to have metres", self.unit)
            }
        };
        let mut values = vec![
            pair("residual [1]", format!("{residual:e}")),
            pair("broken bonds", engine.breaks().len().to_string()),
            pair("unit of length", unit),
        ];
        if !self.is_solved_at_once {
            values.insert(0, pair("step", engine.step().to_string()));
        }
        let status = DiagnosticStatus {
            level: DiagnosticStatus::OK,
            name: format!("/{NAME}: run"),
            message: if self.solved { "solved for equilibrium" } else { "stepping" }.into(),
            hardware_id: self.name.clone(),
            values,
        };
        DiagnosticArray { header, status: vec![status] }
    }
}

fn colour(role: Role) -> ColorRGBA {
    let (r, g, b, a) = match role {
        Role::Follower => (0.13, 0.38, 0.75, 1.0),
        Role::Leader => (0.91, 0.13, 0.11, 1.0),
        Role::Clamped => (0.1, 0.1, 0.1, 1.0),
        Role::Frame | Role::Ghost => (0.6, 0.63, 0.65, 0.5),
    };
    ColorRGBA { r, g, b, a }
}

fn markers(
    engine: &Engine,
    metres: f64,
    header: &Header,
    all: impl ExactSizeIterator<Item = ([f64; 2], Role)>,
) -> MarkerArray {
    let spacing = metres * engine.body().lattice.spacing();
    let size = 0.4 * spacing;
    let mut particles = Marker {
        header: header.clone(),
        ns: "particles".into(),
        // Spheres have a size in metres, which some viewers take for pixels where it is that of points; they take longer to draw.
        r#type: if all.len() <= MOST_MEMBERS { Marker::SPHERE_LIST } else { Marker::POINTS },
        scale: Vector3 { x: size, y: size, z: size },
        ..Marker::default()
    };
    (particles.points, particles.colors) = all.map(|(place, role)| (point(place), colour(role))).unzip();
    let mut markers = vec![particles];
    let is_bonded = engine.parted().is_none() && engine.body().total() <= MOST_BONDED;
    if is_bonded && engine.flock().neighbours.index.len() <= MOST_BONDS {
        markers.push(bonds(engine, metres, header));
    }
    MarkerArray { markers }
}

/// Every bond that lives.
fn bonds(engine: &Engine, metres: f64, header: &Header) -> Marker {
    let width = 0.08 * metres * engine.body().lattice.spacing();
    let place = |i: usize| point(engine.present().get(i).map(|along| metres * along));
    let (present, reference) = (engine.present(), &engine.body().reference);
    let mut marker = Marker {
        header: header.clone(),
        ns: "bonds".into(),
        r#type: Marker::LINE_LIST,
        scale: Vector3 { x: width, y: 0.0, z: 0.0 },
        ..Marker::default()
    };
    let flock = engine.flock();
    for j in 0..present.len() {
        let once = |&k: &usize| k > j || !flock.neighbours.of(k).contains(&(j as u32));
        for k in flock.live_neighbours(j).filter(once) {
            let rest = distance(reference.get(j), reference.get(k));
            let length = distance(present.get(j), present.get(k));
            marker.points.extend([place(j), place(k)]);
            marker.colors.extend([of_strain(length / rest - 1.0); 2]);
        }
    }
    marker
}

fn state(engine: &Engine, name: &str, metres: f64, step: usize, header: Header) -> FormationState {
    let (owned, is_whole) = (engine.body().owned(), engine.parted().is_none());
    let is_of_body = |&i: &usize| owned.contains(&i) && engine.roles()[i].is_body();
    let body: Vec<usize> = engine.body().rows().filter(is_of_body).collect();
    let strains: Vec<Option<Strain>> = body.iter().map(|&i| engine.strain(i)).collect();
    let members = body.iter().zip(&strains).filter(|_| is_whole && body.len() <= MOST_MEMBERS);
    let own_strain = strains.iter().flatten().map(Strain::largest).fold(0.0, f64::max);
    FormationState {
        header,
        formation: name.to_owned(),
        tick: step as u64,
        mode: FormationState::RUNNING,
        formation_error: f64::NAN,
        clearance: f64::INFINITY,
        pe1_sum: metres * metres * engine.energies()[0],
        strain_max: engine.largest_of_parts([own_strain])[0],
        elapsed: 0.0,
        members: members.map(|(&i, strain)| member(engine, metres, i, *strain)).collect(),
    }
}

fn member(engine: &Engine, metres: f64, i: usize, strain: Option<Strain>) -> MemberState {
    let [x, y] = engine.displacement(i).map(|along| metres * along);
    let nowhere = Point { x: f64::NAN, y: f64::NAN, z: f64::NAN };
    MemberState {
        name: engine.body().id(i).to_string(),
        role: if engine.roles()[i] == Role::Follower { MemberState::FOLLOWER } else { MemberState::LEADER },
        health: MemberState::FRESH,
        position: point(engine.present().get(i).map(|along| metres * along)),
        target: nowhere,
        settled: nowhere,
        displacement: Vector3 { x, y, z: 0.0 },
        pe1: metres * metres * engine.pe1(i),
        strain: strain.map_or([f64::NAN; 3], |strain| strain.components),
        rotation: strain.map_or(f64::NAN, |strain| strain.rotation),
        age: 0.0,
        clearance: f64::INFINITY,
        to_settled: f64::NAN,
        flags: 0,
    }
}
