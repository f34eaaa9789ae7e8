//! Ranks of MPI that share a body: `mpirun -n 4 target/debug/examples/ranks tension` prints the same hash of all
//! positions as the example does when it is started alone. A scene may ask for its equilibrium: `beam-loaded`.

use std::ops::ControlFlow;

use flockform::Plan;
use flockform::continuum::digest::fnv1a;
use flockform::continuum::equilibrium::{run_to_equilibrium, run_to_equilibrium_shared};
use flockform::engine::observer::EachStep;
use flockform::ranks::launcher::place_here;
use flockform::ranks::mpi::join;
use flockform::scene::bundled;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, overrides) =
        arguments.split_first().ok_or("name a bundled scene, and overrides of its keys")?;
    let scene = bundled(name).ok_or("there is no such scene")?.load(overrides)?;
    let plan = Plan::new(&scene)?;
    let team = place_here().map(join).transpose()?;
    let mut see = |_: &flockform::Engine, _: f64| ControlFlow::Continue(());
    let outcome = match &team {
        None => run_to_equilibrium(&scene, plan, &mut see)?,
        Some(team) => run_to_equilibrium_shared(&scene, plan, None, team, &mut EachStep(&mut see))?,
    };
    if team.as_ref().is_none_or(|team| team.is_first()) {
        let present = outcome.engine.present();
        let bytes: Vec<u8> =
            present.x.iter().chain(&present.y).flat_map(|value| value.to_le_bytes()).collect();
        println!("step {}, {}: {:016x}", outcome.engine.step(), outcome.reason.name(), fnv1a(&bytes));
    }
    Ok(())
}
