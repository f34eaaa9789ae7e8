//! Bounds of a flight for which there is something to measure.

use super::Flight;
use crate::scene::SceneError;
use crate::scene::swarm::Swarm;

/// Refuses bounds that no flight of this swarm could keep, for there is nothing to measure them by.
///
/// # Errors
/// Names the first such bound.
pub fn require(swarm: &Swarm, flight: &Flight) -> Result<(), SceneError> {
    let bounds = &swarm.raw.flight.bounds;
    let formation = flight.control().formation();
    let has_affine = formation.affine(0.0).is_some();
    // A scene changes the roles on its way, and with them the place of rest.
    let has_shape = has_affine || !formation.is_led_here() || formation.settled(&formation.places).is_some();
    let has_solids = formation.count() > 1 || !swarm.raw.obstacles.is_empty();
    let no_affine = "the leaders do not all fly one manoeuvre, so no robot has a place by it";
    let unled = formation.unled();
    let led = "let a leader reach every robot by links that last, or leave the bound out";
    let (no_shape, shaped) = match (formation.named(|m| unled.contains(&m)), formation.no_rest()) {
        (Some(names), _) => (format!("no leader reaches {names}"), led),
        (None, why) => {
            let why = why.map_or(String::new(), |why| format!(": {why}"));
            let why = format!(
                "the leaders do not all fly one manoeuvre, and no place of rest behind them is known{why}"
            );
            (why, "let all leaders follow one manoeuvre, or leave the bound out")
        }
    };
    let no_continuum = "the robots are not the particles of a scene that runs beside them";
    let no_solids = "there is one robot, and no obstacle";
    let one_manoeuvre = "let all leaders follow one manoeuvre, or bound final_error instead";
    let scene = "give [scene] the name of a stepped scene and no [[robots]], or leave the bound out";
    let checks = [
        ("affine_error", bounds.affine_error.is_some(), has_affine, no_affine, one_manoeuvre),
        ("final_error", bounds.final_error.is_some(), has_shape, &no_shape, shaped),
        ("settling_time", bounds.settling_time.is_some(), has_shape, &no_shape, shaped),
        (
            "continuum_error",
            bounds.continuum_error.is_some(),
            flight.continuum_error().is_some(),
            no_continuum,
            scene,
        ),
        ("clearance", bounds.clearance.is_some(), has_solids, no_solids, "leave the bound out"),
    ];
    let missing = checks.into_iter().find(|(_, is_declared, is_measured, ..)| *is_declared && !is_measured);
    missing.map_or(Ok(()), |(key, _, _, why, help)| {
        let why = format!("can never be measured: {why}");
        Err(swarm.refuse(&format!("flight.bounds.{key}"), why, help))
    })
}
