//! Within a process. There are no types and no processes to be killed.

use flockform::swarm::transport::in_process::{Controller, Robots, join};
use flockform::swarm::transport::{ControllerEnd, RobotsEnd};

use super::promises::kept;
use super::support::*;

struct InProcess {
    count: usize,
    robots: Robots,
}

impl InProcess {
    fn new(count: usize) -> Self {
        Self { count, robots: join(count).1 }
    }
}

impl Transport for InProcess {
    type Controller = Controller;
    type Robots = Robots;

    fn count(&self) -> usize {
        self.count
    }

    fn controller(&mut self) -> Controller {
        self.robots.controller()
    }

    fn robots(&mut self) -> Robots {
        self.robots.clone()
    }
}

kept!(InProcess::new(3), InProcess::new(3), (InProcess::new(1000), (0..1000).collect()));

#[test]
fn in_process_a_pose_of_nobody_is_left_out_and_counted() {
    let (mut controller, mut robots) = join(3);
    robots.send(1.0, &[(3, pose(0.0, 1.0)), (2, pose(5.0, 1.0))]).expect("said");
    assert_eq!(heard(&mut controller), [(2, pose(5.0, 1.0))]);
    assert_eq!(controller.refused(), 1);
}
