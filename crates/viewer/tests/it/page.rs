//! What tests need to be a browser: a session with its viewer, a page that talks to it, a predictor that is made up.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use cotouch_runtime::{LiveSession, RealTimeOptions};
use cotouch_viewer::{Answer, Base, Predictor, Question, Show, Viewer};
use futures_util::{SinkExt as _, StreamExt as _};
use serde_json::{Value, json};
use tokio::net::TcpStream as Stream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream};

/// Longer than anything takes on a machine that is busy with other tests.
const PATIENCE: Duration = Duration::from_secs(20);

/// A session and its viewer.
pub(crate) struct Stage {
    pub(crate) viewer: Viewer,
    pub(crate) live: Arc<LiveSession>,
}

/// A session whose predictions are made up by [`Fake`].
pub(crate) fn with_fake(scene: &str) -> Stage {
    start(scene, Some(Base { scene: scene.to_owned(), overrides: Vec::new() }), Arc::new(Fake))
}

/// A session of which nobody knows where its scene is from.
pub(crate) fn without_lesson(scene: &str) -> Stage {
    start(scene, None, Arc::new(Silent))
}

pub(crate) fn start(scene: &str, base: Option<Base>, predictor: Arc<dyn Predictor>) -> Stage {
    let scene = cotouch_scene::load(scene, &[]).expect("a built-in scene");
    let live = LiveSession::run_local(&scene, RealTimeOptions::default()).expect("sockets on loopback");
    let live = Arc::new(live);
    let show = Show::Live(Arc::clone(&live), base);
    let viewer = Viewer::start(any_port(), show, predictor).expect("a free port");
    Stage { viewer, live }
}

pub(crate) fn any_port() -> SocketAddr {
    "127.0.0.1:0".parse().unwrap()
}

impl Stage {
    pub(crate) fn address(&self) -> SocketAddr {
        self.viewer.address()
    }

    pub(crate) fn live_url(&self) -> String {
        format!("ws://{}/live", self.address())
    }

    pub(crate) async fn until(&self, holds: impl Fn(&Self) -> bool) {
        let wait = async {
            while !holds(self) {
                // Neither session nor viewer tells of it.
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        };
        timeout(PATIENCE, wait).await.expect("it comes to pass");
    }
}

/// A whole answer, as text.
pub(crate) fn ask(address: SocketAddr, path: &str, host: &str, headers: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\n{headers}Connection: close\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

/// The body of an answer.
pub(crate) fn body(address: SocketAddr, path: &str) -> Vec<u8> {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("an end of the headers");
    answer.split_off(end + 4)
}

/// A browser.
pub(crate) struct Page {
    socket: WebSocketStream<MaybeTlsStream<Stream>>,
}

/// What tests look at in a picture.
#[derive(Debug)]
pub(crate) struct Seen {
    pub(crate) ended: bool,
    pub(crate) generation: u32,
    pub(crate) hosts: u8,
    pub(crate) time_s: f64,
    /// Where a pointer draws the first host's first finger along x; not a number when none does.
    pub(crate) target_x_m: f32,
    /// How many soft surfaces there are.
    pub(crate) surfaces: u8,
    pub(crate) bytes: Vec<u8>,
}

impl Seen {
    pub(crate) fn of(bytes: &[u8]) -> Self {
        assert_eq!(bytes[0], 1, "a picture");
        Self {
            ended: bytes[1] & 1 == 1,
            hosts: bytes[2],
            generation: u32::from_le_bytes(bytes[4..8].try_into().unwrap()),
            time_s: f64::from_le_bytes(bytes[8..16].try_into().unwrap()),
            surfaces: bytes[3],
            bytes: bytes.to_vec(),
            target_x_m: bytes.get(80..84).map_or(f32::NAN, |x| f32::from_le_bytes(x.try_into().unwrap())),
        }
    }
}

impl Page {
    pub(crate) async fn open(stage: &Stage) -> Self {
        Self::at(&stage.live_url()).await
    }

    pub(crate) async fn at(url: &str) -> Self {
        let (socket, _) = tokio_tungstenite::connect_async(url).await.expect("a socket");
        Self { socket }
    }

    pub(crate) async fn say(&mut self, message: Value) {
        self.send(Message::text(message.to_string())).await;
    }

    /// A server that has closed the connection hears nothing: that is for the caller to see.
    pub(crate) async fn send(&mut self, message: Message) {
        let _ = self.socket.send(message).await;
    }

    async fn next(&mut self) -> Message {
        let next = timeout(PATIENCE, self.socket.next()).await.expect("something is said in time");
        next.expect("the connection is open").expect("the connection is whole")
    }

    /// The next message that is no picture.
    pub(crate) async fn next_message(&mut self) -> Value {
        loop {
            if let Message::Text(text) = self.next().await {
                return serde_json::from_str(&text).expect("JSON");
            }
        }
    }

    /// The next message of that type.
    pub(crate) async fn wait_for(&mut self, kind: &str) -> Value {
        self.wait_until(|message| message["type"] == kind).await
    }

    pub(crate) async fn wait_until(&mut self, is_it: impl Fn(&Value) -> bool) -> Value {
        let search = async {
            loop {
                let message = self.next_message().await;
                if is_it(&message) {
                    return message;
                }
            }
        };
        timeout(PATIENCE, search).await.expect("the message comes in time")
    }

    pub(crate) async fn picture(&mut self) -> Seen {
        loop {
            if let Message::Binary(bytes) = self.next().await {
                return Seen::of(&bytes);
            }
        }
    }

    pub(crate) async fn picture_with(&mut self, is_it: impl Fn(&Seen) -> bool) -> Seen {
        let search = async {
            loop {
                let seen = self.picture().await;
                if is_it(&seen) {
                    return seen;
                }
            }
        };
        timeout(PATIENCE, search).await.expect("the picture comes in time")
    }

    pub(crate) async fn pictures_within(&mut self, time: Duration) -> usize {
        let mut count = 0;
        let _ = timeout(time, async {
            loop {
                self.picture().await;
                count += 1;
            }
        })
        .await;
        count
    }

    /// Why the server closes the connection.
    pub(crate) async fn until_closed(&mut self) -> (u16, String) {
        loop {
            if let Message::Close(frame) = self.next().await {
                let frame = frame.expect("a reason");
                return (frame.code.into(), frame.reason.to_string());
            }
        }
    }
}

/// Says nothing.
pub(crate) struct Silent;

impl Predictor for Silent {
    fn predict(&self, _: &Question, _: &(dyn Fn() -> bool + Sync), _: &mut dyn FnMut(Answer)) {}
}

/// Answers with what it was asked; the margin at a delay of 6 takes half a second, a delay of 7 takes until nobody wants the answer any more, one of 8 is a mistake.
pub(crate) struct Fake;

impl Predictor for Fake {
    fn predict(&self, question: &Question, wanted: &(dyn Fn() -> bool + Sync), tell: &mut dyn FnMut(Answer)) {
        let scene = &question.scene;
        match scene.link.delay_periods {
            7 => {
                // Whoever asks tells the predictor nothing: it looks now and then.
                while wanted() {
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
            8 => panic!("a predictor with a mistake in it"),
            _ => {}
        }
        tell(Answer::Verdict(json!({
            "stable": scene.coupling.object_object.stiffness_n_per_m < 1000.0,
            "spectral_radius": scene.coupling.object_object.stiffness_n_per_m / 1000.0,
            "warnings": [],
        })));
        if question.map.is_some() {
            tell(Answer::Map(json!({ "stable": [] })));
        }
        if question.margin {
            for _ in 0..50 {
                if !wanted() {
                    return;
                }
                // Half a second of work in all, so that a newer question comes in between.
                if scene.link.delay_periods == 6 {
                    std::thread::sleep(Duration::from_millis(10));
                }
            }
            tell(Answer::Failed("margin", "there is none".to_owned()));
        }
    }
}
