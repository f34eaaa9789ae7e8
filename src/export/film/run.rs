//! The film of a run: its configurations, coloured by a quantity.

use std::collections::{HashMap, HashSet};
use std::sync::OnceLock;

use rayon::prelude::*;

use super::{Film, FilmColour, FilmError, chosen};
use crate::continuum::mechanics::Stresses;
use crate::continuum::record::Snapshot;
use crate::continuum::run::Outcome;
use crate::engine::Engine;
use crate::export::figures::bands::{Bands, Field};
use crate::export::figures::configuration::{Setting, configuration_in};
use crate::export::figures::{Subject, displaced, page};
use crate::export::largest_strain;
use crate::export::report::recorder::{PE1, PE2, STRAIN, VON_MISES, is_linear, von_mises};
use crate::export::report::{RunRecorder, Sample};
use crate::flock::body::Body;
use crate::flock::pseudo_energy::pe1_among;
use crate::flock::strain::strain_among;
use crate::flock::vectors::Vectors;
use crate::scene::Scene;
use crate::scene::units::Units;

/// Differences below this part of the spacing, or of one, are rounding.
const NOISE: f64 = 1e-9;

/// Refuses a colour that a scene's particles do not have.
///
/// # Errors
/// Stress without a material, moves of a body that is solved for, and what robots alone have.
pub fn require_colour(scene: &Scene, colour: FilmColour) -> Result<(), FilmError> {
    let reason = match colour {
        FilmColour::VonMises if scene.material.is_none() => "the scene has no material",
        FilmColour::Pe2 if scene.is_solved_at_once() => "a body that is solved for at once makes no moves",
        FilmColour::Clearance => "particles keep no clearance, robots do",
        FilmColour::Away | FilmColour::Speed | FilmColour::Acceleration => "it is a quantity of robots",
        _ => return Ok(()),
    };
    let help = "choose role, displacement, pe1 or strain; pe2 needs a stepped run, von-mises a material";
    Err(FilmError::Refused(format!("--film-colour {}: {reason}\n  help: {help}", colour.name())))
}

/// The film of a run whose recorder is finished.
pub fn film<'a>(
    scene: &'a Scene,
    outcome: &'a Outcome,
    recorder: &'a RunRecorder,
    colour: FilmColour,
) -> Film<'a> {
    let frames = chosen(recorder.frames.kept.len());
    let shown = Shown::new(scene, &outcome.engine, recorder, colour);
    let mut setting = Setting::of_film();
    let subject = shown.subject();
    for &frame in &frames {
        let (snapshot, values) = (shown.snapshot(frame), shown.values(frame));
        setting.include(&subject, &snapshot, values.as_deref());
    }
    let bands = shown.bands(&setting);
    for &frame in &frames {
        setting.reserve(&subject, shown.note(&subject, frame), bands.as_ref());
    }
    let count = frames.len();
    let draw = move |n: usize| {
        let frame = frames[n];
        let (snapshot, values) = (shown.snapshot(frame), shown.values(frame));
        let field = bands.as_ref().zip(values.as_deref()).map(|(bands, values)| Field { bands, values });
        let subject = shown.subject();
        let note = shown.note(&subject, frame);
        configuration_in(&setting, &subject, &snapshot, note, field.as_ref())
    };
    Film { count, draw: Box::new(draw) }
}

/// Source of the frames.
struct Shown<'a> {
    scene: &'a Scene,
    engine: &'a Engine,
    recorder: &'a RunRecorder,
    colour: FilmColour,
    /// Of a body in parts the particles that are shown, and their places among them by their ids.
    sample: Option<(Body, HashMap<u32, u32>)>,
    /// Of the body at the end, where strains are computed from the frames \[1\].
    largest_strain: Option<f64>,
    /// The stress at the end, which the frames of a body that was solved for at once have parts of.
    final_stress: OnceLock<Vec<f64>>,
}

impl<'a> Shown<'a> {
    fn new(scene: &'a Scene, engine: &'a Engine, recorder: &'a RunRecorder, colour: FilmColour) -> Self {
        let quantity = match colour {
            FilmColour::Strain => Some(STRAIN),
            FilmColour::VonMises => Some(VON_MISES),
            FilmColour::Pe1 => Some(PE1),
            _ => None,
        };
        let is_part_of_end = colour == FilmColour::VonMises && recorder.is_solved;
        let is_computed = quantity.is_some_and(|quantity| !recorder.keeps(quantity)) && !is_part_of_end;
        let largest_strain = is_computed.then(|| largest_strain(engine)).flatten();
        let of_sample = |sample: &Sample| {
            let places = sample.ids.iter().copied().zip(0..).collect();
            (sample.body(engine.body().lattice.spacing()), places)
        };
        let sample = recorder.sample.as_ref().map(of_sample);
        let final_stress = OnceLock::new();
        Self { scene, engine, recorder, colour, sample, largest_strain, final_stress }
    }

    /// Of a body in parts its sample, without bonds, cells and roles of single components.
    fn subject(&self) -> Subject<'_> {
        let all = Subject::of(self.scene, self.engine);
        match &self.sample {
            None => all,
            Some((body, _)) => {
                Subject { body, neighbours: None, cells: None, changes: &[], team: None, ..all }
            }
        }
    }

    /// As it was kept; at the end as it is, but for a sample.
    fn displacement(&self, frame: usize) -> Vectors {
        if frame + 1 == self.recorder.frames.kept.len() && self.sample.is_none() {
            return self.engine.displacements();
        }
        let tracks = &self.recorder.frames.kept[frame].tracks;
        Vectors { x: tracks[0].values(), y: tracks[1].values() }
    }

    /// The configuration, without the energies, which the figure does not show.
    fn snapshot(&self, frame: usize) -> Snapshot {
        let step = self.recorder.frames.kept[frame].step;
        Snapshot {
            step,
            positions: displaced(&self.subject().body.reference, &self.displacement(frame), 1.0),
            roles: self.recorder.roles_at(step),
            pe1: Vec::new(),
            pe2: Vec::new(),
            broken: self.broken_shown(frame),
        }
    }

    /// Broken bonds by the particles that are shown: of a sample those with both or either end in it.
    fn broken_shown(&self, frame: usize) -> Vec<[u32; 2]> {
        let broken = self.broken(frame);
        let Some((_, shown)) = &self.sample else { return broken };
        let ends = broken.into_iter().filter_map(|pair| {
            let [a, b] = pair.map(|index| shown.get(&(index + 1)).copied());
            Some([a.or(b)?, b.or(a)?])
        });
        ends.collect()
    }

    fn broken(&self, frame: usize) -> Vec<[u32; 2]> {
        let step = self.recorder.frames.kept[frame].step;
        // Bonds of a body at rest were broken before its load.
        let is_broken = |at: usize| self.recorder.is_solved || at <= step;
        self.engine.breaks().iter().filter(|one| is_broken(one.step)).map(|one| one.pair).collect()
    }

    fn note(&self, subject: &Subject<'_>, frame: usize) -> String {
        let step = self.recorder.frames.kept[frame].step;
        let clock = match self.recorder.part_of_load(step) {
            Some(part) => {
                let of = if is_linear(self.scene) { "load" } else { "displacement" };
                format!("{:.0} % of the {of}", 100.0 * part)
            }
            None => format!("{} {step}", subject.counts),
        };
        let note = page::note_at(&clock, self.broken(frame).len());
        match self.uncertain(frame) {
            Some(strain) => format!("{note}; strains uncertain by {strain:.1e}"),
            None => note,
        }
    }

    /// What rounded displacements leave strains, and what is computed from them, uncertain by, where that is seen \[1\].
    fn uncertain(&self, frame: usize) -> Option<f64> {
        /// Part of the largest strain that is seen \[1\].
        const SEEN: f64 = 0.02;
        let largest = self.largest_strain.filter(|&largest| largest > 0.0)?;
        let frames = &self.recorder.frames.kept;
        if frame + 1 == frames.len() {
            return None;
        }
        let quantum = |axis: usize| f64::from(frames[frame].tracks[axis].exponent).exp2();
        let strain = quantum(0).max(quantum(1)) / self.engine.body().lattice.spacing();
        (strain > SEEN * largest).then_some(strain)
    }

    /// Shape \[count\]; none where roles are shown.
    fn values(&self, frame: usize) -> Option<Vec<f64>> {
        let kept = |quantity| self.recorder.frames.values(frame, quantity);
        Some(match self.colour {
            FilmColour::Displacement => self.displacement(frame).iter().map(|[x, y]| x.hypot(y)).collect(),
            FilmColour::Pe2 => kept(PE2)?,
            FilmColour::Pe1 => kept(PE1).unwrap_or_else(|| {
                self.by_neighbours(frame, |i, neighbours, places| {
                    pe1_among(self.engine.flock(), i, neighbours, places)
                })
            }),
            FilmColour::Strain => kept(STRAIN).unwrap_or_else(|| {
                self.by_neighbours(frame, |i, neighbours, places| {
                    let strain = strain_among(self.engine.flock(), i, neighbours, places);
                    strain.map_or(f64::NAN, |strain| strain.largest())
                })
            }),
            FilmColour::VonMises => kept(VON_MISES).unwrap_or_else(|| self.stress(frame)),
            // Of roles, and of what robots alone have.
            _ => return None,
        })
    }

    /// A number of every particle from those that are bonded to it at the frame.
    fn by_neighbours(
        &self,
        frame: usize,
        of: impl Fn(usize, &mut dyn Iterator<Item = usize>, &Vectors) -> f64 + Sync,
    ) -> Vec<f64> {
        let snapshot = self.snapshot(frame);
        let broken: HashSet<[u32; 2]> = snapshot.broken.iter().copied().collect();
        let neighbours = &self.engine.flock().neighbours;
        let one = |i: usize| {
            let is_live = |&k: &u32| !broken.contains(&[k.min(i as u32), k.max(i as u32)]);
            let live = neighbours.of(i).iter().copied().filter(is_live);
            of(i, &mut live.map(|k| k as usize), &snapshot.positions)
        };
        (0..snapshot.positions.len()).into_par_iter().map(one).collect()
    }

    fn stress(&self, frame: usize) -> Vec<f64> {
        let step = self.recorder.frames.kept[frame].step;
        // Frames of a body that is not linear keep theirs.
        if let Some(part) = self.recorder.part_of_load(step) {
            let whole = self.final_stress.get_or_init(|| von_mises(Stresses::at_present(self.engine)));
            return whole.iter().map(|stress| part * stress).collect();
        }
        let displacement = self.displacement(frame);
        let found = Stresses::of(self.engine, step, &displacement, &self.broken(frame));
        found.map_or_else(|| vec![f64::NAN; displacement.len()], |found| von_mises(Some(found)))
    }

    /// Bands for the values of all frames.
    fn bands(&self, setting: &Setting) -> Option<Bands> {
        let (unit, spacing) = (self.scene.unit(), self.engine.body().lattice.spacing());
        let (quantity, unit, noise) = match self.colour {
            FilmColour::Displacement => ("displacement", unit.to_owned(), NOISE * spacing),
            FilmColour::Pe1 => ("PE1", format!("{unit}²"), (NOISE * spacing).powi(2)),
            FilmColour::Pe2 => ("PE2", unit.to_owned(), NOISE * spacing),
            FilmColour::Strain => ("largest strain", String::new(), NOISE),
            FilmColour::VonMises => ("von Mises stress", Units::of(self.scene).stress, 0.0),
            _ => return None,
        };
        Some(setting.bands(noise).named(quantity, unit))
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::continuum::equilibrium::run_to_equilibrium_watched;
    use crate::continuum::plan::Plan;
    use crate::engine::observer::EachStep;

    /// The outcome, its recorder, and what each step had.
    fn ran<T>(scene: &Scene, films: bool, see: impl Fn(&Engine) -> T) -> (Outcome, RunRecorder, Vec<T>) {
        let plan = Plan::new(scene).unwrap_or_else(|error| panic!("{error}"));
        let (mut recorder, mut seen) = (None, Vec::new());
        let mut watch = |engine: &Engine, _: f64| {
            RunRecorder::open(&mut recorder, &mut None, (scene, engine, films)).watch(engine);
            seen.push(see(engine));
            ControlFlow::Continue(())
        };
        let outcome = run_to_equilibrium_watched(scene, plan, &mut EachStep(&mut watch)).expect("an end");
        let mut recorder = recorder.expect("it has looked");
        recorder.close(scene, &outcome);
        (outcome, recorder, seen)
    }

    fn scene(text: &str) -> Scene {
        Scene::parse("body", "body", text, &[], None).unwrap_or_else(|error| panic!("{error}"))
    }

    /// A bar of 20 x 5 that is pulled from its right side.
    const BAR: &str = r#"
        title = "A bar, pulled"
        lattice = { kind = "square", spacing = 1.0 }
        material = { kind = "isotropic", young = 1000.0, poisson = 0.0 }
        rule = { mean = { kind = "material" } }
        roles = [{ region = { kind = "edge", side = "left" }, role = "clamped" }]
        loads = [{ kind = "traction", region = { kind = "edge", side = "right" }, traction = [10.0, 0.0] }]
        "#;

    #[test]
    fn half_way_to_a_body_solved_at_once_its_edges_bear_half_the_load() {
        let solved = "body = { shape = { kind = \"rectangle\", max = [20.0, 5.0] } }\n[equilibrium]";
        let scene = scene(&format!("{BAR}{solved}"));
        let (outcome, recorder, _) = ran(&scene, true, |_| ());
        let shown = Shown::new(&scene, &outcome.engine, &recorder, FilmColour::VonMises);
        for (frame, expected) in [(0, 0.0), (10, 5.0), (20, 10.0)] {
            let values = shown.values(frame).expect("shown");
            let worst = values.iter().map(|value| (value - expected).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-6, "frame {frame}: off by {worst}");
            assert!(shown.uncertain(frame).is_none(), "it is a part of what is exact");
        }
    }

    #[test]
    fn a_film_of_steps_has_stress_recovered_around_an_inclusion_too_and_a_report_says_where_it_is_not() {
        let stepped = r#"
            stop.steps = 20
            [body]
            shape = { kind = "rectangle", max = [20.0, 5.0] }
            holes = [{ kind = "disc", centre = [14.0, 2.5], radius = 1.5 }]
            inclusions = [
                { shape = { kind = "disc", centre = [6.0, 2.5], radius = 1.2 }, material = { kind = "isotropic", young = 1000.0, poisson = 0.0 } },
            ]"#;
        let scene = scene(&format!("{BAR}{stepped}"));
        let see = |engine: &Engine| {
            let recovered = von_mises(Stresses::at_present(engine));
            (engine.step(), recovered, Stresses::von_mises_of_cells(engine))
        };
        for films in [true, false] {
            let (outcome, mut recorder, seen) = ran(&scene, films, see);
            let shown = Shown::new(&scene, &outcome.engine, &recorder, FilmColour::VonMises);
            let frame = recorder.frames.kept.len() - 2;
            let values = shown.values(frame).expect("shown");
            let step = recorder.frames.kept[frame].step;
            let (_, recovered, of_cells) = seen.iter().find(|one| one.0 == step).expect("it was seen");
            let off =
                |other: &[f64]| values.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let (right, wrong) = if films { (recovered, of_cells) } else { (of_cells, recovered) };
            assert!(off(right) < 1e-5 && off(wrong) > 0.1, "{films}: {} {}", off(right), off(wrong));
            assert_eq!(recorder.stage(&scene, &outcome).has_mean_stress, !films);
        }
    }

    /// Stretched by 1e-4 and turned by 90 degrees: strain and stress are the same everywhere.
    #[test]
    fn a_film_of_a_body_that_turns_far_ends_with_its_strain_and_says_how_sure_it_was_on_the_way() {
        let text = r#"
            title = "Steel"
            material = { kind = "isotropic", young = 210e3, poisson = 0.0 }
            rule = { mean = { kind = "material", rotation = "corotated" } }
            lattice = { kind = "square", spacing = 1.0 }
            body = { shape = { kind = "grid", columns = 501, rows = 20 } }
            stop.steps = 2
            [[roles]]
            region = { kind = "all" }
            role = "leader"
            motion = { kind = "affine", rotate = 90.0, stretch = [1.0001, 1.0], steps = 2 }
            "#;
        let scene = scene(text);
        let (outcome, recorder, _) = ran(&scene, false, |_| ());
        for (colour, expected) in [(FilmColour::Strain, 1e-4), (FilmColour::VonMises, 21.0)] {
            let shown = Shown::new(&scene, &outcome.engine, &recorder, colour);
            let worst = |frame: usize| {
                let values = shown.values(frame).expect("shown");
                values.iter().map(|value| (value / expected - 1.0).abs()).fold(0.0, f64::max)
            };
            let last = recorder.frames.kept.len() - 1;
            assert!(worst(last) < 1e-8 && shown.uncertain(last).is_none(), "{colour:?}: {}", worst(last));
            // Half way it is stretched by as much as it turns back.
            let off = shown.uncertain(last - 1).expect("said");
            assert!((1e-6..1e-4).contains(&off), "{off}");
        }
    }
}
