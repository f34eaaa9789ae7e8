//! A session served in this process, for the tests of viewers.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use flockform::live::body::Body;
use flockform::live::server::Server;
use flockform::live::session::Session;
use flockform::live::swarm::Swarm;
use flockform::scene::bundled::{bundled, bundled_swarm};

/// A server that ends with the value.
pub struct Served {
    pub address: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    pub fn scene(name: &str, set: &[String], folder: &Path) -> Self {
        let scene = bundled(name).expect("bundled").load(set).unwrap_or_else(|error| panic!("{error}"));
        let body = Body::new(scene, None).unwrap_or_else(|error| panic!("{error}"));
        Self::session(Box::new(body), folder)
    }

    pub fn swarm(name: &str, set: &[String], folder: &Path) -> Self {
        let swarm = bundled_swarm(name).expect("bundled").load_swarm(set);
        let swarm = swarm.unwrap_or_else(|error| panic!("{error}"));
        let swarm = Swarm::new(swarm, None).unwrap_or_else(|error| panic!("{error}"));
        Self::session(Box::new(swarm), folder)
    }

    fn session(session: Box<dyn Session>, folder: &Path) -> Self {
        let server = Server::open(None).expect("a free port");
        let (address, folder) = (server.address(), folder.to_owned());
        let command = format!("flockform live {}", session.title().0);
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let serve = move || drop(server.serve(session, command, folder, &stopped).expect("serves"));
        Self { address, stop, thread: Some(std::thread::spawn(serve)) }
    }

    /// Host with port, and token.
    pub fn parts(&self) -> (String, String) {
        parts(&self.address)
    }
}

/// Host with port, and token, of the address of a page.
pub fn parts(address: &str) -> (String, String) {
    let rest = address.strip_prefix("http://").expect("an address");
    let (host, token) = rest.split_once("/?token=").expect("with a token");
    (host.to_owned(), token.to_owned())
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
