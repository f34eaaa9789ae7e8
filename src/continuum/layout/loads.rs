//! From the loads of a scene to forces on its particles.

use super::Layout;
use crate::flock::vectors::Vectors;
use crate::material::outline_loads::{self, Loader, OutlineLoad, Push};
use crate::scene::{Load, Scene, SceneError};

impl Layout {
    /// Forces of each of the scene's loads on the particles \[force\], shape \[loads\]\[count\]; none without a
    /// material.
    ///
    /// # Errors
    /// Names the load that has nothing to act on.
    pub fn forces_by_load(
        &self,
        scene: &Scene,
        loads: &[outline_loads::Load],
    ) -> Result<Vec<Vectors>, SceneError> {
        let Some(cells) = &self.cells else { return Ok(Vec::new()) };
        if loads.is_empty() {
            return Ok(Vec::new());
        }
        let boundary = self.boundary();
        let loader = Loader::new(cells, &self.body, (self.outline.as_ref(), &boundary));
        let of_load = |k: usize| {
            let mut forces = Vectors::zeros(self.body.count());
            loader.add(&loads[k], &mut forces).map_err(|error| {
                let help = match error {
                    outline_loads::LoadError::NotFinite => "give finite numbers",
                    _ => "move the region onto particles that belong to cells",
                };
                scene.refuse(&format!("loads[{k}]"), error.to_string(), help)
            })?;
            Ok(forces)
        };
        (0..loads.len()).map(of_load).collect()
    }

    /// The scene's loads, each with the region that it acts on, in their order.
    ///
    /// # Errors
    /// Names a load whose region holds no particle or no part of the outline.
    pub fn loads(&self, scene: &Scene) -> Result<Vec<outline_loads::Load>, SceneError> {
        (0..scene.loads.len()).map(|k| self.load(scene, k)).collect()
    }

    fn load(&self, scene: &Scene, number: usize) -> Result<outline_loads::Load, SceneError> {
        let thickness = scene.material.as_ref().map_or(1.0, |elastic| elastic.thickness());
        let key = format!("loads[{number}]");
        Ok(match &scene.loads[number] {
            Load::Outline { region, push, profile } => {
                let portions = self.portions(scene, &key, region)?;
                let push = match push {
                    Push::Traction(traction) => Push::Traction(traction.map(|t| t * thickness)),
                    Push::Pressure(pressure) => Push::Pressure(pressure * thickness),
                };
                outline_loads::Load::Outline(OutlineLoad { portions, push, profile: *profile })
            }
            Load::Force { region, force } => {
                let particles = self.pick(scene, &key, region)?;
                let particles = particles.into_iter().map(|i| i as u32).collect();
                outline_loads::Load::Particles { particles, force: *force }
            }
            Load::Body { force } => outline_loads::Load::Body(force.map(|f| f * thickness)),
        })
    }
}
