//! The viewer from outside: what a browser, a stranger and a careless client get.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use cotouch_runtime::snapshot::{FingerSnapshot, HostSnapshot, Snapshot};
use cotouch_scene::geometry::{Pose, Reading, Wrench};
use cotouch_viewer::{About, Viewer, ViewerError};
use cotouch_world::contact::Phase;
use futures_util::{SinkExt as _, StreamExt as _};
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;
use tokio_tungstenite::tungstenite::{Error, Message};

fn start() -> Viewer {
    let scene = cotouch_scene::load("single-axis", &[]).expect("a built-in scene");
    let about = About::new(&scene, || json!({ "stable": true, "spectral_radius": 0.75 }));
    let asked = Arc::new(AtomicU64::new(0));
    let source = move || Snapshot {
        time_s: asked.fetch_add(1, Ordering::Relaxed) as f64,
        hosts: vec![host()],
        ..Snapshot::default()
    };
    Viewer::start("127.0.0.1:0".parse().unwrap(), about, source).expect("a free port")
}

fn host() -> HostSnapshot {
    let finger =
        |contact| FingerSnapshot { reading: Reading::default(), commanded: Wrench::default(), contact };
    HostSnapshot {
        fingers: [finger(Phase::Free), finger(Phase::PreSlide)].into_iter().collect(),
        bodies: [Pose::default()].into_iter().collect(),
        ..HostSnapshot::default()
    }
}

fn ask(address: SocketAddr, path: &str, host: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

#[test]
fn pages_are_served_with_their_policy() {
    let viewer = start();
    let host = viewer.address().to_string();
    for (path, kind) in [("/", "text/html"), ("/page.css", "text/css"), ("/page.js", "text/javascript")] {
        let answer = ask(viewer.address(), path, &host);
        assert!(answer.starts_with("HTTP/1.1 200"), "{path}: {answer}");
        assert!(answer.contains(&format!("content-type: {kind}")), "{path}: {answer}");
        assert!(answer.contains("content-security-policy: default-src 'none'"), "{path}: {answer}");
        assert!(!answer.contains("https://"), "{path} must not name another host");
    }
    assert!(ask(viewer.address(), "/healthz", "anything").starts_with("HTTP/1.1 200"));
    assert!(ask(viewer.address(), "/nothing", &host).starts_with("HTTP/1.1 404"));
}

#[test]
fn a_name_that_could_be_anybodys_is_refused() {
    let viewer = start();
    let answer = ask(viewer.address(), "/", "rebound.example");
    assert!(answer.starts_with("HTTP/1.1 403"), "{answer}");
}

#[test]
fn a_taken_address_is_said_in_one_sentence() {
    let viewer = start();
    let scene = cotouch_scene::load("single-axis", &[]).expect("a built-in scene");
    let again = Viewer::start(viewer.address(), About::new(&scene, || Value::Null), Snapshot::default);
    let error = again.err().expect("the address is taken");
    assert!(matches!(error, ViewerError::Taken { .. }), "{error}");
    assert!(error.to_string().contains("is taken"), "{error}");
}

#[test]
fn an_ended_viewer_gives_its_address_back() {
    let address = start().address();
    assert!(TcpStream::connect(address).is_err());
}

#[tokio::test]
async fn a_browser_first_hears_what_the_session_is_then_newer_and_newer_snapshots() {
    let viewer = start();
    let (mut socket, _) = tokio_tungstenite::connect_async(live(&viewer)).await.unwrap();
    let mut next = async || match socket.next().await {
        Some(Ok(Message::Text(text))) => serde_json::from_str::<Value>(&text).unwrap(),
        other => panic!("expected a text, found {other:?}"),
    };
    let about = next().await;
    assert_eq!(about["about"]["scene"], "single-axis");
    assert_eq!(about["predicted"]["spectral_radius"], 0.75);
    let (first, second) = (next().await, next().await);
    assert!(second["time_s"].as_f64() > first["time_s"].as_f64());
    let host = &first["hosts"][0];
    assert_eq!(host["fingers"][0]["reading"]["pose"]["position"], json!([0.0, 0.0, 0.0]));
    assert_eq!(host["fingers"][1]["contact"], "pre-slide");
    assert_eq!(host["bodies"][0]["orientation"], json!([0.0, 0.0, 0.0, 1.0]));
    assert_eq!(about["about"]["bodies"][0]["kind"], "point");
    assert_eq!(first["stable"], Value::Null);
}

#[tokio::test]
async fn a_page_of_another_origin_is_refused() {
    let viewer = start();
    let mut request = live(&viewer).into_client_request().unwrap();
    request.headers_mut().insert("Origin", "http://evil.example".parse().unwrap());
    let refused = tokio_tungstenite::connect_async(request).await;
    assert!(matches!(&refused, Err(Error::Http(answer)) if answer.status() == 403), "{refused:?}");
}

#[tokio::test]
async fn a_message_that_is_too_long_ends_the_connection() {
    let viewer = start();
    let (mut socket, _) = tokio_tungstenite::connect_async(live(&viewer)).await.unwrap();
    socket.send(Message::text("x".repeat(5000))).await.unwrap();
    let ends = async {
        while let Some(Ok(message)) = socket.next().await {
            if message.is_close() {
                break;
            }
        }
    };
    ends.await;
    // The session goes on for others.
    assert!(tokio_tungstenite::connect_async(live(&viewer)).await.is_ok());
}

fn live(viewer: &Viewer) -> String {
    format!("ws://{}/live", viewer.address())
}
