use flockform::scene::bundled::SCENES;
#[test]
fn t() {
    for one in SCENES {
        let t = std::time::Instant::now();
        let scene = one.load(&[]).unwrap();
        let load = |more: &[String]| one.load(more);
        let all = flockform::stability::extremes::run(&load, &scene, &mut |_| {});
        println!("{} {:.1} s", one.name, t.elapsed().as_secs_f64());
        for c in all {
            if c.body == "the scene" || c.body.contains("scene's") || c.outcome.to_string().contains("WRONG")
            {
                println!("   {} | {}", c.name, c.outcome.to_string().chars().take(150).collect::<String>());
            }
        }
    }
}
