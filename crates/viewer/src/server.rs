//! The web server: routes, its thread, its end.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;

use axum::Router;
use axum::extract::{Request, State, WebSocketUpgrade};
use axum::http::{StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use cotouch_runtime::snapshot::SnapshotSource;
use tokio::sync::{Semaphore, oneshot};

use crate::about::About;
use crate::{live, manners};

/// Pages that may watch at a time.
const MOST_BROWSERS: usize = 32;

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

/// What requests share.
pub(crate) struct Session {
    pub(crate) about: About,
    pub(crate) source: Box<dyn SnapshotSource>,
    places: Arc<Semaphore>,
}

impl Viewer {
    /// Serves the page of a session on `address` (port 0: any free port) from a thread of its own.
    ///
    /// # Errors
    /// When the address is taken or the system refuses it. The session can go on without a viewer.
    pub fn start(
        address: SocketAddr,
        about: About,
        source: impl SnapshotSource + 'static,
    ) -> Result<Self, ViewerError> {
        let refused = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => ViewerError::Taken { address },
            _ => ViewerError::System { address, source },
        };
        let listener = TcpListener::bind(address).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        let bound = listener.local_addr().map_err(refused)?;
        let places = Arc::new(Semaphore::new(MOST_BROWSERS));
        let routes = routes(Session { about, source: Box::new(source), places });
        let (stop, stopped) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(refused)?;
        let thread = std::thread::Builder::new()
            .name("viewer".to_owned())
            .spawn(move || runtime.block_on(serve(listener, routes, stopped)))
            .map_err(refused)?;
        Ok(Self { address: bound, stop: Some(stop), thread: Some(thread) })
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

fn routes(session: Session) -> Router {
    Router::new()
        .route("/", get(|| page("text/html; charset=utf-8", include_str!("../page/index.html"))))
        .route("/page.css", get(|| page("text/css; charset=utf-8", include_str!("../page/page.css"))))
        .route("/page.js", get(|| page("text/javascript; charset=utf-8", include_str!("../page/page.js"))))
        .route("/live", get(watch))
        .layer(middleware::from_fn(only_our_page))
        .route("/healthz", get(|| async { "ok\n" }))
        .layer(middleware::from_fn(with_headers))
        .with_state(Arc::new(session))
}

async fn page(kind: &'static str, text: &'static str) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, kind)], text)
}

async fn watch(State(session): State<Arc<Session>>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(place) = Arc::clone(&session.places).try_acquire_owned() else {
        let words = format!("{MOST_BROWSERS} pages watch this session already\n");
        return (StatusCode::SERVICE_UNAVAILABLE, words).into_response();
    };
    upgrade
        .max_message_size(live::LARGEST_MESSAGE_BYTES)
        .max_frame_size(live::LARGEST_MESSAGE_BYTES)
        // Nothing piles up for a slow browser beyond one picture and what the system buffers.
        .write_buffer_size(0)
        .on_upgrade(move |socket| live::serve(socket, session, place))
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
