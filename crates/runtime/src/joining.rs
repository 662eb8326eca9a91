//! How a host comes into a session: the protocol's configuration for a scene.

use std::io;
use std::time::Duration;

use cotouch_net::{
    Config, Endpoint, MAX_DATAGRAM, Refusal, Route, SceneFetch, SceneFetchError, StartWhen, printable,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_scene::time::LocalTime;

use crate::clock;
use crate::start_error::StartError;
use crate::transport::{Secured, Transport as _, Unreached};

/// The endpoint of `host` in a simulated session that starts when all of the scene's users are there. Its ids come from the
/// scene's seed, so that the same session is the same, byte for byte.
#[must_use]
pub fn full_session_endpoint(scene: &Scene, host: HostIndex, server: Route, now: LocalTime) -> Endpoint {
    let seed = scene.session.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(u64::from(host.0));
    endpoint(config(scene, seed), scene, host, server, now)
}

/// As [`full_session_endpoint`], for a session in real time: its ids are random, and routes are keys.
#[must_use]
pub(crate) fn local_endpoint(scene: &Scene, host: HostIndex, server: Route, now: LocalTime) -> Endpoint {
    endpoint(keyed_config(scene), scene, host, server, now)
}

fn endpoint(mut config: Config, scene: &Scene, host: HostIndex, server: Route, now: LocalTime) -> Endpoint {
    config.user = Some(scene.users[host.index()].name.clone());
    if host == HostIndex::FIRST { Endpoint::serve(config, now) } else { Endpoint::join(config, server, now) }
}

/// The endpoint of a session that others join when they like.
#[must_use]
pub(crate) fn serving_endpoint(scene: &Scene, now: LocalTime) -> Endpoint {
    let mut config = keyed_config(scene);
    config.start = StartWhen::Immediately;
    Endpoint::serve(config, now)
}

/// The endpoint of a newcomer who wants to be `user`, or anyone.
#[must_use]
pub(crate) fn joining_endpoint(scene: &Scene, user: Option<&str>, server: Route, now: LocalTime) -> Endpoint {
    let mut config = keyed_config(scene);
    config.user = user.map(str::to_owned);
    Endpoint::join(config, server, now)
}

/// Reaches the server at `address` through `transport`; blocks for at most `patience`, and not for long after it is no
/// longer `wanted`.
///
/// # Errors
/// When nobody answers, the ticket or the version is another, or it is no longer wanted.
pub(crate) fn reach_server(
    transport: &Secured,
    address: Route,
    patience: Duration,
    wanted: &dyn Fn() -> bool,
) -> Result<(), StartError> {
    transport.reach_server(patience, wanted).map_err(|unreached| match unreached {
        Unreached::Unwelcome(reason) => StartError::Unwelcome { server: address, reason },
        Unreached::Silent => StartError::Silence { server: address },
        Unreached::Unwanted => StartError::GivenUp { server: address },
    })
}

/// Asks the server at `address`, which is reached, for its scene; blocks for at most `patience`, and not for long after it is no longer
/// `wanted`.
///
/// # Errors
/// When nobody answers, what comes is no scene, or it is no longer wanted.
pub(crate) fn fetch_scene(
    transport: &Secured,
    address: Route,
    patience: Duration,
    wanted: &dyn Fn() -> bool,
) -> Result<Scene, StartError> {
    let server = transport.session_key().server();
    let now = clock::now();
    let mut fetch = SceneFetch::new(server, instance_seed(), now, patience.as_nanos() as i64);
    let mut datagram = [0; MAX_DATAGRAM];
    let text = loop {
        if let Some(result) = fetch.result() {
            break result.clone().map_err(|error| match error {
                SceneFetchError::Refused(Refusal::NoAnswer) => StartError::Silence { server: address },
                error => StartError::Scene { server: address, reason: printable(&error.to_string()) },
            })?;
        }
        if !wanted() {
            return Err(StartError::GivenUp { server: address });
        }
        while let Some(transmit) = fetch.poll_transmit(clock::now()) {
            // What cannot be sent is asked for again.
            let _: io::Result<()> = transport.send(clock::now(), transmit.to, &transmit.bytes);
        }
        if let Ok(Some(arrival)) = transport.receive(clock::now(), &mut datagram) {
            fetch.handle_datagram(arrival.at, arrival.from, &datagram[..arrival.length]);
        }
    };
    cotouch_scene::parse(&text, "the server's scene", None, &[])
        .map_err(|errors| StartError::Scene { server: address, reason: in_one_line(&errors.to_string()) })
}

/// What is wrong with a stranger's scene, which has words of the stranger in it.
fn in_one_line(errors: &str) -> String {
    errors.lines().map(printable).collect::<Vec<_>>().join("; ")
}

fn config(scene: &Scene, seed: u64) -> Config {
    let mut config = Config::new(scene, cotouch_scene::scene_hash(scene), seed)
        .expect("a checked scene has 2 to 16 users with short names");
    config.scene_text = cotouch_scene::to_toml(scene);
    config
}

fn keyed_config(scene: &Scene) -> Config {
    Config { routes_are_proven: true, ..config(scene, instance_seed()) }
}

/// Every life of a host needs ids of its own: randomness from the operating system.
fn instance_seed() -> u64 {
    getrandom::u64().expect("the operating system has random numbers")
}
