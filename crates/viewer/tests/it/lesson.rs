//! Browsers that take hands, change the session and ask what the analysis says; and recordings.

use std::path::Path;
use std::sync::Arc;

use crate::page::{Page, Seen, Silent, any_port, ask, body, with_fake};
use cotouch_runtime::virtual_run;
use cotouch_viewer::{Show, Viewer, ViewerError};
use serde_json::{Value, json};

const STIFFNESS: &str = "coupling.object_object.stiffness_n_per_m";

fn by(message: &Value, user: usize) -> &str {
    message["seats"][user]["by"].as_str().unwrap_or_default()
}

#[tokio::test]
async fn two_browsers_see_who_moves_which_hand() {
    let stage = with_fake("single-axis");
    let (mut one, mut two) = (Page::open(&stage).await, Page::open(&stage).await);
    one.say(json!({ "type": "take", "user": 0 })).await;
    let taken = one.wait_for("taken").await;
    assert_eq!(taken["user"], 0);
    assert!(taken["stiffness_n_per_m"].as_f64().is_some_and(|stiffness| stiffness > 0.0), "{taken}");
    one.wait_until(|message| by(message, 0) == "you").await;
    two.wait_until(|message| by(message, 0) == "browser").await;

    two.say(json!({ "type": "take", "user": 0 })).await;
    let refused = two.wait_for("refused").await;
    assert_eq!(refused["what"], "take");
    assert!(refused["why"].as_str().unwrap().contains("anna"), "{refused}");
    two.say(json!({ "type": "take", "user": 9 })).await;
    assert!(two.wait_for("refused").await["why"].as_str().unwrap().contains("no user 10"));
    two.say(json!({ "type": "take", "user": 1 })).await;
    one.wait_until(|message| by(message, 1) == "browser").await;

    drop(one);
    two.wait_until(|message| by(message, 0) == "script" && by(message, 1) == "you").await;
    two.say(json!({ "type": "leave" })).await;
    two.wait_until(|message| message["type"] == "taken" && message["user"].is_null()).await;
    two.wait_until(|message| by(message, 1) == "script").await;
}

#[tokio::test]
async fn a_pointer_draws_the_finger_until_its_page_falls_silent() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    page.say(json!({ "type": "take", "user": 0 })).await;
    page.wait_for("taken").await;
    let mut drawn_x_m = f32::NAN;
    while drawn_x_m.is_nan() || (drawn_x_m - 0.05).abs() >= 0.01 {
        page.say(json!({ "type": "point", "targets_m": [[0.05, 0, 0]] })).await;
        drawn_x_m = page.picture().await.target_x_m;
    }
    page.wait_until(|message| message["type"] == "taken" && message["user"].is_null()).await;
    let news = page.wait_for("news").await;
    assert!(news["text"].as_str().unwrap().contains("let go"), "{news}");
    page.picture_with(|seen| seen.target_x_m.is_nan()).await;
}

#[tokio::test]
async fn a_change_reaches_the_session_and_all_pages() {
    let stage = with_fake("single-axis");
    let (mut one, mut two) = (Page::open(&stage).await, Page::open(&stage).await);
    let generation = one.wait_for("session").await["generation"].clone();
    one.say(json!({ "type": "set", "settings": { STIFFNESS: 450.0 } })).await;
    for page in [&mut one, &mut two] {
        let is_set = |message: &Value| message["settings"][STIFFNESS] == 450.0;
        page.wait_until(is_set).await;
    }
    stage.until(|stage| stage.live.scene().0.coupling.object_object.stiffness_n_per_m == 450.0).await;

    one.say(json!({ "type": "set", "settings": { "session.users": 3 } })).await;
    let session = two
        .wait_until(|message| {
            message["type"] == "session"
                && message["about"]["users"].as_array().is_some_and(|users| users.len() == 3)
        })
        .await;
    assert!(session["generation"].as_u64() > generation.as_u64(), "{session}");
    let number = session["generation"].as_u64().unwrap() as u32;
    let seen = two.picture_with(|seen| seen.generation == number && seen.hosts == 3).await;
    assert!(!seen.ended);
    assert_eq!(stage.live.scene().0.coupling.object_object.stiffness_n_per_m, 450.0, "what was set stays");
}

#[tokio::test]
async fn a_hand_is_lost_with_its_session_and_can_be_taken_again() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    page.say(json!({ "type": "take", "user": 1 })).await;
    page.wait_until(|message| message["type"] == "taken" && message["user"] == 1).await;
    page.say(json!({ "type": "again" })).await;
    page.wait_until(|message| message["type"] == "session" && message["generation"] == 2).await;
    page.wait_until(|message| message["type"] == "taken" && message["user"].is_null()).await;
    page.say(json!({ "type": "take", "user": 1 })).await;
    page.wait_until(|message| message["type"] == "taken" && message["user"] == 1).await;
}

#[tokio::test]
async fn the_newest_of_many_changes_wins() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    for step in 1..=60 {
        page.say(json!({ "type": "set", "settings": { STIFFNESS: 200 + step } })).await;
    }
    page.wait_until(|message| message["settings"][STIFFNESS] == 260.0).await;
    stage.until(|stage| stage.live.scene().0.coupling.object_object.stiffness_n_per_m == 260.0).await;
}

#[tokio::test]
async fn what_cannot_be_set_is_refused_in_words_and_the_session_goes_on() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    let bad = [
        (json!({ "scene": "/etc/passwd" }), "no scene"),
        (json!({ "object.mesh": "/etc/passwd" }), "no control"),
        (json!({ "session.users": 1000 }), "from 2 to 8"),
        (json!({ "session.users": 2.5 }), "whole number"),
        (json!({ STIFFNESS: -1 }), "from"),
        (json!({ STIFFNESS: "much" }), "number"),
        (json!({ "rates.network_hz": "1e6" }), "one of"),
        (json!({ "session.architecture": "anarchy" }), "one of"),
    ];
    for (settings, words) in bad {
        page.say(json!({ "type": "set", "settings": settings })).await;
        let refused = page.wait_for("refused").await;
        assert_eq!(refused["what"], "set");
        assert!(refused["why"].as_str().unwrap().contains(words), "{settings}: {refused}");
    }
    assert_eq!(stage.live.scene().1, 1);
    page.picture().await;
}

#[tokio::test]
async fn another_scene_brings_its_own_controls() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    page.say(json!({ "type": "set", "settings": { "scene": "grasp" } })).await;
    let session = page.wait_until(|message| message["about"]["scene"] == "grasp").await;
    let has = |key: &str| session["controls"].as_array().unwrap().iter().any(|control| control["key"] == key);
    assert!(has("wall.stiffness_n_per_m") && !has("session.users"), "{session}");
    let settings = page.wait_for("settings").await;
    assert_eq!(settings["settings"]["scene"], "grasp");
}

#[tokio::test]
async fn a_prediction_is_of_the_settings_that_were_asked_about() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    let axis = |key: &str| json!({ "key": key, "from": 100, "to": 200, "count": 5, "log": true });
    let map = json!({ "x": axis(STIFFNESS), "y": axis("coupling.hand_object.stiffness_n_per_m") });
    page.say(
        json!({ "type": "predict", "id": 5, "settings": { STIFFNESS: 2000 }, "whole": false, "margin": true, "map": map }),
    )
    .await;
    let verdict = page.wait_for("verdict").await;
    assert_eq!(
        (&verdict["id"], &verdict["stable"], &verdict["spectral_radius"]),
        (&json!(5), &json!(false), &json!(2.0))
    );
    assert_eq!(page.wait_for("map").await["id"], 5);
    let failed = page.wait_for("failed").await;
    assert_eq!((&failed["what"], &failed["why"]), (&json!("margin"), &json!("there is none")));
    assert_eq!(stage.live.scene().0.coupling.object_object.stiffness_n_per_m, 300.0, "nothing was changed");

    let map = json!({ "x": axis("object.mesh"), "y": axis(STIFFNESS) });
    page.say(
        json!({ "type": "predict", "id": 6, "settings": {}, "whole": false, "margin": false, "map": map }),
    )
    .await;
    assert_eq!(page.wait_for("refused").await["what"], "predict");
}

#[tokio::test]
async fn what_is_predicted_is_what_can_run() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    let settings = json!({ "link.delay_periods": 0 });
    page.say(json!({ "type": "predict", "id": 1, "settings": settings, "whole": false, "margin": false, "map": null })).await;
    let verdict = page.wait_for("verdict").await;
    assert!(verdict["warnings"][0].as_str().unwrap().contains("at least 1 network period"), "{verdict}");
}

#[tokio::test]
async fn a_newer_question_ends_an_older_one_and_a_mistake_ends_nothing() {
    let stage = with_fake("single-axis");
    let mut page = Page::open(&stage).await;
    let predict = |id: u32, delay: u32| json!({ "type": "predict", "id": id, "settings": { "link.delay_periods": delay }, "whole": false, "margin": false, "map": null });
    page.say(predict(1, 7)).await;
    page.say(predict(2, 7)).await;
    page.say(predict(3, 2)).await;
    let verdict = page.wait_for("verdict").await;
    assert_eq!(verdict["id"], 3);
    page.say(predict(4, 8)).await;
    let failed = page.wait_for("failed").await;
    assert_eq!((&failed["id"], &failed["what"]), (&json!(4), &json!("verdict")));
    page.say(predict(5, 3)).await;
    assert_eq!(page.wait_for("verdict").await["id"], 5);
}

#[tokio::test]
async fn a_long_answer_waits_for_the_first_answers_of_others_and_still_comes() {
    let stage = with_fake("single-axis");
    let (mut one, mut two) = (Page::open(&stage).await, Page::open(&stage).await);
    let predict = |id: u32, margin: bool| json!({ "type": "predict", "id": id, "settings": { "link.delay_periods": 6 }, "whole": false, "margin": margin, "map": null });
    one.say(predict(1, true)).await;
    assert_eq!(one.wait_for("verdict").await["id"], 1);
    for id in 1..=3 {
        two.say(predict(id, false)).await;
        assert_eq!(two.wait_for("verdict").await["id"], id);
    }
    let next = one.wait_until(|message| message["id"] == 1).await;
    assert_eq!((&next["type"], &next["what"]), (&json!("failed"), &json!("margin")), "no part comes twice");
}

#[tokio::test]
async fn recordings_are_shown_by_session_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("carried.mcap");
    let scene = cotouch_scene::load("grasp", &[]).unwrap();
    virtual_run::run(&scene, 2.0, Some(&path), |_| true).unwrap();
    let show = Show::Replay(vec![path.clone(), path]);
    let viewer = Viewer::start(any_port(), show, Arc::new(Silent)).unwrap();

    let mut page = Page::at(&format!("ws://{}/live", viewer.address())).await;
    let session = page.wait_for("session").await;
    assert_eq!(session["mode"], "replay");
    assert_eq!(session["may_change"], false);
    assert_eq!(session["recordings"].as_array().unwrap().len(), 2);
    let recording = &session["recordings"][1];
    assert_eq!(recording["name"], "carried.mcap");
    assert_eq!(recording["about"]["scene"], "grasp");
    // Two seconds, and the time in which forces fade out.
    let duration_s = recording["duration_s"].as_f64().unwrap();
    assert!((2.0..2.2).contains(&duration_s), "{recording}");
    page.say(json!({ "type": "take", "user": 0 })).await;
    assert_eq!(page.wait_for("refused").await["what"], "take");

    let whole = pictures(&body(viewer.address(), "/recordings/1/pictures?from_s=0&to_s=30"));
    assert!((whole.len() as f64 - 60.0 * duration_s).abs() < 3.0, "{} pictures", whole.len());
    assert!(whole.iter().all(|seen| seen.hosts == 2));
    assert!(whole.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
    let part = pictures(&body(viewer.address(), "/recordings/0/pictures?to_s=1.5&from_s=0.5"));
    assert!((59..=61).contains(&part.len()));
    assert!(part.iter().all(|seen| (0.5..1.5).contains(&seen.time_s)));
    assert!(body(viewer.address(), "/recordings/0/pictures?from_s=100&to_s=101").is_empty());

    let host = viewer.address().to_string();
    for (path, status) in [
        ("/recordings/2/pictures?from_s=0&to_s=1", "404"),
        ("/recordings/x/pictures?from_s=0&to_s=1", "404"),
        ("/recordings/0/pictures", "400"),
        ("/recordings/0/pictures?from_s=0&to_s=31", "400"),
        ("/recordings/0/pictures?from_s=nan&to_s=1", "400"),
        ("/recordings/0/pictures?from_s=1&to_s=0", "400"),
    ] {
        let answer = ask(viewer.address(), path, &host, "");
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{path}: {answer}");
    }
}

/// What is in an answer: each picture after its length.
fn pictures(mut bytes: &[u8]) -> Vec<Seen> {
    let mut all = Vec::new();
    while let Some((length, rest)) = bytes.split_first_chunk() {
        let (picture, rest) = rest.split_at(u32::from_le_bytes(*length) as usize);
        all.push(Seen::of(picture));
        bytes = rest;
    }
    assert!(bytes.is_empty(), "whole pictures only");
    all
}

#[test]
fn what_is_no_recording_is_refused_in_words() {
    let start = |path: &Path| {
        let show = Show::Replay(vec![path.to_owned()]);
        Viewer::start(any_port(), show, Arc::new(Silent)).err().expect("this is no recording")
    };
    let missing = start(Path::new("nowhere.mcap"));
    assert!(
        matches!(missing, ViewerError::Replay(_)) && missing.to_string().contains("nowhere.mcap"),
        "{missing}"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text.mcap");
    std::fs::write(&path, "not a recording").unwrap();
    assert!(start(&path).to_string().contains("text.mcap"));
}

/// How far the vertex that moved most is from where it rests, along its largest component, m; of a picture that ends in the
/// surface of a triangle.
fn furthest_m(seen: &Seen) -> f64 {
    let surface = &seen.bytes[seen.bytes.len() - (20 + 3 * 8)..];
    let step_m = f64::from(f32::from_le_bytes(surface[12..16].try_into().unwrap()));
    let steps = surface[20..].chunks(2).enumerate().filter(|(nth, _)| nth % 4 != 3);
    let most = steps.map(|(_, two)| i16::from_le_bytes(two.try_into().unwrap()).unsigned_abs()).max();
    step_m * f64::from(most.unwrap())
}

#[test]
fn a_recording_of_a_soft_object_shows_how_it_gives_way() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pressed.mcap");
    let scene = cotouch_scene::load("spring", &[]).unwrap();
    virtual_run::run(&scene, 2.0, Some(&path), |_| true).unwrap();
    let viewer = Viewer::start(any_port(), Show::Replay(vec![path]), Arc::new(Silent)).unwrap();
    let all = pictures(&body(viewer.address(), "/recordings/0/pictures?from_s=0&to_s=30"));
    let last = all.last().unwrap();
    assert_eq!((last.hosts, last.surfaces), (1, 1));
    // A spring of 900 N/m behind one of 100 N/m that a hand presses 25 mm into: (5) of Barbagli et al. 2003.
    assert!((1e-3..5e-3).contains(&furthest_m(last)), "{} m", furthest_m(last));
    let early = all.iter().filter(|seen| seen.time_s < 0.5 && seen.surfaces == 1);
    assert!(early.map(furthest_m).all(|way_m| way_m < 1e-6));
}

#[tokio::test]
async fn a_soft_objects_surface_comes_with_pictures_and_gains_change_while_it_runs() {
    let stage = with_fake("spring");
    let mut page = Page::open(&stage).await;
    let session = page.wait_for("session").await;
    assert_eq!(session["about"]["soft"]["surface"]["triangles"].as_array().unwrap().len(), 3, "{session}");
    assert_eq!(session["about"]["bodies"], json!([]));
    page.picture_with(|seen| seen.surfaces == 1 && furthest_m(seen) > 1e-4).await;
    page.say(json!({ "type": "set", "settings": { "local_model.stiffness_n_per_m": 150 } })).await;
    page.wait_until(|message| message["settings"]["local_model.stiffness_n_per_m"] == 150.0).await;
    stage.until(|stage| stage.live.scene().0.local_model.stiffness_n_per_m == 150.0).await;
    assert_eq!(stage.live.scene().1, 1, "the session goes on");
    page.say(json!({ "type": "set", "settings": { "soft.mesh.stiffness_n_per_m": 400 } })).await;
    page.wait_until(|message| message["type"] == "session" && message["generation"] == 2).await;
    page.picture_with(|seen| seen.generation == 2 && seen.surfaces == 1).await;
}
