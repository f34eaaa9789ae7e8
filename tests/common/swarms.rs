//! Bundled swarms with overrides.

use flockform::scene::bundled::bundled_swarm;
use flockform::scene::swarm::Swarm;

/// The bundled swarm of this name with overrides, which must be valid.
pub fn load_swarm(name: &str, overrides: &[&str]) -> Swarm {
    let owned: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    let loaded = bundled_swarm(name).expect("bundled").load_swarm(&owned);
    loaded.unwrap_or_else(|error| panic!("{name} {overrides:?}: {error}"))
}
