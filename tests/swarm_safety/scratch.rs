use flockform::scene::swarm::Swarm;
use flockform::swarm::flight::fly;
use std::ops::ControlFlow;
#[test]
fn files() {
    for name in std::env::var("FILES").unwrap_or_default().split_whitespace() {
        let swarm = match Swarm::from_file(name.as_ref(), &[]) {
            Ok(swarm) => swarm,
            Err(error) => {
                println!("{name}: {error}");
                continue;
            }
        };
        let start = std::time::Instant::now();
        let mut planes = 0;
        let (_, report) = fly(&swarm, &mut |_, _| {
            planes += 1;
            ControlFlow::Continue(())
        })
        .expect("flies");
        println!(
            "{name}: {:?} {:?} way {:?} err {:?} {:.2?} {:?}",
            report.clearance,
            report.closest.map(|one| one.to_string()),
            report.way,
            report.affine_error.or(report.formation_error),
            start.elapsed(),
            report.acceleration.map(|one| one.words(|x| format!("{x:.4}")))
        );
    }
}
