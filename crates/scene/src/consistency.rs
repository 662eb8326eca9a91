//! What the keys of a scene demand of each other.

use crate::names::HostIndex;
use crate::scene::{Action, Architecture, Impairment, Scene, User};
use crate::time::Schedule;
use crate::value::plain;

/// Keys whose values do not go together.
pub(crate) struct Conflict {
    /// The first is the one to name; all of them are involved.
    pub(crate) keys: Vec<String>,
    pub(crate) found: String,
    /// Follows "it must be".
    pub(crate) allowed: String,
}

fn conflict(keys: &[&str], found: impl Into<String>, allowed: impl Into<String>) -> Conflict {
    Conflict {
        keys: keys.iter().map(|&key| key.to_owned()).collect(),
        found: found.into(),
        allowed: allowed.into(),
    }
}

/// Conflicts between numbers. Cheap, because a sweep asks at every point.
pub(crate) fn of_numbers(scene: &Scene) -> Vec<Conflict> {
    let mut found = Vec::new();
    found.extend(of_rates(scene));
    found.extend(of_return_delay(scene));
    found.extend(of_loss("link.impairment", &scene.link.impairment));
    of_ways(scene, &mut found);
    found
}

fn of_rates(scene: &Scene) -> Option<Conflict> {
    let (control, network) = (scene.rates.control_hz, scene.rates.network_hz);
    Schedule::new(control, network).is_err().then(|| {
        let allowed = format!(
            "at most rates.control_hz ({control} Hz), and in a ratio to it that repeats within a million ticks"
        );
        conflict(&["rates.network_hz", "rates.control_hz"], format!("{network} Hz"), allowed)
    })
}

fn of_return_delay(scene: &Scene) -> Option<Conflict> {
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
fn of_loss(table: &str, impairment: &Impairment) -> Option<Conflict> {
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

fn of_ways(scene: &Scene, found: &mut Vec<Conflict>) {
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
        found.extend(of_loss(&table, &way.impairment));
    }
}

/// Conflicts within each user's table.
pub(crate) fn of_users(users: &[User]) -> Vec<Conflict> {
    let mut found = Vec::new();
    for (index, user) in users.iter().enumerate() {
        let table = format!("user.{}", index + 1);
        if user.script.iter().any(Action::tracks) && user.tracking.stiffness_n_per_m == 0.0 {
            let keys = [&format!("{table}.tracking.stiffness_n_per_m"), &format!("{table}.script")];
            found.push(conflict(
                &keys.map(String::as_str),
                "0",
                "more than 0, because the script holds, reaches or follows a sinusoid",
            ));
        }
        for (number, action) in user.script.iter().enumerate() {
            if let Action::PushAndLetGo { push_s, duration_s, .. } = action
                && push_s > duration_s
            {
                let action = format!("{table}.script.{}", number + 1);
                let keys = [&format!("{action}.push_s"), &format!("{action}.duration_s")];
                let allowed = format!("at most duration_s ({})", plain(*duration_s));
                found.push(conflict(&keys.map(String::as_str), plain(*push_s), allowed));
            }
        }
    }
    found
}

/// Users that are called the same.
pub(crate) fn of_names(users: &[User]) -> Vec<Conflict> {
    let mut found = Vec::new();
    for (index, user) in users.iter().enumerate() {
        if let Some(other) = users[..index].iter().position(|other| other.name == user.name) {
            let keys = [&format!("user.{}.name", index + 1), &format!("user.{}.name", other + 1)];
            let allowed = format!("another name than that of user {}", other + 1);
            found.push(conflict(&keys.map(String::as_str), format!("{:?}", user.name), allowed));
        }
    }
    found
}
