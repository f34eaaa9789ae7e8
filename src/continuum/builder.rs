//! Bodies put together in code, without a scene file.

use std::ops::ControlFlow;

use super::equilibrium::run_to_equilibrium;
use super::plan::Plan;
use super::run::Outcome;
use crate::engine::Engine;
use crate::flock::lattice::LatticeKind;
use crate::flock::region::Side;
use crate::scene::{Scene, SceneError};

/// A body, what holds and leads it, and its rule.
///
/// By default the neighbours are the first ones, the rule is the barycentre (Eq. 1) with the rest offset, and a run
/// ends when nothing moves by more than a millionth of the spacing in a step, at the latest after 10,000 steps.
///
/// ```
/// use flockform::{Builder, LatticeKind, Side};
///
/// let outcome = Builder::new(LatticeKind::Hexagonal { spacing: 1.0 })
///     .rectangle([40.0, 10.0])
///     .clamp(Side::Left)
///     .lead(Side::Right, [0.2, 0.0], 50)
///     .run()?;
/// assert_eq!(outcome.reason.name(), "equilibrium");
/// # Ok::<(), flockform::SceneError>(())
/// ```
///
/// Everything is checked when it is laid out, in the words of the program: an error names the key of the
/// scene format (guide `scenes`) and the remedy. What has no method of its own is a key of that format: [`Builder::set`].
#[derive(Clone, Debug)]
pub struct Builder {
    /// Keys of the scene format with their values in TOML.
    keys: Vec<String>,
    roles: Vec<String>,
}

impl Builder {
    /// A body cut from this lattice; its shape is still to be given. A message on an oblique one has its angle in degrees.
    pub fn new(lattice: LatticeKind) -> Self {
        let kind = |kind: &str, numbers: &[(&str, f64)]| {
            let numbers = numbers.iter().map(|(key, value)| format!(",{key}={}", toml(value)));
            format!("lattice={{kind=\"{kind}\"{}}}", numbers.collect::<String>())
        };
        let lattice = match lattice {
            LatticeKind::Square { spacing } => kind("square", &[("spacing", spacing)]),
            LatticeKind::Rectangular { a, b } => kind("rectangular", &[("a", a), ("b", b)]),
            LatticeKind::CentredRectangular { a, b } => kind("centred-rectangular", &[("a", a), ("b", b)]),
            LatticeKind::Hexagonal { spacing } => kind("hexagonal", &[("spacing", spacing)]),
            LatticeKind::Oblique { a, b, angle } => {
                kind("oblique", &[("a", a), ("b", b), ("angle", angle.to_degrees())])
            }
            LatticeKind::Honeycomb { spacing } => kind("honeycomb", &[("spacing", spacing)]),
        };
        let ends = "stop={steps=10000,tolerance=1e-6}";
        Self { keys: vec![lattice, ends.into()], roles: Vec::new() }
    }

    /// Any key of the scene format, as on the command line: `rule.mean.kind=distance`, `frame=lagged`, `stop.steps=500`. A later one takes
    /// the place of what has been said of it before, by [`Builder::material`] or a shape too; `roles` that of all that is clamped and led.
    pub fn set(mut self, key_and_value: impl Into<String>) -> Self {
        self.keys.push(key_and_value.into());
        self
    }

    /// So many columns and rows of sites, the first at the origin; a third of a honeycomb's have no particle.
    pub fn grid(self, columns: u32, rows: u32) -> Self {
        self.set(format!("body.shape={{kind=\"grid\",columns={columns},rows={rows}}}"))
    }

    /// From the origin to this corner \[length\].
    pub fn rectangle(self, corner: [f64; 2]) -> Self {
        self.set(format!("body.shape={{kind=\"rectangle\",max={}}}", toml(corner)))
    }

    /// Around the origin \[length\].
    pub fn disc(self, radius: f64) -> Self {
        self.set(format!("body.shape={{kind=\"disc\",radius={}}}", toml(radius)))
    }

    /// Through these vertices, either way round \[length\].
    pub fn polygon(self, vertices: &[[f64; 2]]) -> Self {
        self.set(format!("body.shape={{kind=\"polygon\",vertices={}}}", toml(vertices)))
    }

    /// Isotropic, in plane stress, of thickness 1; `young` \[force / length^2\] is Young's modulus, `poisson` \[1\] Poisson's ratio.
    /// The rule becomes that of the material, in place of what has been set before of `rule.mean`: what is to differ is set after it.
    pub fn material(self, young: f64, poisson: f64) -> Self {
        let (young, poisson) = (toml(young), toml(poisson));
        self.set(format!("material={{kind=\"isotropic\",young={young},poisson={poisson}}}"))
            .set("rule.mean={kind=\"material\"}")
    }

    /// Keeps the outermost particles of a side where they are. [`Engine::lead`] moves them by hand.
    pub fn clamp(mut self, side: Side) -> Self {
        self.roles.push(format!("{{region={},role=\"clamped\"}}", edge(side)));
        self
    }

    /// Leads the outermost particles of a side by a displacement \[length\], in even parts over so many steps; they stay there.
    pub fn lead(mut self, side: Side, displacement: [f64; 2], steps: usize) -> Self {
        let displacement = toml(displacement);
        let motion = format!("{{kind=\"keyframes\",frames=[{{step={steps},displacement={displacement}}}]}}");
        self.roles.push(format!("{{region={},role=\"leader\",motion={motion}}}", edge(side)));
        self
    }

    /// # Errors
    /// Names each key that is missing, out of range or at odds with another.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let roles = format!("roles=[{}]", self.roles.join(","));
        // Roles first: a key that is set may change one of them.
        let keys: Vec<String> = std::iter::once(roles).chain(self.keys.iter().cloned()).collect();
        Scene::parse("built", "the scene", "title=\"Built in code\"", &keys, None)
    }

    /// The body in its reference configuration, to be stepped by hand.
    ///
    /// # Errors
    /// As [`Builder::scene`]; a body that cannot be laid out.
    pub fn engine(&self) -> Result<Engine, SceneError> {
        Ok(Engine::new(Plan::new(&self.scene()?)?.setup))
    }

    /// Runs the body to its end.
    ///
    /// # Errors
    /// As [`Builder::engine`].
    pub fn run(&self) -> Result<Outcome, SceneError> {
        let scene = self.scene()?;
        run_to_equilibrium(&scene, Plan::new(&scene)?, &mut |_, _| ControlFlow::Continue(()))
    }
}

/// Numbers as TOML has them, to their last digit.
fn toml(numbers: impl std::fmt::Debug) -> String {
    format!("{numbers:?}").replace("NaN", "nan")
}

fn edge(side: Side) -> String {
    let side = match side {
        Side::Left => "left",
        Side::Right => "right",
        Side::Bottom => "bottom",
        Side::Top => "top",
    };
    format!("{{kind=\"edge\",side=\"{side}\"}}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::role::Role;
    use crate::scene::bundled;

    #[test]
    fn a_body_built_in_code_is_the_scene_that_its_keys_write() {
        let built = Builder::new(LatticeKind::Square { spacing: 1.0 })
            .rectangle([20.0, 5.0])
            .clamp(Side::Left)
            .lead(Side::Right, [1.0, 0.0], 10)
            .material(1000.0, 0.3)
            .set("stop.steps=40")
            .scene()
            .expect("a scene");
        assert_eq!(built.stop.steps, 40);
        assert_eq!(built.stop.tolerance, Some(1e-6));
        assert_eq!(built.roles.len(), 2);
        let engine = Engine::new(Plan::new(&built).expect("laid out").setup);
        assert_eq!(engine.body().count(), 21 * 6);
    }

    #[test]
    fn a_particle_that_is_put_somewhere_stays_there_until_a_program_leads_it() {
        let sheet = Builder::new(LatticeKind::Square { spacing: 1.0 }).grid(6, 3).clamp(Side::Left);
        let held = sheet.clone().clamp(Side::Right).scene().expect("a scene");
        let led = "roles=[{ region = { kind = \"edge\", side = \"right\" }, role = \"leader\", \
                   motion = { kind = \"velocity\", per_step = [0.1, 0.0] } }, \
                   { region = { kind = \"edge\", side = \"right\" }, role = \"clamped\", from = 6 }]";
        let led = sheet.set(led).scene().expect("a scene");
        for (scene, at) in [(held, 0), (led, 5)] {
            for (is_seen, is_seen_at_once) in [(false, false), (true, false), (false, true)] {
                let mut engine = Engine::new(Plan::new(&scene).expect("laid out").setup);
                (0..at).for_each(|_| engine.advance());
                let (particle, place) = (17, [9.0, 1.0]);
                engine.lead(particle, place);
                if is_seen_at_once {
                    engine.observe([(particle, [7.0, 2.0])]);
                }
                if is_seen {
                    engine.advance();
                    engine.observe([(particle, place)]);
                }
                for _ in 0..4 {
                    engine.advance();
                    assert_eq!(engine.present().get(particle), place, "step {}", engine.step());
                }
            }
        }
    }

    #[test]
    fn a_particle_of_which_one_component_is_held_is_not_led_by_hand_and_goes_back_to_its_hold() {
        let held =
            "roles=[{ region = { kind = \"edge\", side = \"left\" }, role = \"clamped\", axis = \"x\" }]";
        let sheet =
            Builder::new(LatticeKind::Square { spacing: 1.0 }).grid(6, 3).material(1000.0, 0.3).set(held);
        let mut engine = sheet.engine().expect("laid out");
        engine.lead(0, [0.5, 0.0]);
        engine.advance();
        assert!(engine.displacement(0)[0].abs() < 1e-12, "{:?}", engine.displacement(0));
        engine.observe([(0, [0.5, 0.0])]);
        engine.advance();
        let left = 0.5 * (1.0 - engine.update().damping);
        assert!((engine.displacement(0)[0] - left).abs() < 1e-12, "{:?}", engine.displacement(0));
    }

    #[test]
    fn a_body_that_a_solver_would_put_to_rest_can_be_stepped_as_any() {
        let sheet = Builder::new(LatticeKind::Hexagonal { spacing: 1.0 })
            .rectangle([12.0, 10.0])
            .material(1000.0, 0.3)
            .clamp(Side::Left)
            .lead(Side::Right, [0.12, 0.0], 1);
        let stepped = sheet.engine().expect("laid out");
        let solved = sheet.set("equilibrium.solver=direct").engine().expect("laid out");
        assert!(stepped.update().damping < 0.8, "{}", stepped.update().damping);
        assert_eq!(solved.update(), stepped.update());
    }

    #[test]
    fn a_body_goes_to_rest_by_the_parts_of_its_load() {
        let outcome = Builder::new(LatticeKind::Square { spacing: 1.0 })
            .rectangle([6.0, 3.0])
            .material(1000.0, 0.3)
            .clamp(Side::Left)
            .lead(Side::Right, [0.06, 0.0], 1)
            .set("equilibrium.solver=auto")
            .set("load_steps.increments=5")
            .run()
            .expect("at rest");
        assert_eq!(outcome.engine.step(), 5);
    }

    #[test]
    fn roles_that_are_added_hold_from_their_step_on_as_those_of_a_scene() {
        use crate::engine::setup::RoleChange;
        use crate::flock::condition::{Condition, Quantity};
        use crate::flock::motion::{Interpolation, Keyframe, Motion};
        let sheet = Builder::new(LatticeKind::Square { spacing: 1.0 }).grid(6, 4).clamp(Side::Left);
        for before in [0, 3] {
            let mut engine = sheet.clone().clamp(Side::Right).engine().expect("laid out");
            engine.lead(23, [9.0, 9.0]);
            (0..before).for_each(|_| engine.advance());
            engine.add_role_change(RoleChange::new(vec![23], Role::Follower, before + 1));
            (0..30).for_each(|_| engine.advance());
            assert!(engine.present().get(23)[0] < 6.0, "it follows: {:?}", engine.present().get(23));
        }
        let mut engine = sheet.engine().expect("laid out");
        let frames = vec![Keyframe { step: 5.0, displacement: [1.0, 0.0] }];
        engine.add_role_change(RoleChange {
            when: Some(Condition { quantity: Quantity::X, above: Some(-100.0), below: None }),
            motion: Some(Motion::Keyframes { frames, interpolation: Interpolation::Linear }),
            ..RoleChange::new(vec![23], Role::Leader, 1)
        });
        (0..40).for_each(|_| engine.advance());
        assert!((engine.displacement(23)[0] - 1.0).abs() < 1e-12, "{:?}", engine.displacement(23));
    }

    #[test]
    fn every_lattice_is_that_of_the_bundled_scene() {
        let kinds = [
            ("lattice-square", LatticeKind::Square { spacing: 1.0 }),
            ("lattice-hexagonal", LatticeKind::Hexagonal { spacing: 1.0 }),
            ("lattice-honeycomb", LatticeKind::Honeycomb { spacing: 1.0 }),
        ];
        for (name, kind) in kinds {
            let bundled = bundled(name).expect("bundled").load(&[]).expect("valid");
            let built = Builder::new(kind).grid(3, 3).scene().expect("a scene");
            assert_eq!(built.lattice.name(), bundled.lattice.name(), "{name}");
        }
        let oblique = LatticeKind::Oblique { a: 1.0, b: 0.8, angle: 1.2 };
        let built = Builder::new(oblique).grid(3, 3).scene().expect("a scene");
        assert!((built.lattice.cell_area() - 0.8 * 1.2_f64.sin()).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_is_refused_by_its_key() {
        let square = Builder::new(LatticeKind::Square { spacing: -1.0 }).grid(3, 3);
        let said = square.scene().expect_err("no lattice").to_string();
        assert!(said.contains("lattice.spacing") && said.contains("-1"), "{said}");
        let shapeless = Builder::new(LatticeKind::Square { spacing: 1.0 });
        let said = shapeless.scene().expect_err("no body").to_string();
        assert!(said.contains("body"), "{said}");
        let nan = Builder::new(LatticeKind::Square { spacing: 1.0 }).rectangle([f64::NAN, 1.0]);
        let said = nan.scene().expect_err("no corner").to_string();
        assert!(said.contains("body.shape.max") && !said.contains("TOML"), "{said}");
    }
}
