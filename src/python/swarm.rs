//! `flockform.Swarm`: the tick of a formation, for simulators of other people.

use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{column, indices, mask, moved, numbers, pairs, places, rows, square, table};
use super::beside::beside;
use super::source::Source;
use super::threads::here;
use crate::scene::SceneError;
use crate::swarm::control::{Control, Mode};
use crate::swarm::watch::{Pose, Range};

/// A formation whose poses come from Python and whose targets go there.
///
/// Swarm(file, *, set=None) reads a swarm: name of a bundled one, path of a swarm file, or a swarm as a dict. Robots
/// are counted from 0, in the order of `names`.
#[pyclass(module = "flockform")]
pub(super) struct Swarm {
    name: String,
    control: Control,
    /// Time of the next tick unless it is given [s].
    now: f64,
    /// Reasons for which poses of the last tick were rejected, by robot.
    rejected: Vec<(usize, String)>,
}

impl Swarm {
    fn count(&self) -> usize {
        self.control.formation().count()
    }

    fn names(&self) -> &[String] {
        &self.control.formation().names
    }

    fn poses(&self, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
        let width = numbers("poses", given)?.1.get(1).copied();
        let width = if width == Some(3) { 3 } else { 2 };
        let poses = table("poses", given, self.count(), width)?;
        let pose = |row: &[f64]| [row[0], row[1], row.get(2).copied().unwrap_or_default()];
        Ok(poses.chunks_exact(width).map(pose).collect())
    }

    /// The time of a tick: the given one, or that of the tick before.
    fn time(&self, now: Option<f64>) -> PyResult<f64> {
        match now {
            Some(now) if !now.is_finite() => {
                Err(PyValueError::new_err(format!("now = {now}: give seconds, or leave it out")))
            }
            now => Ok(now.unwrap_or(self.now)),
        }
    }

    /// Takes in the distances that robots measured of each other at `now`.
    fn hear_ranges(&mut self, given: &Bound<'_, PyAny>, now: f64) -> PyResult<()> {
        let count = self.count();
        let distances = square("ranges", given, count)?;
        if self.control.watch().limits().ranges.is_none() {
            let message =
                format!("ranges: swarm `{}` has no [ranges], which says how they are weighed", self.name);
            return Err(PyValueError::new_err(message));
        }
        for (pair, &distance) in distances.iter().enumerate().filter(|(_, distance)| !distance.is_nan()) {
            let (observer, of) = (pair / count, pair % count);
            self.control.receive_range(Range { observer, of, distance, stamp: now }, now);
        }
        Ok(())
    }

    fn robot(&self, given: &Bound<'_, PyAny>) -> PyResult<usize> {
        if let Ok(name) = given.extract::<String>() {
            let found = self.control.formation().number(&name);
            return found.ok_or_else(|| {
                PyValueError::new_err(format!("robot = `{name}`: give one of {}", self.names().join(", ")))
            });
        }
        match indices("robot", given, self.count())?[..] {
            [one] => Ok(one),
            _ => {
                Err(PyValueError::new_err("robot: give one index or name; several robots are led one by one"))
            }
        }
    }
}

#[pymethods]
impl Swarm {
    #[new]
    #[pyo3(signature = (file, *, set=None))]
    fn new(py: Python<'_>, file: &Bound<'_, PyAny>, set: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let source = Source::swarm(file, set)?;
        let (name, control) = beside(py, None, move |_| {
            let swarm = source.load_swarm()?;
            let control = Control::new(&swarm)?;
            Ok::<_, SceneError>((swarm.name, control))
        })??;
        Ok(Self { name, control, now: 0.0, rejected: Vec::new() })
    }

    /// Number of robots.
    #[getter(count)]
    fn robot_count(&self) -> usize {
        self.count()
    }

    /// Names of the robots.
    #[getter(names)]
    fn robot_names(&self) -> Vec<String> {
        self.names().to_vec()
    }

    /// Time from one tick to the next [s].
    #[getter]
    fn period(&self) -> f64 {
        self.control.period()
    }

    /// The mode of the loop: "running" or "emergency-stopped".
    #[getter]
    fn mode(&self) -> &'static str {
        match self.control.mode() {
            Mode::Running => "running",
            Mode::EmergencyStopped => "emergency-stopped",
            Mode::Inactive => "inactive",
        }
    }

    /// Names of the manoeuvres that begin() takes.
    #[getter]
    fn manoeuvres(&self) -> Vec<String> {
        self.control.formation().manoeuvres.iter().map(|one| one.name.clone()).collect()
    }

    /// Places of the robots in the formation as the file gives it [m], float64, shape (count, 2).
    fn places<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        pairs(py, &self.control.formation().places)
    }

    /// Which robots lead, bool, shape (count,).
    fn leaders<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<bool>>> {
        let leads = (0..self.count()).map(|robot| self.control.formation().leads(robot));
        moved(py, leads.collect(), &[self.count()])
    }

    /// One period: poses in, safe targets out.
    ///
    /// poses: x, y [m] and, if there is a third column, yaw [rad], shape (count, 2) or (count, 3).
    /// heard: whose pose arrived, bool, shape (count,); all unless given. The row of a robot that was not heard is not
    /// read, but must be finite.
    /// stamps: when the poses were measured [s], shape (count,); now unless given.
    /// now: time of the tick [s]; one period after the last one unless given.
    /// ranges: how far robots measured others to be at the tick [m], shape (count, count), a row for each that measured;
    /// NaN where none did. Only of a swarm with [ranges].
    ///
    /// Returns the targets [m], float64, shape (count, 2); NaN for a robot without a usable pose, which is to stay
    /// where it is.
    #[pyo3(signature = (poses, *, heard=None, stamps=None, now=None, ranges=None))]
    fn tick<'py>(
        &mut self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        heard: Option<&Bound<'py, PyAny>>,
        stamps: Option<&Bound<'py, PyAny>>,
        now: Option<f64>,
        ranges: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let count = self.count();
        let poses = self.poses(poses)?;
        let heard = heard.map_or_else(|| Ok(vec![true; count]), |given| mask("heard", given, count))?;
        let now = self.time(now)?;
        let stamps = stamps.map_or_else(|| Ok(vec![now; count]), |given| column("stamps", given, count))?;
        if let Some(given) = ranges {
            self.hear_ranges(given, now)?;
        }
        self.rejected.clear();
        for robot in (0..count).filter(|&robot| heard[robot]) {
            let [x, y, yaw] = poses[robot];
            let pose = Pose { position: [x, y], yaw, stamp: stamps[robot], frame_is_right: true };
            if let Err(rejection) = self.control.receive(robot, pose, now) {
                self.rejected.push((robot, rejection.to_string()));
            }
        }
        here(py, || self.control.tick(now))?;
        self.now = now + self.control.period();
        rows(py, (0..count).map(|robot| self.control.target(robot).unwrap_or([f64::NAN; 2])))
    }

    /// Why poses of the last tick were rejected: a dict from the robot's name to the reason.
    fn rejections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let reasons = PyDict::new(py);
        for (robot, reason) in &self.rejected {
            reasons.set_item(&self.names()[*robot], reason)?;
        }
        Ok(reasons)
    }

    /// How young each robot's pose is: "waiting", "fresh", "held", "degraded" or "stopped".
    fn health(&self) -> Vec<&'static str> {
        (0..self.count()).map(|robot| self.control.health(robot).name()).collect()
    }

    /// Targets by the rule alone, before they were made safe [m], float64, shape (count, 2).
    fn wanted<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        rows(py, (0..self.count()).map(|robot| self.control.wanted(robot)))
    }

    /// Free space around each robot, to its neighbours and to obstacles [m], float64, shape (count,).
    fn clearance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let mut nearest = Vec::new();
        self.control.clearance(&mut nearest);
        let shape = [nearest.len()];
        moved(py, nearest, &shape)
    }

    /// Largest distance of a follower from where it comes to rest [m]; None where the rule is not linear, while a leader is lost, and
    /// where no follower is known.
    fn formation_error(&self) -> Option<f64> {
        self.control.formation_error()
    }

    /// Gives a leader whose program is external its next place [m], shape (2,).
    ///
    /// robot: its name or index.
    fn lead(&mut self, robot: &Bound<'_, PyAny>, place: &Bound<'_, PyAny>) -> PyResult<()> {
        let member = self.robot(robot)?;
        let place = places("place", place, 1)?[0];
        if self.control.place_leader(member, place) {
            return Ok(());
        }
        let name = &self.names()[member];
        let message = format!(
            "robot `{name}` cannot be led to {place:?}: it has no program of kind \"external\", a manoeuvre \
             moves it, or the place lies beyond poses.range"
        );
        Err(PyValueError::new_err(message))
    }

    /// Moves all leaders by a manoeuvre of the swarm file from the next tick on.
    fn begin(&mut self, manoeuvre: &str) -> PyResult<()> {
        let now = self.control.program_time();
        let Some(found) = self.control.formation().manoeuvre(manoeuvre, now) else {
            let all = self.manoeuvres().join(", ");
            let message = format!("manoeuvre = `{manoeuvre}`: the swarm has these: {all}");
            return Err(PyValueError::new_err(message));
        };
        self.control.begin(&found);
        Ok(())
    }

    /// Brings every robot to rest from the next tick on, and holds it there until resume().
    fn emergency_stop(&mut self) {
        self.control.emergency_stop();
    }

    /// Lifts an emergency stop; False if there is none.
    fn resume(&mut self) -> bool {
        self.control.resume()
    }

    /// A swarm in the same state that goes its own way.
    fn copy(&self) -> Self {
        let Self { name, control, now, rejected } = self;
        Self { name: name.clone(), control: control.clone(), now: *now, rejected: rejected.clone() }
    }

    fn __copy__(&self) -> Self {
        self.copy()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.copy()
    }

    fn __repr__(&self) -> String {
        format!("<flockform.Swarm {}, {} robots>", self.name, self.count())
    }
}
