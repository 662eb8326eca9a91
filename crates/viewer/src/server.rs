//! The web server: routes, its thread, its end.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;

use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use cotouch_runtime::live::LiveSession;
use cotouch_scene::Override;
use tokio::sync::oneshot;

use crate::bundle::{self, Part};
use crate::manners;
use crate::predictor::Predictor;

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// Something else uses the address.
    #[error("no viewer: {address} is taken; name a free one with --serve ADDR, or none with --headless")]
    Taken {
        /// The address that was asked for.
        address: SocketAddr,
    },
    /// The system refused the address or a thread.
    #[error("no viewer on {address}: {source}")]
    System {
        /// The address that was asked for.
        address: SocketAddr,
        /// What the system said.
        source: io::Error,
    },
}

/// A running viewer; dropping it closes the page's address.
pub struct Viewer {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Where the scene of a session comes from, so that it can be had with other settings.
#[derive(Clone, Debug)]
pub struct Base {
    /// A built-in scene or a file.
    pub scene: String,
    /// What `--set` said.
    pub overrides: Vec<Override>,
}

/// What a page shows.
pub enum Show {
    /// A running session; with a base, its settings can be changed and predicted.
    Live(Arc<LiveSession>, Option<Base>),
    /// Recordings, one or two.
    Replay(Vec<PathBuf>),
}

impl Viewer {
    /// Serves the page of a session on `address` (port 0: any free port) from a thread of its own.
    ///
    /// # Errors
    /// When the address is taken or the system refuses it. The session can go on without a viewer.
    pub fn start(
        address: SocketAddr,
        show: Show,
        predictor: Arc<dyn Predictor>,
    ) -> Result<Self, ViewerError> {
        let refused = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => ViewerError::Taken { address },
            _ => ViewerError::System { address, source },
        };
        let listener = TcpListener::bind(address).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        let bound = listener.local_addr().map_err(refused)?;
        let _ = (show, predictor);
        let routes = routes();
        let (stop, stopped) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(refused)?;
        let thread = std::thread::Builder::new()
            .name("viewer".to_owned())
            .spawn(move || runtime.block_on(serve(listener, routes, stopped)))
            .map_err(refused)?;
        Ok(Self { address: bound, stop: Some(stop), thread: Some(thread) })
    }

    /// Browsers that watch at this moment.
    #[must_use]
    pub fn watchers(&self) -> usize {
        0
    }

    /// Where the page is.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // Both are there until now; the thread's own panic was already printed.
        let _ = self.stop.take().map(|stop| stop.send(()));
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

async fn serve(listener: TcpListener, routes: Router, stopped: oneshot::Receiver<()>) {
    let served = async {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        axum::serve(listener, routes).await
    };
    tokio::select! {
        _ = stopped => {}
        result = served => if let Err(error) = result {
            tracing::warn!("the viewer ended: {error}");
        },
    }
}

fn routes() -> Router {
    Router::new()
        .route("/", get(async |headers: HeaderMap| bundle::answer(Part::Page, &headers)))
        .route("/page.js", get(async |headers: HeaderMap| bundle::answer(Part::Script, &headers)))
        .route("/page.css", get(async |headers: HeaderMap| bundle::answer(Part::Style, &headers)))
        .layer(middleware::from_fn(only_our_page))
        .route("/healthz", get(|| async { "ok\n" }))
        .layer(middleware::from_fn(with_headers))
}

async fn only_our_page(request: Request, next: Next) -> Response {
    match manners::check(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => (StatusCode::FORBIDDEN, refusal.in_words()).into_response(),
    }
}

async fn with_headers(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    response.headers_mut().extend(manners::HEADERS);
    response
}
