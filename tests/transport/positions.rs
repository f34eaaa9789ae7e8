//! A body under way, read by others: `flockform run --publish`.

use std::ops::ControlFlow;
use std::process::{Command, Stdio};
use std::time::Duration;

use flockform::continuum::equilibrium::run_to_equilibrium_shared;
use flockform::continuum::plan::Plan;
use flockform::engine::Engine;
use flockform::engine::observer::Observer;
use flockform::ranks::{Team, in_process};
use flockform::scene::Scene;
use flockform::shm::Reader;
use flockform::shm::payload::Particle;
use flockform::shm::positions::{Positions, read};

use super::child::Process;
use super::support::*;
use crate::folders::temporary;
use crate::scenes::{load, planned};

fn engine() -> Engine {
    Engine::new(planned(&load("tension", &[])).setup)
}

fn open(name: &str, engine: &Engine) -> Positions {
    Positions::open(&domain(name), "body", engine.present().len()).expect("a publisher")
}

#[test]
fn a_reader_sees_every_step_of_the_body_to_the_bit() {
    let name = domain_name();
    let peer = domain(&name).join("test").expect("shared memory");
    let mut engine = engine();
    let mut shown = open(&name, &engine);
    let reader = read(&peer, "body").expect("a reader");
    for step in 1..=50 {
        engine.advance();
        Positions::show(Some(&mut shown), &engine);
        let slice = reader.take().expect("the step");
        assert_eq!((slice.header().step, slice.len()), (step, engine.present().len()));
        for (i, particle) in slice.iter().enumerate() {
            assert_eq!(particle.id as usize, i + 1);
            assert_eq!(particle.position.map(f64::to_bits), engine.present().get(i).map(f64::to_bits));
        }
    }
    assert!(reader.take().is_none());
}

#[test]
fn a_body_given_as_points_is_shown_by_its_ids_and_in_the_order_of_its_file() {
    let folder = temporary();
    let rows = [(40, [2.0, 0.0]), (7, [0.0, 0.5]), (300, [1.0, 0.0]), (8, [0.0, 0.0])];
    let table = rows.map(|(id, [x, y])| format!("{id},{x},{y}\n")).concat();
    std::fs::write(folder.path().join("cloud.csv"), format!("id,x,y\n{table}")).expect("written");
    let text = "title = \"points\"\nneighbours = { kind = \"within\", radius = 1.2 }\n\
                body = { shape = { kind = \"points\", file = \"cloud.csv\" } }\n";
    let scene = Scene::parse("points", "points.toml", text, &[], Some(folder.path())).expect("valid");
    let engine = Engine::new(planned(&scene).setup);
    let name = domain_name();
    let peer = domain(&name).join("test").expect("shared memory");
    let mut shown = open(&name, &engine);
    let reader = read(&peer, "body").expect("a reader");
    Positions::show(Some(&mut shown), &engine);
    let slice = reader.take().expect("the step");
    let seen: Vec<(u32, [f64; 2])> = slice.iter().map(|one| (one.id, one.position)).collect();
    assert_eq!(seen, rows);
}

#[test]
fn a_reader_that_never_reads_loses_all_but_the_newest_and_holds_nobody_up() {
    let name = domain_name();
    let peer = domain(&name).join("test").expect("shared memory");
    let mut engine = engine();
    let mut shown = open(&name, &engine);
    let reader = read(&peer, "body").expect("a reader");
    let elsewhere = Process::start("never read positions", &name);
    for _ in 0..2000 {
        engine.advance();
        Positions::show(Some(&mut shown), &engine);
    }
    assert_eq!(shown.unsent(), 0);
    assert_eq!(reader.take().expect("the newest").header().step, 2000);
    assert!(reader.take().is_none());
    drop(elsewhere);
}

#[test]
fn a_reader_that_is_killed_while_it_holds_steps_takes_nothing_from_the_run() {
    let name = domain_name();
    let mut engine = engine();
    let mut shown = open(&name, &engine);
    for _ in 0..3 {
        let (done, is_done) = std::sync::mpsc::channel();
        let task = name.clone();
        let reader = std::thread::spawn(move || {
            let reader = Process::start("hold positions", &task);
            done.send(()).expect("the test waits");
            reader
        });
        while is_done.try_recv().is_err() && !reader.is_finished() {
            engine.advance();
            Positions::show(Some(&mut shown), &engine);
            std::thread::sleep(Duration::from_millis(1));
        }
        reader.join().expect("it started").kill();
        for _ in 0..500 {
            engine.advance();
            Positions::show(Some(&mut shown), &engine);
        }
    }
    assert_eq!(shown.unsent(), 0);
    let mut alone = self::engine();
    (0..engine.step()).for_each(|_| alone.advance());
    assert_eq!(engine.present(), alone.present(), "to the bit what it is with nobody looking");
}

#[test]
fn another_process_reads_a_run_of_the_program() {
    let name = domain_name();
    let peer = domain(&name).join("test").expect("shared memory");
    let reader = read(&peer, "specimen").expect("a reader");
    let folder = temporary();
    let mut run = Command::new(env!("CARGO_BIN_EXE_flockform"))
        .args(["run", "tension", "--quiet", "--publish", "specimen", "--set", "stop.steps=100000000"])
        .arg("--out")
        .arg(folder.path().join("out"))
        .env(flockform::shm::domain::VARIABLE, &name)
        .stdin(Stdio::null())
        .spawn()
        .expect("it starts");
    let mut steps = Vec::new();
    until("steps of the run", || {
        reader.wait(Duration::from_millis(100));
        while let Some(slice) = reader.take() {
            assert_eq!(slice.len(), 144);
            assert!(slice.iter().all(|particle| particle.position.iter().all(|x| x.is_finite())));
            steps.push(slice.header().step);
        }
        (steps.len() > 20).then_some(())
    });
    assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
    signal("TERM", run.id());
    let code = until("the run ends", || run.try_wait().expect("a child")).code();
    assert_eq!(code, Some(1), "interrupted, and what there was is written");
    assert!(folder.path().join("out/summary.json").exists());
}

#[test]
fn a_name_that_is_none_or_taken_is_refused_before_anything_is_written() {
    let name = domain_name();
    let _holds = open(&name, &engine());
    let folder = temporary();
    for (given, word) in [("a/b", "no name of a service"), ("body", "at most 1")] {
        let out = folder.path().join("out");
        let output = Command::new(env!("CARGO_BIN_EXE_flockform"))
            .args(["run", "tension", "--publish", given, "--out"])
            .arg(&out)
            .env(flockform::shm::domain::VARIABLE, &name)
            .output()
            .expect("it starts");
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(words.contains(word) && words.contains("help: ") && !out.exists(), "{words}");
    }
}

/// Looks at each step of a run that is shown, and reads it where there is a reader.
struct Shown {
    shown: Option<Positions>,
    reader: Option<Reader<Particle>>,
    seen: Vec<(u32, u32, [u64; 2])>,
}

impl Observer for Shown {
    fn next(&mut self, step: usize) -> usize {
        step + 1
    }

    fn see(&mut self, engine: &Engine, _: f64) -> ControlFlow<()> {
        Positions::show(self.shown.as_mut(), engine);
        if let Some(slice) = self.reader.as_ref().and_then(Reader::take) {
            self.seen.extend(slice.iter().map(|one| (one.id, one.role, one.position.map(f64::to_bits))));
        }
        ControlFlow::Continue(())
    }
}

#[test]
fn a_body_in_parts_is_shown_by_the_first_rank_as_one_alone() {
    let scene = load("tension", &["stop.steps=5"]);
    let shown = |team: Option<&Team>| {
        let plan = team.map_or_else(|| planned(&scene), |team| Plan::of_part(&scene, team).expect("fits"));
        let name = domain_name();
        let peer = domain(&name).join("test").expect("shared memory");
        let is_first = team.is_none_or(Team::is_first);
        let open = || Positions::open(&domain(&name), "body", plan.setup.body.total()).expect("a publisher");
        let shown = is_first.then(open);
        let reader = is_first.then(|| read(&peer, "body").expect("a reader"));
        let mut shown = Shown { shown, reader, seen: Vec::new() };
        run_to_equilibrium_shared(&scene, plan, None, team, &mut shown).expect("can be shared");
        shown.seen
    };
    let expected = shown(None);
    assert_eq!(expected.len() % planned(&scene).count(), 0);
    assert!(expected.len() >= 5 * planned(&scene).count());
    let found: Vec<_> = std::thread::scope(|scope| {
        let ranks: Vec<_> = in_process(3)
            .into_iter()
            .map(|team| {
                let shown = &shown;
                scope.spawn(move || shown(Some(&team)))
            })
            .collect();
        ranks.into_iter().map(|rank| rank.join().expect("no panic")).collect()
    });
    assert!(found[0] == expected && found[1..].iter().all(Vec::is_empty));
}
