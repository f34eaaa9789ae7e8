//! How fast errors die out in a formation with a frame, behind late poses, against flights.

use super::*;
use crate::swarm::flight::Record;

/// Sixteen robots, four of which lead; two begin beside their places.
fn framed(frame: &str, set: &[&str]) -> Swarm {
    let text = format!(
        "title = \"x\"\nradius = 0.1\nframe = \"{frame}\"\n[lattice]\nkind = \"square\"\nspacing = 1.0\n\
         [body]\nshape = {{ kind = \"grid\", columns = 4, rows = 4 }}\n[neighbours]\nkind = \"chebyshev\"\nradius = 1\n\
         [[leaders]]\nregion = {{ kind = \"edge\", side = \"left\" }}\nprogram = {{ kind = \"external\" }}\n\
         [control]\nsweeps = 1\n[poses]\nage_limit = 2.0\n[flight]\nduration = 60.0\nstart = [\
         {{ robot = \"robot_16\", place = [3.1, 3.05] }}, {{ robot = \"robot_10\", place = [2.05, 0.95] }}]\n"
    );
    parsed(&text, set)
}

/// What is left of the error after a period of a flight, once the slowest part of it is left alone.
fn flown(swarm: &Swarm) -> f64 {
    let mut flight = Flight::new(swarm).expect("flies");
    let mut record = Record::new(swarm, &flight);
    for _ in 0..400 {
        let before = flight.fleet().places();
        flight.step();
        record.take(&flight, &before);
    }
    let errors: Vec<f64> = record.samples.iter().filter_map(|sample| sample.formation_error).collect();
    // Above rounding.
    let end = errors.iter().rposition(|error| *error > 1e-9).expect("disturbed");
    let begin = end / 2;
    (errors[end] / errors[begin]).powf(1.0 / (end - begin) as f64)
}

#[test]
fn errors_die_out_as_fast_as_the_plan_says_where_late_poses_meet_a_frame() {
    let [late, later] = ["flight.delay=1", "flight.delay=4"];
    let ahead = "rule.feedback={ factor = 0.4, reference = \"previous\" }";
    let cases: [(&str, &[&str]); 8] = [
        ("lagged", &[]),
        ("lagged", &[late]),
        ("lagged", &[later]),
        ("lagged", &[later, "control.sweeps=3"]),
        // Without the delay it grows.
        ("lagged", &[ahead, late]),
        ("none", &[late]),
        ("immediate", &[late]),
        ("mirror", &[late]),
    ];
    for (frame, set) in cases {
        let swarm = framed(frame, set);
        let plan = SwarmPlan::new(&swarm).expect("laid out");
        let (factor, flown) = (plan.delay.factor.expect("linear"), flown(&swarm));
        assert!(
            (factor.ln() / flown.ln() - 1.0).abs() < 0.02,
            "{frame} {set:?}: {factor}, in flight {flown}"
        );
        let half = plan.delay.half_life_s.expect("comes to rest");
        assert!((half / (plan.period_s * 0.5_f64.ln() / factor.ln()) - 1.0).abs() < 1e-9, "{plan}");
        assert_eq!(plan.cautions, [""; 0], "{frame} {set:?}");
    }
    let grown = SwarmPlan::new(&framed("lagged", &[ahead])).expect("laid out");
    assert_eq!(grown.delay.half_life_s, None, "{grown}");
    assert!(matches!(&grown.cautions[..], [one] if one.contains("do not die out")), "{grown}");
}

#[test]
fn a_half_life_that_would_take_long_to_compute_is_left_out_and_the_plan_says_so() {
    let plan = SwarmPlan::new(&framed("lagged", &["flight.delay=1000"])).expect("laid out");
    assert_eq!((plan.delay.half_life_s, plan.delay.factor), (None, None), "{plan}");
    assert!(plan.to_string().contains(" s not computed: it would take long"), "{plan}");
}
