//! The viewer from outside: what a browser, a stranger and a careless client get.

use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use crate::page::{Page, Silent, Stage, ask, with_fake, without_lesson};
use cotouch_viewer::{Show, Viewer, ViewerError};
use serde_json::json;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;
use tokio_tungstenite::tungstenite::{Error, Message};

#[test]
fn pages_are_served_with_their_policy() {
    let stage = with_fake("single-axis");
    let host = stage.address().to_string();
    let page = ask(stage.address(), "/", &host, "");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("content-type: text/html"), "{page}");
    assert!(page.contains("content-security-policy: default-src 'none'"), "{page}");
    assert!(!page.contains("https://"), "a page must not name another host: {page}");
    assert!(ask(stage.address(), "/healthz", "anything", "").starts_with("HTTP/1.1 200"));
    assert!(ask(stage.address(), "/nothing", &host, "").starts_with("HTTP/1.1 404"));
    if page.contains("built without its page") {
        return;
    }
    for (path, kind) in [("/page.css", "text/css"), ("/page.js", "text/javascript")] {
        let plain = ask(stage.address(), path, &host, "");
        assert!(
            plain.starts_with("HTTP/1.1 200") && plain.contains(&format!("content-type: {kind}")),
            "{path}"
        );
        assert!(!plain.contains("content-encoding"), "{path}");
        let zipped = ask(stage.address(), path, &host, "Accept-Encoding: gzip, br\r\n");
        assert!(zipped.contains("content-encoding: gzip"), "{path}");
        assert!(path == "/page.css" || zipped.len() < plain.len(), "{path}");
    }
}

#[test]
fn a_name_that_could_be_anybodys_is_refused() {
    let stage = with_fake("single-axis");
    for path in ["/", "/page.js", "/live", "/recordings/0/pictures"] {
        let answer = ask(stage.address(), path, "rebound.example", "");
        assert!(answer.starts_with("HTTP/1.1 403"), "{path}: {answer}");
    }
}

#[test]
fn a_taken_address_is_said_in_one_sentence() {
    let stage = with_fake("single-axis");
    let show = Show::Live(Arc::clone(&stage.live), None);
    let error = Viewer::start(stage.address(), show, Arc::new(Silent)).err().expect("the address is taken");
    assert!(matches!(error, ViewerError::Taken { .. }), "{error}");
    assert!(error.to_string().contains("is taken"), "{error}");
}

#[test]
fn an_ended_viewer_gives_its_address_and_its_session_back() {
    let Stage { live, viewer } = with_fake("single-axis");
    let address = viewer.address();
    drop(viewer);
    assert!(TcpStream::connect(address).is_err());
    let live = Arc::into_inner(live).expect("nobody else holds the session");
    live.stop();
    assert_eq!(live.finish().failures, [""; 0]);
}

#[tokio::test]
async fn a_browser_hears_what_the_session_is_and_then_newer_and_newer_pictures() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    let session = page.next_message().await;
    assert_eq!(session["type"], "session");
    assert_eq!(session["generation"], 1);
    assert_eq!(session["mode"], "live");
    assert_eq!(session["about"]["scene"], "single-axis");
    assert_eq!(session["about"]["bodies"][0]["kind"], "point");
    assert_eq!(session["may_change"], true);
    assert!(session["controls"].as_array().is_some_and(|controls| controls.len() > 10), "{session}");
    let settings = page.next_message().await;
    assert_eq!(settings["type"], "settings");
    assert_eq!(settings["settings"]["session.architecture"], "distributed");
    let seats = page.next_message().await;
    assert_eq!(seats["seats"][0], json!({ "user": 0, "name": "anna", "by": "script" }));
    let (first, second) = (page.picture().await, page.picture().await);
    assert!(second.time_s > first.time_s);
    assert_eq!((first.generation, first.hosts), (1, 2));
    assert_eq!(stage.viewer.watchers(), 1);
    drop(page);
    stage.until(|stage| stage.viewer.watchers() == 0).await;
}

#[tokio::test]
async fn pictures_come_at_display_rate() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    for (asked, most) in [(60.0, 66), (32.0, 36), (1e9, 66)] {
        page.say(json!({ "type": "rate", "hz": asked })).await;
        page.pictures_within(Duration::from_millis(200)).await;
        let count = page.pictures_within(Duration::from_secs(1)).await;
        assert!((8..=most).contains(&count), "{count} pictures a second where {asked} were asked for");
    }
}

#[tokio::test]
async fn what_cannot_be_set_has_no_controls() {
    let stage = without_lesson("single-axis");
    let mut page = Page::open(&stage).await;
    let session = page.wait_for("session").await;
    assert_eq!(session["controls"], json!([]));
    page.say(json!({ "type": "set", "settings": { "link.delay_periods": 2 } })).await;
    assert_eq!(page.wait_for("refused").await["what"], "set");
    page.say(
        json!({ "type": "predict", "id": 1, "settings": {}, "whole": false, "margin": false, "map": null }),
    )
    .await;
    assert_eq!(page.wait_for("refused").await["what"], "predict");
}

#[tokio::test]
async fn a_page_of_another_origin_is_refused() {
    let stage = with_fake("single-axis");
    let mut request = stage.live_url().into_client_request().unwrap();
    request.headers_mut().insert("Origin", "http://evil.example".parse().unwrap());
    let refused = tokio_tungstenite::connect_async(request).await;
    assert!(matches!(&refused, Err(Error::Http(answer)) if answer.status() == 403), "{refused:?}");
}

#[tokio::test]
async fn a_message_that_is_too_long_ends_the_connection_and_nothing_else() {
    let stage = with_fake("single-axis");
    let mut other = Page::open(&stage).await;
    let mut page = Page::open(&stage).await;
    page.send(Message::text("x".repeat(5000))).await;
    let (code, reason) = page.until_closed().await;
    assert_eq!(code, 1009);
    assert!(reason.contains("4096 bytes"), "{reason}");
    other.picture().await;
    assert!(!stage.live.has_ended());
}

#[tokio::test]
async fn bad_messages_are_refused_in_words_and_in_the_end_the_connection_is_closed() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    let bad = [
        "",
        "{",
        "[]",
        "null",
        "\"take\"",
        "{\"type\":\"fly\"}",
        "{\"type\":\"take\"}",
        "{\"type\":\"take\",\"user\":-1}",
        "{\"type\":\"point\",\"targets_m\":[[1e999,0,0]]}",
        "{\"type\":\"point\",\"targets_m\":[[0,0,0],[0,0,0],[0,0,0],[0,0,0],[0,0,0]]}",
        "{\"type\":\"rate\",\"hz\":\"fast\"}",
        "{\"type\":\"set\",\"settings\":{\"a\":[]}}",
        "{\"type\":\"leave\",\"and\":1}",
        "{\"type\":\"predict\",\"id\":1}",
    ];
    for text in bad {
        page.send(Message::text(text)).await;
        let refused = page.wait_for("refused").await;
        assert_eq!(refused["what"], "message", "{text}");
        assert!(refused["why"].as_str().is_some_and(|why| why.len() > 20), "{text}: {refused}");
    }
    page.say(json!({ "type": "rate", "hz": 40 })).await;
    page.picture().await;
    for _ in bad.len()..20 {
        page.send(Message::binary(vec![0, 159, 146, 150])).await;
    }
    let (code, reason) = page.until_closed().await;
    assert_eq!(code, 1008);
    assert!(reason.contains("too many"), "{reason}");
    Page::open(&stage).await.picture().await;
    assert!(!stage.live.has_ended());
}

#[tokio::test]
async fn a_page_that_says_too_much_is_closed() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    for _ in 0..450 {
        page.say(json!({ "type": "leave" })).await;
    }
    assert_eq!(page.until_closed().await.0, 1008);
}

#[tokio::test]
async fn one_browser_too_many_is_told_so() {
    let stage = with_fake("single-axis");
    let mut pages = Vec::new();
    for _ in 0..32 {
        pages.push(Page::open(&stage).await);
    }
    let (code, reason) = Page::open(&stage).await.until_closed().await;
    assert_eq!(code, 1013);
    assert!(reason.contains("session full"), "{reason}");
    pages.pop();
    stage.until(|stage| stage.viewer.watchers() == 31).await;
    Page::open(&stage).await.picture().await;
}

#[tokio::test]
async fn a_slow_browser_gets_the_newest_picture_and_no_queue() {
    let stage = with_fake("grasp");
    let mut slow = Page::open(&stage).await;
    slow.picture().await;
    // It reads nothing, and so answers no ping, for as long as a queue needs to grow longer than what is allowed.
    tokio::time::sleep(Duration::from_secs(3)).await;
    let now_s = stage.live.snapshot().0.time_s;
    let mut old = 0;
    while slow.picture().await.time_s < now_s {
        old += 1;
    }
    // A quarter of a second of pictures at 60 a second, and those of the ping before.
    assert!(old < 40, "{old} old pictures");
}

#[tokio::test]
async fn news_reaches_all_pages() {
    let stage = with_fake("single-axis");
    let (mut one, mut two) = (Page::open(&stage).await, Page::open(&stage).await);
    one.wait_for("seats").await;
    two.wait_for("seats").await;
    stage.viewer.tell("ben has come");
    assert_eq!(one.wait_for("news").await["text"], "ben has come");
    assert_eq!(two.wait_for("news").await["text"], "ben has come");
}

#[tokio::test]
async fn the_last_picture_stays_when_the_session_is_over() {
    let stage = with_fake("single-axis");
    Page::open(&stage).await.picture().await;
    stage.live.stop();
    stage.until(|stage| stage.live.has_ended()).await;
    let mut late = Page::open(&stage).await;
    assert!(late.picture().await.ended);
}
