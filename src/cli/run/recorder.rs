//! The records of a run: snapshots, probes, measurements, frames, and what its report shows. Where each rank has a part of the
//! body the first rank has the figures and the probes of all, and what the report shows.

use std::time::{Duration, Instant};

use flockform::continuum::plan::Plan;
use flockform::continuum::record::{LoadStep, ProbeSeries, Snapshot};
use flockform::continuum::run::{Outcome, StopReason};
use flockform::engine::Engine;
use flockform::export::figures::is_raster;
use flockform::export::memory::Outputs;
use flockform::export::report::view::View;
use flockform::export::report::{AnimationState, RunRecorder};
use flockform::export::{Drawn, ExportError, OutputFolder, Records, VtkSeries, probes_of_parts, write_piece};
use flockform::ranks::Team;
use flockform::scene::{LoadSteps, Scene};

use crate::cli::checkpoint::{Recorded, ResumedRun};

/// Keeps what the scene asks for while the run goes on.
pub struct Recorder<'a> {
    scene: &'a Scene,
    records: Records,
    /// Indices of the probed particles in the whole body.
    probed: Vec<usize>,
    /// Of the rank that writes.
    frames: Option<VtkSeries>,
    outputs: Outputs,
    /// Values that report and film show.
    pub animation: Option<RunRecorder>,
    /// The state that an earlier run saved for it.
    animation_state: Option<AnimationState<'static>>,
    failure: Option<ExportError>,
    pub writing: Duration,
}

/// All that was recorded of a run, and the time spent writing it.
pub struct Finished {
    pub records: Records,
    /// The view of the report.
    pub stage: Option<View>,
    /// For a film.
    pub animation: Option<RunRecorder>,
    pub writing: Duration,
}

impl<'a> Recorder<'a> {
    pub fn new(
        scene: &'a Scene,
        plan: &Plan,
        folder: Option<&OutputFolder>,
        left: Option<&ResumedRun>,
        outputs: Outputs,
    ) -> Result<Self, ExportError> {
        // A body that is not stepped has no history.
        let is_solved_at_once = scene.is_solved_at_once();
        let probed = if is_solved_at_once { Vec::new() } else { plan.probes.clone() };
        let probes = || probed.iter().map(|&particle| ProbeSeries::new(particle)).collect();
        let new = || Records { probes: probes(), ..Records::default() };
        let records = left.map_or_else(new, |left| left.checkpoint.records.clone().into_owned());
        let every = scene.record.vtk_every;
        let frames = folder.filter(|_| every > 0).map(|folder| match left {
            None => VtkSeries::create(folder),
            Some(left) => left.frames(folder, every),
        });
        let frames = frames.transpose()?;
        Ok(Self {
            scene,
            records,
            probed,
            frames,
            outputs,
            animation: None,
            animation_state: left.and_then(|left| left.checkpoint.animation.clone()),
            failure: None,
            writing: Duration::ZERO,
        })
    }

    /// For a checkpoint.
    pub fn kept(&mut self, engine: &Engine) -> Recorded<'_> {
        self.receive_probes(engine);
        if self.outputs.keeps_frames() {
            // A run that was just resumed has not yet looked at a step, and still has the frames of before.
            self.open_animation(engine);
        }
        Recorded { records: &self.records, animation: self.animation.as_ref(), frames: self.frames.as_mut() }
    }

    pub fn step(&mut self, engine: &Engine) {
        // Of a part the engine records them itself.
        if engine.parted().is_none() {
            self.records.probes.iter_mut().for_each(|probe| probe.record(engine));
        }
        if self.scene.record.figures.contains(&engine.step()) {
            self.draw(engine);
        }
        if load_every(self.scene).is_some_and(|every| engine.step().is_multiple_of(every)) {
            self.measure(engine);
        }
        if self.is_frame(engine.step()) {
            self.write_frame(engine);
        }
        if self.outputs.keeps_frames() {
            let start = Instant::now();
            self.open_animation(engine).watch(engine);
            self.writing += start.elapsed();
        }
    }

    /// The next step, after `step`, that is kept; none before the end if there is none.
    pub fn next(&self, step: usize) -> usize {
        let record = &self.scene.record;
        let figure = record.figures.iter().copied().filter(|&figure| figure > step).min();
        let next = |every: usize| (step / every + 1) * every;
        let vtk = (record.vtk_every > 0).then(|| next(record.vtk_every));
        let load = load_every(self.scene).map(next);
        // The report has yet to say what it wants: the next one.
        let animation = self
            .outputs
            .keeps_frames()
            .then(|| self.animation.as_ref().map_or(step + 1, |animation| animation.next(step)));
        [figure, vtk, load, animation].into_iter().flatten().min().unwrap_or(usize::MAX)
    }

    fn open_animation(&mut self, engine: &Engine) -> &mut RunRecorder {
        let of = (self.scene, engine, self.outputs.film);
        RunRecorder::open(&mut self.animation, &mut self.animation_state, of)
    }

    /// Keeps the configuration for its figures, or draws them now.
    fn draw(&mut self, engine: &Engine) {
        if !self.outputs.draws() {
            return;
        }
        if !is_raster(engine.body().total()) {
            self.records.snapshots.push(Snapshot::of(engine));
            return;
        }
        let start = Instant::now();
        self.records.drawn.extend(Drawn::of(self.scene, engine));
        self.writing += start.elapsed();
    }

    fn measure(&mut self, engine: &Engine) {
        self.records.load_steps.extend(LoadStep::of(engine));
    }

    /// Whether there is a frame for ParaView of a step on the way.
    fn is_frame(&self, step: usize) -> bool {
        let every = self.scene.record.vtk_every;
        every > 0 && step.is_multiple_of(every)
    }

    fn write_frame(&mut self, engine: &Engine) {
        let start = Instant::now();
        let written = match (&mut self.frames, engine.parted()) {
            (Some(frames), _) => frames.write(engine),
            (None, Some(team)) => write_piece(engine, team),
            (None, None) => Ok(()),
        };
        self.failure = written.err();
        self.writing += start.elapsed();
    }

    /// The histories of the probed particles of all parts.
    fn receive_probes(&mut self, engine: &Engine) {
        if let Some(team) = engine.parted() {
            self.records.probes = probes_of_parts(engine, &self.probed, team);
        }
    }

    pub fn failed(&self) -> bool {
        self.failure.is_some()
    }

    /// The last configuration is drawn wherever any is, and for ParaView always written.
    pub fn finish(mut self, outcome: &Outcome) -> Result<Finished, ExportError> {
        let engine = &outcome.engine;
        let (step, every) = (engine.step(), self.scene.record.vtk_every);
        self.receive_probes(engine);
        let Records { snapshots, drawn, load_steps, .. } = &self.records;
        let last = snapshots.last().map(|last| last.step).or(drawn.last().map(|last| last.step));
        let is_measured = load_steps.last().is_some_and(|last| last.step == step);
        // Figures of a run that is broken off are not written, and those of a large body take their time.
        let is_in_vain = outcome.reason == StopReason::Interrupted && is_raster(engine.body().total());
        if last != Some(step) && !is_in_vain {
            self.draw(engine);
        }
        if load_every(self.scene).is_some() && !is_measured {
            self.measure(engine);
        }
        if every > 0 && !self.is_frame(step) && !engine.any_of_parts(self.failed()) {
            self.write_frame(engine);
        }
        if self.failure.is_none()
            && let Some(frames) = self.frames.take()
        {
            self.failure = frames.finish().err();
        }
        let start = Instant::now();
        if self.outputs.keeps_frames() {
            // A run that is gone on with from its last step has seen none.
            self.open_animation(engine);
        }
        if let Some(animation) = &mut self.animation {
            animation.close(self.scene, outcome);
        }
        let is_written = self.outputs.report && engine.parted().is_none_or(Team::is_first);
        let animation = self.animation.as_mut().filter(|_| is_written);
        let stage = animation.map(|animation| animation.stage(self.scene, outcome));
        let writing = self.writing + start.elapsed();
        let animation = self.animation.filter(|_| self.outputs.film);
        // The others take the last frame of the report together with a rank that could not write its own.
        let finished = Finished { records: self.records, stage, animation, writing };
        self.failure.map_or(Ok(finished), Err)
    }
}

/// Steps from one row of `load.csv` to the next, where there is one.
fn load_every(scene: &Scene) -> Option<usize> {
    match scene.load_steps.as_ref()? {
        LoadSteps::Solved(_) => Some(1),
        LoadSteps::Stepped { every, .. } => Some(*every),
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use flockform::continuum::run::run;
    use flockform::scene::bundled::bundled;

    use super::*;

    #[test]
    fn a_recorder_that_has_not_yet_looked_at_a_step_keeps_the_frames_of_before() {
        let scene = bundled("tension").expect("bundled").load(&[]).expect("valid");
        let plan = || Plan::new(&scene).expect("can be laid out");
        let recorder = || Recorder::new(&scene, &plan(), None, None, Outputs::ALL).expect("writes nothing");
        let mut first = recorder();
        let outcome = run(plan(), &mut |engine, _| {
            first.step(engine);
            ControlFlow::Continue(())
        });
        let state = first.kept(&outcome.engine).animation.map(RunRecorder::animation_state);
        let saved = serde_json::to_string(&state).expect("written");
        let mut resumed = recorder();
        resumed.animation_state = serde_json::from_str(&saved).expect("read");
        let kept = resumed.kept(&outcome.engine).animation.map(RunRecorder::animation_state);
        assert!(state.is_some() && kept == state);
    }
}
