//! A peer that lies about one robot's place and dates its lies as it likes, beside the poses of the robot itself.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use flockform::messages::builtin_interfaces::Time;
use flockform::messages::geometry_msgs::{Pose, PoseStamped};
use flockform::messages::std_msgs::Header;
use flockform::ros::edge::Quality;

use super::middleware::{LONG, Scene};
use super::support::*;

/// `robot_13`, in the middle.
const MIDDLE: usize = 12;

#[test]
#[ignore = "takes half a minute"]
fn false_places_with_forged_stamps_are_believed_and_bring_no_two_other_robots_near_each_other() {
    // Each lie is believed at once, at any speed.
    let overrides = [LONG[0], "poses.recover=1", "poses.jump_speed=1e6"];
    let mut scene = Scene::open(&overrides);
    let liar = scene.edge.node("/", "liar").expect("a node");
    let pose = liar.publisher::<PoseStamped>("/robot_13/pose", Quality::BEST_EFFORT).expect("says");
    let target =
        liar.subscription::<PoseStamped>("/robot_13/target_pose", Quality::reliable(1)).expect("hears");
    until("the node listens", || (pose.matched() > 0).then_some(()));
    scene.judge.liar = Some(MIDDLE);
    // On top of neighbours, between them, round about, and far away; late, ahead, and both in turn.
    let lies = [[1.5, 0.0], [0.0, 1.5], [0.75, 0.75], [-1.5, -1.5], [-40.0, 3.0], [0.0, 0.0]];
    let stamps = [0.0, -0.45, 0.09, -0.2, 0.05];
    let (begun, mut count, mut lured) = (Instant::now(), 0, 0);
    let Scene { judge, .. } = &mut scene;
    judge.during(Duration::from_secs(20), || {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64();
        // About where the middle is: the formation goes 0.2 m/s.
        let middle = [3.0 + 0.2 * begun.elapsed().as_secs_f64(), 3.0];
        let (by, ahead) = (lies[count % lies.len()], stamps[count / 7 % stamps.len()]);
        count += 1;
        let header = Header { stamp: Time::from_seconds(now + ahead), frame_id: "map".into() };
        let message = PoseStamped { header, pose: Pose::planar([middle[0] + by[0], middle[1] + by[1]], 0.0) };
        // One that a full queue refuses is followed by others.
        let _ = pose.publish(&message);
        while let Some((target, _)) = target.take() {
            let to = target.pose.position;
            lured += u32::from((to.x - middle[0]).hypot(to.y - middle[1]) > 1.0);
        }
    });
    println!("{count} lies, {lured} targets for the robot itself by them");
    assert!(lured > 10, "no lie was believed");
    let back = scene.judge.until_all_are_sent();
    assert!(back < 5.0, "{back} s");
    assert_eq!([scene.node.terminate(), scene.robots.terminate()], [Some(0), Some(0)]);
}
