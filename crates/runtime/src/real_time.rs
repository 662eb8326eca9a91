//! A session in real time: real clocks, sockets and threads around the same stations as in virtual time.
//!
//! [`run_local`] starts every host in this process with sockets on loopback; [`serve`] and [`join`] start one host of
//! a session that spans processes and machines. Each gives a [`SessionHandle`].

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use cotouch_device::{Device, DeviceOpenError};
use cotouch_host::SlowLoop;
use cotouch_net::{Endpoint, Route, Ticket};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment, Link, PlayOut, Scene};

use crate::clock;
use crate::control::Control;
use crate::device_choice::{missing_fingers, open_device};
use crate::exchange::RecordSink;
use crate::failures::Failures;
use crate::force_off;
use crate::haptic_host::HapticHost;
use crate::haptic_loop;
use crate::joining::{fetch_scene, joining_endpoint, local_endpoint, reach_server, serving_endpoint};
use crate::mailbox;
use crate::network_threads::{HapticPort, NetworkThreads};
use crate::options::RealTimeOptions;
use crate::own_limits::OwnLimits;
use crate::pointer::GuidedHand;
use crate::priority::HAPTIC_STACK_BYTES;
use crate::recording_thread::RecordingThread;
use crate::session_handle::{Local, SessionHandle};
use crate::slow::{is_simulated_at, slow_simulation};
use crate::slow_thread::start_slow_thread;
use crate::snapshot::HostSnapshot;
use crate::start_error::{JOIN_PATIENCE, StartError};
use crate::station::Station;
use crate::timing::Timing;
use crate::transport::{self, Secured};
use crate::watchdog;

/// A host that takes part, with its network threads.
type JoinedHost = (NetworkThreads, HapticPort);

/// The scene as a real network can play it, and a sentence when that differs from what was asked for.
///
/// A sample cannot be used at the instant at which it is taken somewhere else. With scheduled play-out every way takes
/// at least one network period: n ≥ 1 when distributed; n ≥ 2 when centralized, of which one on the force's way
/// back (where the round trip's periods lie does not change the loop's poles).
#[must_use]
pub fn realisable(scene: &Scene) -> (Scene, Option<String>) {
    if scene.link.play_out == PlayOut::OnArrival {
        let note = "with play_out = \"on-arrival\" the network's own latency is a part of the loop, which the analysis \
                    does not know; it takes the latency_s of --impair, and 0 without it";
        return (scene.clone(), Some(note.to_owned()));
    }
    let asked = scene.link.delay_periods;
    let (real, way) = match scene.session.architecture {
        Architecture::Distributed => (asked.max(1), "one way"),
        Architecture::Centralized => (asked.max(2), "there and back"),
    };
    let delay = |link: &mut Link| {
        link.delay_periods = real;
        if scene.session.architecture == Architecture::Centralized {
            link.return_delay_periods = link.return_delay_periods.clamp(1, real - 1);
        }
    };
    let played = scene.edit(|played| delay(&mut played.link)).expect("a few network periods are allowed");
    let warning = (real != asked).then(|| {
        format!(
            "in real time packets need at least {real} network period{} {way}, so this session runs, and is analysed, \
             with link.delay_periods = {real} instead of {asked}; `--virtual` runs the scene as it is",
            if real == 1 { "" } else { "s" }
        )
    });
    (played, warning)
}

/// Starts all hosts of `scene` in this process, joined over UDP on loopback, with the devices of `options`.
///
/// # Errors
/// When a device, a socket, a thread or the recording cannot be had.
pub fn run_local(scene: &Scene, options: &RealTimeOptions) -> Result<SessionHandle, StartError> {
    let devices: Result<Vec<_>, _> = scene.hosts().map(|host| device_of(scene, host, options)).collect();
    let (devices, places): (Vec<_>, Vec<_>) = devices?.into_iter().unzip();
    Ok(run_local_with(scene, devices, options)?.with_places(places.into_iter().flatten().collect()))
}

/// The device of a user, and its place where pointers may take it.
fn device_of(
    scene: &Scene,
    host: HostIndex,
    options: &RealTimeOptions,
) -> Result<(Box<dyn Device>, Option<GuidedHand>), DeviceOpenError> {
    let (place, slot) = GuidedHand::new(scene, host);
    let device = open_device(scene, host, &options.devices, slot)?;
    let place = device.is_guided().then_some(place);
    Ok((device, place))
}

/// As [`run_local`], with `devices`, one a host in the order of hosts, instead of those of `options`.
///
/// # Errors
/// As for [`run_local`].
///
/// # Panics
/// When there are not as many devices as hosts.
pub fn run_local_with(
    scene: &Scene,
    devices: Vec<Box<dyn Device>>,
    options: &RealTimeOptions,
) -> Result<SessionHandle, StartError> {
    assert_eq!(devices.len(), usize::from(scene.session.users), "one device a host");
    let limits = options.limits.unwrap_or_else(|| OwnLimits::of(scene));
    let scene = &limits.apply(scene);
    let simulation = slow_simulation(scene)?;
    let control = Arc::new(Control::default());
    let mut seats = Vec::new();
    let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let ends = scene.hosts().map(|_| transport::listen(any.into())).collect::<Result<Vec<_>, _>>()?;
    let mut session: Option<Ticket> = None;
    for (host, end) in scene.hosts().zip(ends) {
        let (end, ticket) = match session {
            Some(ticket) => (Secured::join(end, ticket, clock::now()), ticket),
            None => {
                let end = Secured::serve(end);
                let ticket = end.ticket().map_err(StartError::Thread)?;
                (end, *session.insert(ticket))
            }
        };
        let endpoint = local_endpoint(scene, host, ticket.key.server(), clock::now());
        seats.push(take_seat(end, endpoint, host, scene.session.seed, options, &control.failures)?);
        wait_to_be_taken_in(&seats[host.index()].0, ticket.address, &|| true)?;
    }
    Ok(start(scene, simulation, seats, devices, options, control)?.with_limits(limits, None))
}

/// Starts the first host of `scene`, which the others join at `listen`. The session's clock starts at once.
///
/// # Errors
/// When the address, a thread or the recording cannot be had.
pub fn serve(
    scene: &Scene,
    listen: impl Into<Route>,
    options: &RealTimeOptions,
) -> Result<SessionHandle, StartError> {
    let limits = options.limits.unwrap_or_else(|| OwnLimits::of(scene));
    let scene = &limits.apply(scene);
    let simulation = slow_simulation(scene)?;
    let end = Secured::serve(transport::listen(listen.into())?);
    let ticket = end.ticket().map_err(StartError::Thread)?;
    let endpoint = serving_endpoint(scene, clock::now());
    let control = Arc::new(Control::default());
    let seat = take_seat(end, endpoint, HostIndex::FIRST, scene.session.seed, options, &control.failures)?;
    let handle = start_one(scene, simulation, (seat, HostIndex::FIRST), ticket, options, control)?;
    Ok(handle.with_limits(limits, None))
}

/// Joins the session of `ticket` as `user`, or as anyone who is still missing; the scene comes from the server, and is given with no
/// more force than the limits of `options` allow. While an answer is
/// waited for, `wanted` is asked again and again whether to go on.
///
/// # Errors
/// When nobody answers, the ticket is another session's, the session turns this host away, it is no longer wanted, or a thread or the recording cannot be
/// had.
pub fn join(
    ticket: Ticket,
    user: Option<&str>,
    options: &RealTimeOptions,
    wanted: &dyn Fn() -> bool,
) -> Result<(Scene, SessionHandle), StartError> {
    let server = ticket.address;
    let end = Secured::join(transport::connect(server)?, ticket, clock::now());
    reach_server(&end, server, JOIN_PATIENCE, wanted)?;
    let asked = fetch_scene(&end, server, JOIN_PATIENCE, wanted)?;
    let limits = options.limits.unwrap_or(OwnLimits::BUILT_IN);
    let scene = limits.apply(&asked);
    // Made before the session hears of this host: it may take a while.
    let simulation = slow_simulation(&scene)?;
    // In the session it is the scene that was asked for: what this host allows is its own affair.
    let endpoint = joining_endpoint(&asked, user, ticket.key.server(), clock::now());
    let control = Arc::new(Control::default());
    let (network, port) =
        take_seat(end, endpoint, HostIndex(u8::MAX), scene.session.seed, options, &control.failures)?;
    wait_to_be_taken_in(&network, server, wanted)?;
    let host = network.with_endpoint(|endpoint| endpoint.host()).ok_or(StartError::Silence { server })?;
    let handle = start_one(&scene, simulation, ((network, port), host), ticket, options, control)?;
    Ok((scene, handle.with_limits(limits, limits.refusal(&asked))))
}

/// Starts the host that has this seat in the session of `ticket`.
fn start_one(
    scene: &Scene,
    simulation: Option<SlowLoop>,
    (seat, host): (JoinedHost, HostIndex),
    ticket: Ticket,
    options: &RealTimeOptions,
    control: Arc<Control>,
) -> Result<SessionHandle, StartError> {
    let (device, place) = device_of(scene, host, options)?;
    let handle = start(scene, simulation, vec![seat], vec![device], options, control)?;
    Ok(handle.with_places(place.into_iter().collect()).with_ticket(ticket))
}

fn take_seat(
    end: Secured,
    endpoint: Endpoint,
    host: HostIndex,
    seed: u64,
    options: &RealTimeOptions,
    failures: &Failures,
) -> Result<JoinedHost, StartError> {
    end.impair(options.impairment.as_ref().unwrap_or(&Impairment::NONE), seed, host);
    NetworkThreads::start(end, endpoint, &host.to_string(), failures).map_err(StartError::Thread)
}

fn wait_to_be_taken_in(
    network: &NetworkThreads,
    server: Route,
    wanted: &dyn Fn() -> bool,
) -> Result<(), StartError> {
    let patience = clock::now().plus_ns(JOIN_PATIENCE.as_nanos() as i64);
    while clock::now() < patience {
        if !wanted() {
            return Err(StartError::GivenUp { server });
        }
        if let Some(reason) = network.refusal() {
            return Err(StartError::Refused { server, reason });
        }
        if network.has_joined() {
            return Ok(());
        }
        thread::sleep(Duration::from_millis(2));
    }
    Err(StartError::Silence { server })
}

fn start(
    scene: &Scene,
    simulation: Option<SlowLoop>,
    seats: Vec<JoinedHost>,
    devices: Vec<Box<dyn Device>>,
    options: &RealTimeOptions,
    control: Arc<Control>,
) -> Result<SessionHandle, StartError> {
    let hosts: Vec<HostIndex> = seats
        .iter()
        .map(|(network, _)| network.with_endpoint(|endpoint| endpoint.host()).unwrap_or(HostIndex::FIRST))
        .collect();
    let (recording, sinks) = RecordingThread::start(scene, &hosts, options.recording.as_deref(), &control)?;
    let mut sinks = sinks.into_iter();
    let mut haptic = Vec::new();
    let mut locals = Vec::new();
    let mut switches = Vec::new();
    for (((network, port), device), host) in seats.into_iter().zip(devices).zip(hosts) {
        let (snapshot_in, snapshot_out) = triple_buffer::triple_buffer(&HostSnapshot::default());
        let sink = sinks.next().map(|sink| Box::new(sink) as Box<dyn RecordSink + Send>);
        let switch = device.force_switch();
        switches.push(Arc::clone(&switch));
        let device_note = missing_fingers(scene, host, &device);
        let mut station = Station::new(scene, host, device, sink);
        let mut soft = None;
        if let Some(simulation) = simulation.clone().filter(|_| is_simulated_at(scene, host)) {
            let (port, thread) =
                start_slow_thread(scene, host, simulation, &control.failures).map_err(StartError::Thread)?;
            (station, soft) = (station.with_soft(port), Some(thread));
        }
        haptic.push(HapticHost { station, port, snapshot: snapshot_in, timing: Timing::new(), switch });
        locals.push(Local { host, network, snapshot: snapshot_out, soft, device_note, told_faults: 0 });
    }
    let (changes, mailbox) = mailbox::both_ends();
    let (rate, duration_s, shared) = (scene.rates.control_hz, options.duration_s, Arc::clone(&control));
    force_off::register(&switches);
    watchdog::start(&control, switches, rate).map_err(StartError::Thread)?;
    let thread = thread::Builder::new()
        .name("haptic".to_owned())
        .stack_size(HAPTIC_STACK_BYTES)
        .spawn(move || haptic_loop::run(haptic, rate, duration_s, mailbox, &shared))
        .map_err(StartError::Thread)?;
    let impairment = options.impairment.clone().unwrap_or(Impairment::NONE);
    Ok(SessionHandle::new(scene.clone(), impairment, changes, control, locals, thread, recording))
}
