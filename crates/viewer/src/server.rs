//! The web server: routes, its thread, its end.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use axum::extract::connect_info::Connected;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{ConnectInfo, Path, Request, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::serve::IncomingStream;
use cotouch_runtime::LiveSession;
use tokio::sync::{Semaphore, mpsc, oneshot};

use crate::browser::{self, Connection, LARGEST_MESSAGE_BYTES};
use crate::bundle::{self, Part};
use crate::changes::{self, Change};
use crate::connections::{self, LimitedListener};
use crate::hub::{Hub, Subject};
use crate::lesson::Lesson;
use crate::origin;
use crate::predicting::{Predicting, Queue};
use crate::predictor::Predictor;
use crate::replays::{LONGEST_REQUEST_S, ShownRecording, ShownRecordingError};
use crate::sender::PATIENCE;
use crate::settings::Base;

/// Browsers that look at one session at most.
const MAX_BROWSERS: usize = 32;

/// A connection on which nothing is written for so long is closed. On that of a page there is a picture or a ping sooner, or the
/// browser is taken to be gone.
const IDLE_FOR: Duration = PATIENCE.saturating_add(Duration::from_secs(2));

/// Who asks.
#[derive(Clone, Copy)]
struct Peer(SocketAddr);

impl Connected<IncomingStream<'_, LimitedListener>> for Peer {
    fn connect_info(stream: IncomingStream<'_, LimitedListener>) -> Self {
        Self(*stream.remote_addr())
    }
}

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
    /// A recording cannot be shown.
    #[error(transparent)]
    Replay(#[from] ShownRecordingError),
}

/// A running viewer; dropping it closes the page's address.
pub struct Viewer {
    address: SocketAddr,
    hub: Arc<Hub>,
    places: Arc<Semaphore>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
    // Dropped after the thread was joined: nobody asks it any more.
    _predicting: Predicting,
}

/// What a page shows.
pub enum Show {
    /// A running session; with a base, its settings can be changed and predicted.
    Live(Arc<LiveSession>, Option<Base>),
    /// Recordings, one or two.
    Replay(Vec<PathBuf>),
}

impl Viewer {
    /// Serves the page of a session on `address` (port 0: any free port) from a thread of its own. Recordings are read
    /// first.
    ///
    /// # Errors
    /// When the address is taken or the system refuses it (the session can go on without a viewer), or a recording cannot
    /// be shown.
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
        let hub = Arc::new(Hub::new(subject(show)?));
        let predicting = Predicting::start(Arc::clone(&hub), predictor).map_err(refused)?;
        let places = Arc::new(Semaphore::new(MAX_BROWSERS));
        let server = ServerState::new(Arc::clone(&hub), Arc::clone(&places), predicting.queue());
        let (stop, stopped) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(refused)?;
        let thread = std::thread::Builder::new()
            .name("viewer".to_owned())
            .spawn(move || runtime.block_on(serve(listener, server, stopped)))
            .map_err(refused)?;
        let (stop, thread) = (Some(stop), Some(thread));
        Ok(Self { address: bound, hub, places, stop, thread, _predicting: predicting })
    }

    /// Browsers that watch at this moment.
    #[must_use]
    pub fn watchers(&self) -> usize {
        MAX_BROWSERS - self.places.available_permits()
    }

    /// Shows a sentence on all pages. What is new of a session that can be changed is shown without; of any other, whoever
    /// takes its news passes it on.
    pub fn tell(&self, news: &str) {
        self.hub.tell(news);
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

fn subject(show: Show) -> Result<Subject, ShownRecordingError> {
    match show {
        Show::Live(live, base) => {
            let lesson = Box::new(Lesson::new(&live, base));
            Ok(Subject::Live(live, lesson))
        }
        Show::Replay(paths) => {
            let replays: Result<Vec<ShownRecording>, ShownRecordingError> =
                paths.iter().map(|path| ShownRecording::open(path)).collect();
            Ok(Subject::Replay(replays?))
        }
    }
}

/// What the answers to requests need.
#[derive(Clone)]
struct ServerState {
    hub: Arc<Hub>,
    places: Arc<Semaphore>,
    predictions: Arc<Queue>,
    changes: Option<mpsc::Sender<Change>>,
    next_number: Arc<AtomicU64>,
}

impl ServerState {
    fn new(hub: Arc<Hub>, places: Arc<Semaphore>, predictions: Arc<Queue>) -> Self {
        Self { hub, places, predictions, changes: None, next_number: Arc::new(AtomicU64::new(0)) }
    }
}

async fn serve(listener: TcpListener, mut server: ServerState, stopped: oneshot::Receiver<()>) {
    let (changes, asked) = mpsc::channel(changes::MAX_WAITING);
    server.changes = Some(changes);
    let hub = Arc::clone(&server.hub);
    let served = async {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let listener = LimitedListener::new(listener, connections::allowed(), IDLE_FOR);
        let service = routes(server).into_make_service_with_connect_info::<Peer>();
        axum::serve(listener, service).await
    };
    tokio::select! {
        _ = stopped => {}
        () = hub.watch() => {}
        () = changes::make(Arc::clone(&hub), asked) => {}
        result = served => if let Err(error) = result {
            tracing::warn!("the viewer ended: {error}");
        },
    }
}

fn routes(server: ServerState) -> Router {
    Router::new()
        .route("/", get(async |headers: HeaderMap| bundle::answer(Part::Page, &headers)))
        .route("/page.js", get(async |headers: HeaderMap| bundle::answer(Part::Script, &headers)))
        .route("/page.css", get(async |headers: HeaderMap| bundle::answer(Part::Style, &headers)))
        .route("/live", get(live))
        .route("/recordings/{index}/pictures", get(pictures))
        .with_state(server)
        .layer(middleware::from_fn(only_our_page))
        .route("/healthz", get(async || "ok\n"))
        .layer(middleware::from_fn(with_headers))
}

async fn live(
    State(server): State<ServerState>,
    ConnectInfo(Peer(peer)): ConnectInfo<Peer>,
    upgrade: WebSocketUpgrade,
) -> Response {
    let upgrade = upgrade.max_message_size(LARGEST_MESSAGE_BYTES).max_frame_size(LARGEST_MESSAGE_BYTES);
    let Ok(place) = Arc::clone(&server.places).try_acquire_owned() else {
        return upgrade.on_upgrade(|socket| browser::turn_away(socket, MAX_BROWSERS));
    };
    let Some(changes) = server.changes.clone() else {
        return StatusCode::SERVICE_UNAVAILABLE.into_response();
    };
    let connection = Connection {
        hub: server.hub,
        number: server.next_number.fetch_add(1, Ordering::Relaxed),
        is_here: peer.ip().to_canonical().is_loopback(),
        changes,
        predictions: server.predictions,
    };
    upgrade.on_upgrade(|socket| browser::serve(socket, connection, place))
}

async fn pictures(State(server): State<ServerState>, Path(index): Path<String>, uri: Uri) -> Response {
    let refuse = |status, why: String| (status, why + "\n").into_response();
    let Subject::Replay(replays) = &server.hub.subject else {
        return refuse(StatusCode::NOT_FOUND, "this is a running session, not a recording".to_owned());
    };
    let Some(replay) = index.parse().ok().and_then(|index: usize| replays.get(index)) else {
        let why =
            format!("there are {} recordings here, counted from 0; this is none of them", replays.len());
        return refuse(StatusCode::NOT_FOUND, why);
    };
    match span(uri.query().unwrap_or_default()) {
        Ok((from_s, to_s)) => {
            let kind = [(header::CONTENT_TYPE, "application/octet-stream")];
            (kind, replay.between(from_s, to_s).to_vec()).into_response()
        }
        Err(why) => refuse(StatusCode::BAD_REQUEST, why),
    }
}

/// `from_s` and `to_s` of a query.
fn span(query: &str) -> Result<(f64, f64), String> {
    let number = |name: &str| {
        let value = query.split('&').filter_map(|part| part.split_once('=')).find(|part| part.0 == name);
        let number: Option<f64> = value.and_then(|(_, value)| value.parse().ok());
        number
            .filter(|number| number.is_finite())
            .ok_or_else(|| format!("{name} must be a number of seconds"))
    };
    let (from_s, to_s) = (number("from_s")?, number("to_s")?);
    if from_s > to_s || to_s - from_s > LONGEST_REQUEST_S {
        return Err(format!("to_s must be from 0 to {LONGEST_REQUEST_S} s after from_s"));
    }
    Ok((from_s, to_s))
}

async fn only_our_page(request: Request, next: Next) -> Response {
    match origin::check(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => (StatusCode::FORBIDDEN, refusal.in_words()).into_response(),
    }
}

async fn with_headers(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    response.headers_mut().extend(origin::HEADERS);
    response
}
