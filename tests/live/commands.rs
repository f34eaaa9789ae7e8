//! The command that a session's page shows: as it was typed, with what was set since.

use serde_json::json;

use super::folders::temporary;
use super::pages::{Viewer, address, start};
use super::strangers::PATIENCE;
use super::waits::within;

#[test]
fn the_page_shows_the_command_with_what_was_set() {
    for (name, key, more) in
        [("tension", "title=it's", "update.damping"), ("square", "title=it's", "flight.loss")]
    {
        let folder = temporary();
        let _program = start(&["live", name, "--set", key], folder.path());
        let (host, token) = address(folder.path());
        let mut viewer = within(PATIENCE, "a viewer is let in", || Viewer::enter(&host, &token));
        let typed = format!("flockform live {name} --set 'title=it'\\''s'");
        viewer.status("the command", |status| status["command"] == typed);
        viewer.ask(&json!({ "do": "set", "key": more, "value": "0.5" }));
        let all = format!("{typed} --set {more}=0.5");
        viewer.status("the command with a key", |status| status["command"] == all);
        viewer.ask(&json!({ "do": "undo" }));
        viewer.status("the command without it", |status| status["command"] == typed);
    }
}
