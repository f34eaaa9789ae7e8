//! A body of which each rank lays out a part, and none the whole, ends with the bits of one laid out as a whole.

use std::ops::ControlFlow;

use flockform::continuum::digest::{digest, digest_of_parts};
use flockform::continuum::equilibrium::{run_to_equilibrium_shared, run_to_equilibrium_watched};
use flockform::continuum::mechanics::{Mechanics, Stresses};
use flockform::continuum::parts::laid_out_whole_for;
use flockform::continuum::places::at_places;
use flockform::continuum::plan::Plan;
use flockform::continuum::run::{Outcome, run_shared};
use flockform::engine::Engine;
use flockform::engine::observer::EachStep;
use flockform::engine::probes::ProbeSeries;
use flockform::engine::setup::Setup;
use flockform::engine::state::EngineState;
use flockform::flock::action::ActionKind;
use flockform::flock::lattice::Site;
use flockform::flock::law::Weights;
use flockform::flock::vectors::Vectors;
use flockform::material::stress::StressState;
use flockform::scene::Scene;
use flockform::solve::equilibrium::Solved;

use super::scenes::{load, planned};
use super::{End, Looks, alone, on_ranks};

/// States of the parts of a body, each with the number of its first particle, its histories, and a residual.
type KeptParts = (Vec<(usize, EngineState<'static>)>, Vec<ProbeSeries>, f64);

/// A body in so many parts at a step, if it comes that far.
fn kept_parts(scene: &Scene, step: usize, ranks: usize) -> Option<KeptParts> {
    let parts = on_ranks(ranks, |team| {
        let plan = Plan::of_part(scene, &team).unwrap_or_else(|error| panic!("{error}"));
        let first = plan.setup.body.index_from(plan.setup.body.owned().start);
        let mut looks = Looks { keep_at: Some(step), ..Looks::every(step) };
        let outcome = run_shared(plan, None, &team, &mut looks).expect("can be shared");
        let (state, residual) = looks.kept?;
        Some((first, state, outcome.engine.probes().to_vec(), residual))
    });
    let parts: Vec<_> = parts.into_iter().collect::<Option<_>>()?;
    let residual = parts[0].3;
    let probes = parts.iter().flat_map(|part| part.2.clone()).collect();
    Some((parts.into_iter().map(|(first, state, ..)| (first, state)).collect(), probes, residual))
}

/// Those of the start and those that actions change to.
fn weights(setup: &Setup) -> impl Iterator<Item = &Weights> {
    let later = setup.actions.iter().filter_map(|action| match &action.what {
        ActionKind::Follow(conduct) => Some(&conduct.weights),
        ActionKind::Cut(_) => None,
    });
    std::iter::once(&setup.flock.weights).chain(later)
}

/// Those that a part has exactly see what they see in the whole body, by the same weights, and are loaded alike.
fn assert_as_in_the_whole(part: &Plan, whole: &Plan) {
    let [part, whole] = [part, whole].map(|plan| &plan.setup);
    let force = |setup: &Setup, i: usize| setup.flock.forces.as_ref().map(|forces| forces.get(i));
    let seen = |setup: &Setup, i: usize| -> Vec<Site> {
        setup.flock.neighbours.of(i).iter().map(|&k| setup.body.sites[k as usize]).collect()
    };
    assert_eq!(part.update, whole.update);
    for i in part.body.exact() {
        let index = part.body.index(i);
        assert_eq!((part.body.exact_particle(index), part.body.id(i)), (Some(i), index + 1));
        assert_eq!(part.body.reference.get(i), whole.body.reference.get(index));
        assert_eq!(seen(part, i), seen(whole, index), "particle {}", index + 1);
        for [part, whole] in weights(part).zip(weights(whole)).map(<[&Weights; 2]>::from) {
            if let [Weights::Matrix(part), Weights::Matrix(whole)] = [part, whole] {
                assert_eq!(part.of(i), whole.of(index), "particle {}", index + 1);
            }
        }
        assert_eq!(force(part, i), force(whole, index), "particle {}", index + 1);
    }
}

/// The end of a body of which each rank has a part, put together.
fn parted(scene: &Scene, every: usize, ranks: usize, from: Option<&KeptParts>) -> End {
    assert_eq!(laid_out_whole_for(scene), None);
    let whole = planned(scene);
    let sum = digest(&whole);
    let ends = on_ranks(ranks, |team| {
        let mut plan = Plan::of_part(scene, &team).unwrap_or_else(|error| panic!("{error}"));
        assert_as_in_the_whole(&plan, &whole);
        let (count, owned) = (plan.count(), plan.setup.body.owned_in_order());
        let indices: Vec<usize> = owned.iter().map(|&i| plan.setup.body.index(i)).collect();
        assert_eq!(digest_of_parts(&plan, &team), sum);
        let mut looks = Looks::every(if team.is_first() { every } else { 1 });
        let from = from.map(|(parts, probes, residual)| {
            plan.setup.probes.iter_mut().for_each(|own| own.clone_from(probes));
            (EngineState::of_pieces(parts, &plan.setup).expect("of this body"), *residual)
        });
        let outcome = run_to_equilibrium_shared(scene, plan, from, &team, &mut looks);
        let outcome = outcome.expect("can be shared");
        let engine = &outcome.engine;
        let (readings, stresses) = measured(scene, &outcome);
        let of = |points: &Vectors, i: usize| (points.x[i], points.y[i]);
        let places: Vec<_> =
            owned.iter().map(|&i| (of(engine.present(), i), of(engine.previous(), i))).collect();
        let energies: Vec<_> = owned.iter().map(|&i| [engine.pe1(i), engine.pe2(i)]).collect();
        let roles: Vec<_> = owned.iter().map(|&i| engine.roles()[i]).collect();
        let sums = engine.energies();
        (
            places,
            energies,
            roles,
            (engine.step(), format!("{:?}", outcome.reason)),
            (outcome.residual, sums),
            (count, indices),
            engine.probes().to_vec(),
            (format!("{:?}", engine.breaks()), readings, stresses),
        )
    });
    let (step, reason) = ends[0].3.clone();
    let (residual, sums) = ends[0].4;
    let mut end = End {
        step,
        reason,
        places: Vec::new(),
        residual: residual.to_bits(),
        breaks: ends[0].7.0.clone(),
        roles: String::new(),
        seen: Vec::new(),
        probes: Vec::new(),
        readings: ends[0].7.1.clone(),
    };
    for one in &ends {
        assert_eq!((&one.3.0, &one.3.1), (&end.step, &end.reason));
        assert_eq!((&one.7.0, &one.7.1), (&end.breaks, &end.readings));
        assert_eq!((one.4.0.to_bits(), one.4.1.map(f64::to_bits)), (end.residual, sums.map(f64::to_bits)));
    }
    // In the order of the whole body.
    let of_rank = |rank: usize| ends[rank].5.1.iter().enumerate().map(move |(k, &index)| (index, rank, k));
    let mut order: Vec<_> = (0..ends.len()).flat_map(of_rank).collect();
    order.sort_unstable();
    assert!(order.iter().map(|one| one.0).eq(0..whole.count()));
    let order = || order.iter().map(|&(_, rank, k)| (&ends[rank], k));
    end.places.extend(order().map(|(one, k)| one.0[k].0.0.to_bits()));
    end.places.extend(order().map(|(one, k)| one.0[k].0.1.to_bits()));
    end.places.extend(order().map(|(one, k)| one.0[k].1.0.to_bits()));
    end.places.extend(order().map(|(one, k)| one.0[k].1.1.to_bits()));
    end.places.extend(order().flat_map(|(one, k)| one.1[k].map(f64::to_bits)));
    if scene.material.is_some() {
        end.places.extend(order().flat_map(|(one, k)| one.7.2[k]));
    }
    let roles: Vec<_> = order().map(|(one, k)| one.2[k]).collect();
    end.roles = format!("{roles:?}");
    // Each is on one rank; the lists of the test are ascending.
    end.probes = ends.iter().flat_map(|one| one.6.clone()).collect();
    end.probes.sort_by_key(|probe| probe.particle);
    end.seen.push((ends.iter().map(|one| one.5.0).max().unwrap_or(0), 0));
    end
}

/// The readings on the whole body, and stresses of a rank's own particles: nothing without a material, but how it was solved.
fn measured(scene: &Scene, outcome: &Outcome) -> (String, Vec<[u64; 3]>) {
    let engine = &outcome.engine;
    let how = |solved: &Solved| {
        let Solved { solver, why, iterations, residuals, converged, known_to, .. } = solved;
        let residuals: Vec<u64> = residuals.iter().map(|residual| residual.to_bits()).collect();
        format!("{solver} {why} {iterations} {converged} {known_to:?} {residuals:?}")
    };
    let how = outcome.solved.as_ref().map_or_else(String::new, how);
    let Some(stresses) = Stresses::at_present(engine) else { return (how, Vec::new()) };
    let own = engine.body().owned_in_order().into_iter().map(|i| stresses.particles[i]);
    let of =
        |stress: Option<StressState>| stress.map_or([1; 3], |stress| stress.components.map(f64::to_bits));
    let readings = Mechanics::under(&stresses, engine).expect("there are cells");
    let places = at_places(scene, engine, &stresses);
    let cautions = readings.cautions(engine);
    (format!("{readings:#?} {places:#?} {cautions:?} {how}"), own.map(of).collect())
}

/// The histories of a run alone that is looked at in each step, and what is measured at its end.
fn probed(scene: &Scene) -> (Vec<ProbeSeries>, (String, Vec<[u64; 3]>)) {
    let plan = planned(scene);
    let mut probes: Vec<_> = plan.probes.iter().map(|&index| ProbeSeries::new(index)).collect();
    let mut see = |engine: &Engine, _: f64| {
        probes.iter_mut().for_each(|probe| probe.record(engine));
        ControlFlow::Continue(())
    };
    let outcome = run_to_equilibrium_watched(scene, plan, &mut EachStep(&mut see));
    (probes, measured(scene, &outcome.expect("an end")))
}

pub(super) fn assert_parted_the_same(name: &str, sets: &[&str], every: usize) {
    assert_scene_parted_the_same(&load(name, sets), &format!("{name} {sets:?}"), every);
}

/// Two numbers of ranks for a scene, which differ from scene to scene: those of one test are tried on all of them.
fn ranks_for(name: &str) -> [usize; 2] {
    let sum: usize = name.bytes().map(usize::from).sum();
    [[2, 8], [3, 5], [1, 3], [2, 5]][sum % 4]
}

pub(super) fn assert_scene_parted_the_same(scene: &Scene, name: &str, every: usize) {
    let (probes, (readings, stresses)) = probed(scene);
    let mut expected = End { seen: Vec::new(), probes, readings, ..alone(scene, every) };
    expected.places.extend(stresses.into_iter().flatten());
    // One that is put to rest at once is not begun and gone on with.
    let kept = if scene.equilibrium.is_none() { kept_parts(scene, every, 3) } else { None };
    let begun = ranks_for(name).map(|ranks| (ranks, None));
    let resumed = kept.iter().flat_map(|kept| [2, 4].map(|ranks| (ranks, Some(kept))));
    for (ranks, from) in begun.into_iter().chain(resumed) {
        let found = End { seen: Vec::new(), ..parted(scene, every, ranks, from) };
        let from = from.map_or("", |_| ", begun in 3");
        let what = format!("{name} in {ranks} parts{from}");
        assert_eq!(
            (found.step, &found.reason, found.residual),
            (expected.step, &expected.reason, expected.residual),
            "{what}"
        );
        assert!(found.roles == expected.roles, "{what}: roles");
        assert!(found.probes == expected.probes, "{what}: probes");
        assert!(found.breaks == expected.breaks, "{what}: broken bonds");
        assert_eq!(found.readings, expected.readings, "{what}");
        let first = found.places.iter().zip(&expected.places).position(|(found, expected)| found != expected);
        assert!(found == expected, "{what}: {first:?} of {}", expected.places.len());
    }
}

#[test]
fn a_body_laid_out_in_parts_has_the_bits_of_one_laid_out_as_a_whole() {
    let small = ["record.probes=[]", "stop.steps=60"];
    for (name, more) in [
        ("tension", &["frame=none"][..]),
        ("tension", &[]),
        ("tension-immediate", &[]),
        ("feedback-oscillate", &[]),
        ("poisson-term", &[]),
        ("power-mean", &[]),
        ("distance-weights", &[]),
        ("lattice-honeycomb", &[]),
        ("lattice-hexagonal", &[]),
        // Neighbours that are looked at from one side, on the side of the ranks before.
        ("tension", &["frame=none", "neighbours={kind=\"offsets\",offsets=[[-1,0],[0,1],[0,-1]]}"]),
    ] {
        assert_parted_the_same(name, &[&small[..], more].concat(), 25);
    }
}

#[test]
fn probes_of_a_body_in_parts_are_those_of_a_run_alone() {
    let body = "body.shape={kind=\"grid\",columns=120,rows=9}";
    let probes = "record.probes=[1,2,300,301,455,540,541,700,1000,1080]";
    let leaders = "roles=[{region={kind=\"edge\",side=\"left\"},role=\"clamped\"},\
         {region={kind=\"edge\",side=\"right\"},role=\"leader\",motion={kind=\"velocity\",per_step=[0.6,0.0]}}]";
    for (name, more) in [
        ("tension", &["frame=none"][..]),
        // Looked at now and then: most steps are taken together.
        ("tension", &["frame=\"lagged\""]),
        ("tension-immediate", &[]),
        ("poisson-term", &["frame=none"]),
        ("tension", &["frame=none", "stop.tolerance=0.02", leaders]),
        // It diverges.
        ("tension", &["frame=none", "update.damping=1.5", leaders]),
        ("lattice-hexagonal", &["frame=none"]),
    ] {
        assert_parted_the_same(name, &[&[body, probes, "stop.steps=90"][..], more].concat(), 40);
    }
}

/// Those of other parts as well, which steps together move along, wherever they have come by then.
#[test]
fn roles_that_are_taken_at_a_step_between_steps_together_are_taken_where_the_particles_are() {
    let body = "body.shape={kind=\"grid\",columns=120,rows=9}";
    let some = "region={kind=\"box\",min=[9.5,-1.0],max=[110.5,3.5]},from=21";
    for role in ["role=\"clamped\"", "role=\"leader\",motion={kind=\"velocity\",per_step=[0.01,0.03]}"] {
        let roles = format!(
            "roles=[{{region={{kind=\"edge\",side=\"left\"}},role=\"clamped\"}},\
             {{region={{kind=\"box\",min=[9.5,6.5],max=[110.5,7.5]}},role=\"leader\",\
             motion={{kind=\"velocity\",per_step=[0.05,0.02]}}}},{{{some},{role}}}]"
        );
        let sets = [body, "frame=none", "record.probes=[]", "record.figures=[]", "stop.steps=80", &roles];
        assert_parted_the_same("tension", &sets, 40);
    }
}

#[test]
fn what_is_found_on_the_way_of_a_body_in_parts_is_what_a_run_alone_finds() {
    let probes = "record.probes=[1,30,60,61,100]";
    let all = "region={kind=\"all\"}";
    let far = format!("roles[2]={{{all},role=\"clamped\",when={{quantity=\"displacement\",above=1.5}}}}");
    let led = format!(
        "roles[2]={{{all},role=\"leader\",from=5,when={{quantity=\"pe1\",above=0.02}},\
         motion={{kind=\"velocity\",per_step=[0.01,0.02]}}}}"
    );
    let ghost = format!("roles[2]={{{all},role=\"ghost\",from=9,when={{quantity=\"pe1\",above=0.3}}}}");
    let ghosts = "roles[2]={region={kind=\"box\",min=[4.5,0.5],max=[6.5,2.5]},role=\"ghost\"}";
    let later = "roles[2]={region={kind=\"disc\",centre=[8.0,2.0],radius=1.2},role=\"ghost\",from=20}";
    let cuts = "cuts=[{from=[7.5,-1.0],to=[7.5,1.6]},{from=[2.2,1.4],to=[12.4,1.6]}]";
    let stretch = |ghosts: &str| format!("fracture={{stretch=1.2,ghosts=\"{ghosts}\"}}");
    let [lattice, mirrored, none] = ["lattice", "mirrored", "none"].map(stretch);
    let action = "actions=[{at=12,what={kind=\"cut\",from=[6.5,-5.0],to=[6.5,6.2]}},\
         {at=30,what={kind=\"cut\",from=[-1.0,4.5],to=[8.0,4.5]}}]";
    let holed = "body={outline=\"lattice\",shape={kind=\"rectangle\",max=[20,9]},\
         holes=[{kind=\"disc\",centre=[9.4,4.3],radius=2.6}]}";
    let along_hole = "roles[2]={region={kind=\"outline\",hole=1},role=\"clamped\"}";
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("led.csv");
    let rows: String = (0..10).map(|row| format!("9,{row},3.5,{}\n", 0.3 * f64::from(row))).collect();
    std::fs::write(&file, format!("x,y,ux,uy\n{rows}")).expect("written");
    let table = format!("roles[1].motion={{kind=\"csv\",file={file:?},steps=40}}");
    for (name, more) in [
        ("tension", &[&far[..]][..]),
        ("tension", &[&led]),
        ("tension", &[&ghost]),
        ("tension", &[&ghost, "frame=none", &none]),
        ("tension", &[ghosts]),
        ("tension", &[later, "frame=none"]),
        ("tension", &[cuts, ghosts]),
        ("tension", &[cuts, "frame=none", &none]),
        ("fracture", &[]),
        ("fracture", &[&lattice]),
        ("fracture", &[&mirrored]),
        ("fracture", &[&none]),
        ("fracture", &[&none, "frame=none"]),
        ("fracture-hexagonal", &[]),
        ("tension", &["frame=none", &none, "stop.divergence_ratio=0.2", super::THROWN]),
        ("tension-immediate", &[cuts]),
        ("tension", &[action]),
        ("tension", &[action, "frame=none"]),
        ("tension", &[holed, along_hole, "frame=none"]),
        ("tension", &[&table]),
    ] {
        let steps = if name.starts_with("fracture") { "stop.steps=100" } else { "stop.steps=60" };
        assert_parted_the_same(name, &[&[probes, steps][..], more].concat(), 25);
    }
}

pub(super) const PLATE: &str = r#"
title = "A plate in parts"
lattice = { kind = "square", spacing = 1.0 }
rule = { mean = { kind = "material" } }
material = { kind = "isotropic", young = 1000.0, poisson = 0.3 }
stop = { steps = 60 }

[body]
outline = "lattice"
shape = { kind = "disc", centre = [10.3, 5.2], radius = 11.1 }
holes = [{ kind = "disc", centre = [8.4, 4.3], radius = 2.7 }]

[[roles]]
region = { kind = "edge", side = "left", depth = 2.0 }
role = "clamped"

[[roles]]
region = { kind = "edge", side = "right", depth = 2.0 }
role = "leader"
motion = { kind = "keyframes", frames = [{ step = 40, displacement = [1.5, 0.4] }] }

[record]
probes = [1, 30, 61, 100]
"#;

pub(super) fn plate(text: &str, sets: &[&str]) -> Scene {
    let all: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::parse("plate", "plate", text, &all, None).unwrap_or_else(|error| panic!("{sets:?}: {error}"))
}

#[test]
fn a_material_in_parts_has_the_bits_of_one_laid_out_as_a_whole() {
    let grid = "body={shape={kind=\"grid\",columns=24,rows=9}}";
    let lattice = |kind: &str| format!("lattice={{kind=\"{kind}\",spacing=1.0}}");
    let [hexagonal, honeycomb] = ["hexagonal", "honeycomb"].map(lattice);
    let soft = "material.poisson=0.49";
    let rotates = "rule.mean={kind=\"material\",rotation=\"corotated\"}";
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[14.0,6.0],radius=3.1},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let paper = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}"];
    let torn = "fracture={stretch=1.1,ghosts=\"none\"}";
    let when = "roles[2]={region={kind=\"all\"},role=\"clamped\",when={quantity=\"displacement\",above=0.6}}";
    for sets in [
        &[][..],
        &[grid],
        &["lattice={kind=\"rectangular\",a=1.0,b=0.7}"],
        &["lattice={kind=\"centred-rectangular\",a=1.5,b=1.1}"],
        &["lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}"],
        &[&hexagonal],
        &[&honeycomb],
        &[&honeycomb, grid],
        &[rotates],
        &[inclusion],
        &[soft],
        &[soft, &hexagonal],
        &[soft, rotates, inclusion],
        &["stop.tolerance=1e-3"],
        &[when],
        &paper,
        &[&paper[..], &["frame=\"lagged\""]].concat(),
        &[&paper[..], &[torn]].concat(),
    ] {
        assert_scene_parted_the_same(&plate(PLATE, sets), &format!("{sets:?}"), 25);
    }
}

#[test]
fn a_material_fitted_to_its_outline_in_parts_has_the_bits_of_one_laid_out_as_a_whole() {
    let lattice = |kind: &str| format!("lattice={{kind=\"{kind}\",spacing=1.0}}");
    let [hexagonal, honeycomb] = ["hexagonal", "honeycomb"].map(lattice);
    let fitted = "body.outline=\"fitted\"";
    let rotates = "rule.mean={kind=\"material\",rotation=\"corotated\"}";
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[15.6,5.4],radius=2.6},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let aligned = "body={shape={kind=\"rectangle\",max=[22,9]}}";
    let turned =
        "body={shape={kind=\"polygon\",vertices=[[0.2,0.1],[21.3,-0.4],[23.1,7.7],[12.0,9.9],[1.1,8.3]]}}";
    let long = "body={shape={kind=\"polygon\",vertices=[[0.2,0.1],[60.3,-0.4],[120.1,3.7],[90.0,10.9],[1.1,8.3]]},\
         holes=[{kind=\"disc\",centre=[30.4,4.3],radius=2.1},{kind=\"disc\",centre=[70.1,5.3],radius=2.6},\
         {kind=\"disc\",centre=[100.2,5.9],radius=1.3}]}";
    let strip = "body={shape={kind=\"rectangle\",max=[120,9]}}";
    let probes = "record.probes=[1,30,61,100,501,600,1000]";
    let several = "loads=[{kind=\"pressure\",region={kind=\"outline\",hole=1},pressure=9.0},\
         {kind=\"traction\",region={kind=\"edge\",side=\"top\",depth=4.0},traction=[2.0,7.0],\
         profile={from=[0.0,0.0],to=[20.0,1.0],factors=[0.5,1.5]}},\
         {kind=\"force\",region={kind=\"disc\",centre=[17.0,6.0],radius=2.0},force=[0.5,-1.5]},\
         {kind=\"body\",force=[0.1,-0.7]}]";
    let traction = "loads=[{kind=\"traction\",region={kind=\"edge\",side=\"top\"},traction=[2.0,7.0]}]";
    let places = "record.places=[[16.3,5.8],[2.1,5.5],[20.9,5.0],[12.0,8.0]]";
    for sets in [
        &[][..],
        &[inclusion, several],
        &[inclusion, rotates, &hexagonal, places],
        &[aligned],
        &[aligned, traction, places],
        &[aligned, rotates],
        &["lattice={kind=\"rectangular\",a=1.0,b=0.7}"],
        &["lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}"],
        &[&hexagonal],
        &[&honeycomb],
        &[turned],
        &[turned, &hexagonal, traction],
        &[long, several, probes],
        &[long, several, rotates, places, probes],
        &[long, several, &hexagonal, probes],
        &[long, &honeycomb],
        &[long, several, "lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}"],
        &[strip, traction, places, probes],
        &[rotates, several],
        &[several, places],
        &[several, &hexagonal],
    ] {
        let sets = [&[fitted][..], sets].concat();
        assert_scene_parted_the_same(&plate(PLATE, &sets), &format!("{sets:?}"), 25);
    }
}

/// Large enough for several steps together.
#[test]
fn a_large_material_in_parts_too() {
    let sets = ["body={shape={kind=\"grid\",columns=400,rows=60}}", "stop.steps=40"];
    assert_scene_parted_the_same(&plate(PLATE, &sets), "large", 17);
}

#[test]
fn loads_on_a_body_in_parts_are_those_on_one_laid_out_as_a_whole() {
    let grid = "body={shape={kind=\"grid\",columns=24,rows=9}}";
    // Of the places one is in no cell where there is a hole, one is on a side of two cells, one at a particle.
    let probes = "record={probes=[1,30,61,100],places=[[16.3,5.8],[2.1,5.5],[20.9,5.0],[12.0,6.0],[6.8,6.9],[15.0,2.5]]}";
    let released = "roles[1]={region={kind=\"edge\",side=\"top\"},role=\"clamped\",from=30}";
    let pressure = "{kind=\"pressure\",region={kind=\"outline\",hole=1},pressure=9.0}";
    let traction = "{kind=\"traction\",region={kind=\"edge\",side=\"top\",depth=4.0},traction=[2.0,7.0],\
         profile={from=[0.0,0.0],to=[20.0,1.0],factors=[0.5,1.5]}}";
    let force = "{kind=\"force\",region={kind=\"disc\",centre=[17.0,6.0],radius=2.0},force=[0.5,-1.5]}";
    let weight = "{kind=\"body\",force=[0.1,-0.7]}";
    let all = |loads: &[&str]| format!("loads=[{}]", loads.join(","));
    let several = all(&[pressure, traction, force, weight]);
    let of_grid = all(&["{kind=\"pressure\",region={kind=\"outline\"},pressure=3.0}", traction, weight]);
    let of_ids =
        all(&["{kind=\"traction\",region={kind=\"ids\",ids=[9,18,27,36,45,46]},traction=[0.0,5.0]}"]);
    let inclusion = "body.inclusions=[{shape={kind=\"disc\",centre=[14.0,6.0],radius=3.1},\
         material={kind=\"isotropic\",young=9000.0,poisson=0.2}}]";
    let rotates = "rule.mean={kind=\"material\",rotation=\"corotated\"}";
    let along = "roles[0].region={kind=\"outline\",pieces=[4]}";
    let held = |side: &str, axis: &str| {
        format!("{{region={{kind=\"edge\",side=\"{side}\",depth=1.5}},role=\"clamped\",axis=\"{axis}\"}}")
    };
    let rollers = format!("roles=[{},{}]", held("left", "x"), held("bottom", "y"));
    // What holds them is then an offset of nothing.
    let at_zero = rollers.replace(",depth=1.5", "");
    let led = "{region={kind=\"edge\",side=\"right\",depth=1.5},role=\"leader\",axis=\"x\",\
         motion={kind=\"keyframes\",frames=[{step=20,displacement=[0.8,0.0]}]}}";
    let pulled = format!("roles=[{},{},{led}]", held("left", "x"), held("bottom", "y"));
    let on_leaders =
        all(&["{kind=\"force\",region={kind=\"edge\",side=\"right\",depth=2.0},force=[0.5,1.0]}"]);
    let paper = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}"];
    for sets in [
        &[&several[..]][..],
        &[&several, released],
        &[&several, "lattice={kind=\"hexagonal\",spacing=1.0}"],
        &[&several, "lattice={kind=\"honeycomb\",spacing=1.0}"],
        &[&several, "lattice={kind=\"oblique\",a=1.0,b=0.9,angle=70.0}"],
        &[&several, inclusion, rotates],
        &[&several, "material.poisson=0.49"],
        &[grid, &of_grid],
        &[grid, &of_grid, "lattice={kind=\"hexagonal\",spacing=1.0}"],
        &[grid, &of_grid, along],
        &[grid, along],
        &[grid, &of_ids],
        &[&rollers, &several],
        &[grid, &rollers, &of_grid],
        &[grid, &at_zero, &of_grid, rotates],
        &[&pulled],
        &[grid, &pulled],
        &[grid, &pulled, &of_grid],
        &[&paper[..], &[&on_leaders[..]]].concat(),
    ] {
        assert_scene_parted_the_same(&plate(PLATE, &[sets, &[probes]].concat()), &format!("{sets:?}"), 25);
    }
}

/// What a scene is refused for as a whole and in parts, on every rank: something that says `what`.
pub(super) fn assert_refused_the_same(scene: &Scene, what: &str) {
    assert_eq!(laid_out_whole_for(scene), None);
    let expected = Plan::new(scene).expect_err(what).to_string();
    assert!(expected.contains(what), "{what}: {expected}");
    for ranks in [1, 2, 3, 5, 8] {
        let found = on_ranks(ranks, |team| Plan::of_part(scene, &team).expect_err(what).to_string());
        assert!(found.iter().all(|error| *error == expected), "{ranks} ranks: {found:?} {expected}");
    }
}

#[test]
fn a_material_in_parts_is_refused_for_what_it_is_refused_for_as_a_whole() {
    let body = |vertices: &str| {
        format!("body={{outline=\"lattice\",shape={{kind=\"polygon\",vertices=[{vertices}]}}}}")
    };
    // Two plates with a corner in common.
    let hinge = body("[0,0],[9,0],[9,5],[18,5],[18,9],[9,9],[9,5],[0,5]");
    let narrow = body("[0,0],[18,0],[18,0.5],[0,0.5]");
    let few = "neighbours={kind=\"first\"}";
    let apart = "body={outline=\"lattice\",shape={kind=\"rectangle\",max=[18,9]},\
         holes=[{kind=\"rectangle\",min=[8.5,-1],max=[9.5,10]}]}";
    let far = "neighbours={kind=\"within\",radius=2.9}";
    let loads = |loads: &str| format!("loads=[{loads}]");
    let weight = loads("{kind=\"body\",force=[0.1,-0.7]}");
    let nowhere = loads("{kind=\"force\",region={kind=\"box\",min=[90,0],max=[95,9]},force=[1,0]}");
    let off = loads("{kind=\"traction\",region={kind=\"box\",min=[90,0],max=[95,9]},traction=[1,0]}");
    let plain = "body={outline=\"lattice\",shape={kind=\"rectangle\",max=[18,9]}}";
    let at =
        |role: &str| format!("roles=[{{region={{kind=\"edge\",side=\"left\"}},role=\"clamped\"{role}}}]");
    let one = "roles=[{region={kind=\"ids\",ids=[100]},role=\"clamped\"}]";
    let led_on_rollers = at(",axis=\"x\"").replace(
        "}]",
        "},{region={kind=\"edge\",side=\"right\"},role=\"leader\",axis=\"x\",motion={kind=\"velocity\",per_step=[0.6,0]}}]",
    );
    let within = "roles=[{region={kind=\"box\",min=[0,0],max=[9,9]},role=\"clamped\"},\
        {region={kind=\"box\",min=[0,0],max=[8,8]},role=\"clamped\",axis=\"y\"}]";
    let paper = ["rule.mean.kind=\"barycentre\"", "neighbours={kind=\"second\"}"];
    let fitted = |body: &str| format!("body={{outline=\"fitted\",{body}}}");
    let thin = fitted("shape={kind=\"rectangle\",max=[18,0.5]}");
    let small =
        fitted("shape={kind=\"rectangle\",max=[18,9]},holes=[{kind=\"disc\",centre=[9.4,4.3],radius=0.3}]");
    let slanted = fitted("shape={kind=\"polygon\",vertices=[[0,0],[40.2,1.3],[39,9.2],[1,8.1]]}");
    for (what, sets) in [
        ("less than the spacing", &[&thin[..]][..]),
        ("less than the spacing", &[&small]),
        ("no leader holds", &[&slanted, &weight, "roles=[]"]),
        ("can slide or turn", &[&slanted, &weight, &at(",axis=\"x\"")]),
        ("no particle of the body lies", &[&slanted, &nowhere]),
        ("no part of the outline lies", &[&slanted, &off]),
        ("there is no particle 5000", &[&slanted, "record={probes=[5000]}"]),
        ("is outside the body", &[&slanted, "record={places=[[12.0,4.0],[50.4,4.3]]}"]),
        ("like a hinge", &[&hinge[..]]),
        ("like a hinge", &[&hinge, &weight, &at("")]),
        ("use a smaller spacing", &[&hinge, &weight, &at("")]),
        ("no leader holds", &[&weight, "roles=[]"]),
        ("at one particle only", &[&weight, one]),
        ("can slide or turn", &[plain, &weight, &at(",axis=\"x\"")]),
        ("can slide or turn", &[plain, &led_on_rollers, "equilibrium={}"]),
        ("no particle of the body lies", &[&nowhere]),
        ("no part of the outline lies", &[&off]),
        ("a rule without a stiffness", &[&paper[..], &[&weight]].concat()),
        ("no cell", &[&narrow]),
        ("no neighbours", &[few]),
        ("no chain of cells", &[apart, far]),
        ("are not connected", &[apart]),
        ("is outside the body", &["record={places=[[12.0,8.0],[8.4,4.3]]}"]),
        ("roles[0] holds these particles altogether", &[within]),
    ] {
        assert_refused_the_same(&plate(PLATE, &[&["record.probes=[]"], sets].concat()), what);
    }
}
