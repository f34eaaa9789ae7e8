//! What programs ask of robots, and where they bring them.

use super::*;

#[test]
fn a_smooth_path_is_held_against_its_own_peaks() {
    let path = |kind: &str, limits: &str| {
        let text = format!(
            "title = \"one\"\nlinks = {{ kind = \"nearest\", count = 1 }}\nrobots = [{{ name = \"a\", place = [0.0, 0.0] }}]\n\
             leaders = [{{ robots = [\"a\"], program = {{ kind = \"path\", interpolation = \"{kind}\", \
             points = [{{ at = 10.0, displacement = [20.0, 0.0] }}] }} }}]\nlimits = {{ {limits} }}\n"
        );
        planned(&text, &[]).cautions
    };
    // 1.5 of the mean speed in the middle, and 6 over the square of the time at the ends.
    let fast = path("smooth", "speed = 2.999");
    let words =
        "the program of leaders[0] moves a robot at up to 3.000 m/s, above limits.speed: it will fall behind";
    assert!(matches!(&fast[..], [one] if one.contains(words)), "{fast:?}");
    let hard = path("smooth", "speed = 3.0, acceleration = 1.1");
    let words = "accelerates a robot at up to 1.200 m/s^2, above limits.acceleration: it will fall behind";
    assert!(matches!(&hard[..], [one] if one.contains(words)), "{hard:?}");
    assert_eq!(path("smooth", "speed = 3.0, acceleration = 1.2"), [""; 0]);
    assert_eq!(path("linear", "speed = 2.0, acceleration = 0.1"), [""; 0]);
}

#[test]
fn followers_that_come_to_rest_beside_their_places_are_looked_at_for_space_as_well() {
    // The follower keeps 2 m to the left of the middle of the leaders, one of which comes near.
    let plan = |stretch: f64| {
        let text = format!(
            "title = \"three\"\nradius = 0.1\nlinks = {{ kind = \"nearest\", count = 2 }}\nrule = {{ rest = \"balanced\" }}\n\
             robots = [{{ name = \"a\", place = [0.0, 0.0] }}, {{ name = \"b\", place = [1.0, 0.0] }}, \
             {{ name = \"c\", place = [6.0, 0.0] }}]\n\
             leaders = [{{ robots = [\"a\", \"c\"], program = {{ kind = \"manoeuvre\", name = \"m\" }} }}]\n\
             manoeuvres = [{{ name = \"m\", about = [3.0, 0.0], legs = [{{ seconds = 60.0, stretch = [{stretch:?}, 1.0] }}] }}]\n\
             limits = {{ speed = 1.0, clearance = 0.2 }}\n"
        );
        planned(&text, &[]).cautions
    };
    let found = plan(0.75);
    let words = "manoeuvre `m` leaves 0.050 m between `a` and `b` where they come to rest, less than limits.clearance";
    assert!(matches!(&found[..], [one] if one.contains(words)), "{found:?}");
    assert_eq!(plan(0.81), [""; 0]);
    // Through it, between two looks.
    let found = plan(0.4);
    assert!(
        matches!(&found[..], [one] if one.contains("leaves -0.200 m between `a` and `b` where")),
        "{found:?}"
    );
}

#[test]
fn a_bound_on_the_affine_error_asks_for_a_manoeuvre_of_all_leaders() {
    let text = "title = \"two\"\nlinks = { kind = \"nearest\", count = 1 }\nrobots = [{ name = \"a\", place = [0.0, 0.0] }, \
                { name = \"b\", place = [2.0, 0.0] }]\nleaders = [{ robots = [\"a\"], program = { kind = \"path\", \
                points = [{ at = 9.0, displacement = [1.0, 0.0] }] } }]\nflight = { bounds = { affine_error = 0.1 } }\n";
    let swarm = parsed(text, &[]);
    let refused = SwarmPlan::new(&swarm).expect_err("not measured").to_string();
    assert!(
        refused.contains("the leaders do not all fly one manoeuvre, so no robot has a place"),
        "{refused}"
    );
}
