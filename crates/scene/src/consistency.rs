//! What the keys of a scene demand of each other.

mod bodies;
mod conflict;
mod soft;

use conflict::conflict;

use crate::limits::MAX_FINGERS;
use crate::names::HostIndex;
use crate::scene::{Action, Architecture, Body, Impairment, SceneValues};
use crate::time::Schedule;
use crate::value::plain;

pub(crate) use bodies::surface;
pub(crate) use conflict::Conflict;
pub(crate) use soft::soft_mesh;

/// All conflicts that there can be but those of meshes.
pub(crate) fn all(scene: &SceneValues) -> Vec<Conflict> {
    let mut found: Vec<Conflict> = user_count(scene).into_iter().collect();
    found.extend(users(scene));
    found.extend(numbers(scene));
    found.extend(names(scene));
    found
}

/// Reading fills users up; an edit does not.
fn user_count(scene: &SceneValues) -> Option<Conflict> {
    let (count, there) = (scene.session.users, scene.users.len());
    (usize::from(count) != there)
        .then(|| conflict(&["session.users"], count.to_string(), format!("{there}, the number of users")))
}

/// Conflicts between numbers. Cheap, because a sweep asks at every point.
pub(crate) fn numbers(scene: &SceneValues) -> Vec<Conflict> {
    let mut found = Vec::new();
    found.extend(rates(scene));
    found.extend(return_delay(scene));
    found.extend(loss("link.impairment", &scene.link.impairment));
    ways(scene, &mut found);
    bodies::bodies(scene, &mut found);
    soft::soft(scene, &mut found);
    found
}

fn rates(scene: &SceneValues) -> Option<Conflict> {
    let (control, network) = (scene.rates.control_hz, scene.rates.network_hz);
    Schedule::new(control, network).is_err().then(|| {
        let allowed = format!(
            "at most rates.control_hz ({control} Hz), and in a ratio to it that repeats within a million ticks"
        );
        conflict(&["rates.network_hz", "rates.control_hz"], format!("{network} Hz"), allowed)
    })
}

fn return_delay(scene: &SceneValues) -> Option<Conflict> {
    let (back, whole) = (scene.link.return_delay_periods, scene.link.delay_periods);
    (scene.session.architecture == Architecture::Centralized && back > whole).then(|| {
        let keys = ["link.return_delay_periods", "link.delay_periods"];
        conflict(
            &keys,
            back.to_string(),
            format!("at most link.delay_periods ({whole}), of which it is a part"),
        )
    })
}

/// In a Gilbert–Elliott channel losses end with probability 1/burst and begin with rate/(1 − rate)/burst, which must
/// be a probability.
fn loss(table: &str, impairment: &Impairment) -> Option<Conflict> {
    let least = impairment.loss_rate / (1.0 - impairment.loss_rate);
    (impairment.loss_burst_packets < least).then(|| {
        let (burst, rate) = (format!("{table}.loss_burst_packets"), format!("{table}.loss_rate"));
        let allowed = format!(
            "at least {}: with a loss_rate of {} the runs of lost packets are no shorter",
            plain(least),
            plain(impairment.loss_rate)
        );
        conflict(&[&burst, &rate], plain(impairment.loss_burst_packets), allowed)
    })
}

fn ways(scene: &SceneValues, found: &mut Vec<Conflict>) {
    let users = scene.session.users;
    for (index, way) in scene.link.ways.iter().enumerate() {
        let table = format!("link.way.{}", index + 1);
        let number = |host: HostIndex| u32::from(host.0) + 1;
        for (end, host) in [("from", way.from), ("to", way.to)] {
            if host.0 >= users {
                let key = format!("{table}.{end}");
                let allowed = format!("a host from 1 to session.users ({users})");
                found.push(conflict(&[&key, "session.users"], number(host).to_string(), allowed));
            }
        }
        let (from, to) = (format!("{table}.from"), format!("{table}.to"));
        if way.from == way.to {
            let allowed = format!("another host than {from}");
            found.push(conflict(&[&to, &from], number(way.to).to_string(), allowed));
        }
        if scene.link.ways[..index].iter().any(|other| (other.from, other.to) == (way.from, way.to)) {
            let value = format!("{}, a second time from host {}", number(way.to), number(way.from));
            let allowed = "another host, because an earlier [[link.way]] has that direction";
            found.push(conflict(&[&to, &from], value, allowed));
        }
        found.extend(loss(&table, &way.impairment));
    }
}

/// Conflicts within each user's table, and of what hands are to grasp.
pub(crate) fn users(scene: &SceneValues) -> Vec<Conflict> {
    let mut found = Vec::new();
    for (index, user) in scene.users.iter().enumerate() {
        let table = format!("user.{}", index + 1);
        let mut scripts = vec![(format!("{table}.script"), &user.script)];
        let finger_script = |number: usize| format!("{table}.finger.{}.script", number + 1);
        scripts.extend(
            user.fingers.iter().enumerate().map(|(number, finger)| (finger_script(number), &finger.script)),
        );
        if !(1..=MAX_FINGERS).contains(&user.fingers.len()) {
            let allowed = format!("a list of 1 to {MAX_FINGERS} tables");
            found.push(conflict(
                &[&format!("{table}.finger")],
                format!("a list of {}", user.fingers.len()),
                allowed,
            ));
        }
        let tracks = scripts.iter().find(|(_, script)| script.iter().any(Action::tracks));
        if let Some((script, _)) = tracks
            && user.tracking.stiffness_n_per_m == 0.0
        {
            let keys = [&format!("{table}.tracking.stiffness_n_per_m"), script];
            found.push(conflict(
                &keys.map(String::as_str),
                "0",
                "more than 0, because the script holds, reaches, grasps or follows a path in another way",
            ));
        }
        for (table, script) in &scripts {
            for (number, action) in script.iter().enumerate() {
                found.extend(script_action(scene, &format!("{table}.{}", number + 1), action));
            }
        }
    }
    found
}

fn script_action(scene: &SceneValues, table: &str, action: &Action) -> Option<Conflict> {
    match action {
        Action::PushAndLetGo { push_s, duration_s, .. } if push_s > duration_s => {
            let keys = [&format!("{table}.push_s"), &format!("{table}.duration_s")];
            let allowed = format!("at most duration_s ({})", plain(*duration_s));
            Some(conflict(&keys.map(String::as_str), plain(*push_s), allowed))
        }
        Action::Grasp { body, .. } => {
            let bodies = scene.world_bodies();
            let free: Vec<&Body> = bodies.iter().filter(|body| !body.fixed).collect();
            let is_there = free.iter().any(|free| free.name == *body);
            (!is_there).then(|| {
                let names: Vec<String> = free.iter().map(|free| format!("{:?}", free.name)).collect();
                let allowed = match names.len() {
                    0 => "left out, because no body can be moved".to_owned(),
                    _ => format!("the name of a body that is not fixed: {}", names.join(" or ")),
                };
                conflict(&[&format!("{table}.body")], format!("{body:?}"), allowed)
            })
        }
        _ => None,
    }
}

/// Users that are called the same; bodies and walls that are called the same.
pub(crate) fn names(scene: &SceneValues) -> Vec<Conflict> {
    let users: Vec<(&str, String)> = named("user", scene.users.iter().map(|user| user.name.as_str()));
    let bodies = named("body", scene.bodies.iter().map(|body| body.name.as_str()));
    let planes = named("wall.plane", scene.wall.planes.iter().map(|plane| plane.name.as_str()));
    // A world without [[body]] or [[wall.plane]] has these.
    let object = scene.bodies.is_empty().then(|| ("object", "object".to_owned()));
    let wall = scene.wall.planes.is_empty().then(|| ("wall", "wall".to_owned()));
    let mut found = same_names(&users);
    found.extend(same_names(&[object.into_iter().chain(wall).collect(), bodies, planes].concat()));
    found
}

/// Each name with the table that it is of.
fn named<'a>(list: &str, names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, String)> {
    names.enumerate().map(|(index, name)| (name, format!("{list}.{}", index + 1))).collect()
}

fn same_names(names: &[(&str, String)]) -> Vec<Conflict> {
    let mut found = Vec::new();
    for (index, (name, table)) in names.iter().enumerate() {
        if let Some((_, other)) = names[..index].iter().find(|(other, _)| other == name) {
            let keys = [&format!("{table}.name"), &format!("{other}.name")];
            let allowed = format!("another name than that of {}", other.replace('.', " "));
            found.push(conflict(&keys.map(String::as_str), format!("{name:?}"), allowed));
        }
    }
    found
}
