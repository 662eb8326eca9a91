//! One host as the haptic thread sees it: its station between the network and the displays.

use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_device::{Device, ForceSwitch, PortEnergy};
use cotouch_host::ContactSurface;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_world::Phase;
use glam::DVec3;

use crate::clock;
use crate::network_threads::{HapticPort, Inbound};
use crate::snapshot::{FingerSnapshot, HostSnapshot, SurfaceShown};
use crate::station::{Punctuality, Station};
use crate::timing::Timing;

/// A host of this process.
pub(crate) struct HapticHost {
    pub(crate) station: Station<Box<dyn Device>>,
    pub(crate) port: HapticPort,
    pub(crate) snapshot: triple_buffer::Input<HostSnapshot>,
    pub(crate) timing: Timing,
    /// Of its device.
    pub(crate) switch: Arc<dyn ForceSwitch>,
}

impl HapticHost {
    /// One tick, before which so many were skipped. No allocation, no lock, no system call besides the device and the clock.
    pub(crate) fn tick(&mut self, tick: u64, skipped: u64, lateness_ns: i64) {
        let began = clock::now();
        if let Some(packet) = self.station.begin(tick) {
            self.port.leave(None, packet);
        }
        while let Some(inbound) = self.port.take_inbound() {
            match inbound {
                Inbound::State { from, packet } => self.station.receive(from, &packet),
                Inbound::Presence { peer, present } => self.station.set_present(peer, present),
            }
        }
        let port = &mut self.port;
        self.station.respond(|client, packet| port.leave(Some(client), packet.clone()));
        self.station.finish(|| Punctuality { lateness_ns, compute_ns: clock::now().since(began) });
        if !self.station.state.releasing {
            self.timing.missed += skipped;
            self.timing.observe(self.station.last_record());
        }
    }

    /// Has forces begin from nothing after the watchdog has switched them off, and lets the device render again. No allocation,
    /// no lock.
    pub(crate) fn resume(&mut self) {
        self.station.force_off();
        self.switch.enable();
    }

    /// Leaves the newest picture of this host for displays. No allocation, no lock.
    pub(crate) fn show(&mut self, tick: u64) {
        let (record, faults) = (self.station.last_record(), self.station.device_faults());
        let snapshot = self.snapshot.input_buffer_mut();
        let instant = self.station.model.schedule.control().instant(tick);
        *snapshot = HostSnapshot {
            host: self.station.model.host,
            time_s: instant.as_secs_f64(),
            fingers: fingers(&self.station),
            bodies: record.bodies.iter().map(|body| body.pose).collect(),
            soft: self.station.state.host.soft.frame.clone().map(SurfaceShown),
            script: self.station.device.script_progress(),
            touches_wall: record.touches_wall,
            diverged: record.diverged,
            ticks: self.timing.ticks,
            missed: self.timing.missed,
            lateness_us: self.timing.latest_ns.max(record.lateness_ns) as f64 * 1e-3,
            energy_j: record.energy_j,
            device_fault_stretches: faults.stretches(),
            device_fault: *faults.last(),
            links: ArrayVec::new(),
        };
        self.timing.latest_ns = 0;
        self.snapshot.publish();
    }
}

fn fingers(station: &Station<Box<dyn Device>>) -> ArrayVec<FingerSnapshot, MAX_FINGERS> {
    let (host, record) = (station.model.host, station.last_record());
    let targets = station.device.pointer_targets();
    let finger = |(index, (&reading, &commanded))| FingerSnapshot {
        reading,
        commanded,
        contact: record.contact_of(host, index).map_or(Phase::Free, |contact| contact.phase),
        proxy: proxy(station, index),
        target: targets.get(index).copied(),
        governor_acted: record.governor_acted.get(index).copied().unwrap_or_default(),
        governor_gain: record.governor_gain.get(index).copied().unwrap_or_default(),
        energy_j: station.state.ports.get(index).map_or(0.0, PortEnergy::energy_j),
    };
    record.readings.iter().zip(&record.commanded).enumerate().map(finger).collect()
}

/// Where a finger would be if it could not get into what it touches, m: at a body, the contact's anchor.
fn proxy(station: &Station<Box<dyn Device>>, finger: usize) -> Option<DVec3> {
    let (model, state) = (&station.model, &station.state.host);
    let record = station.last_record();
    let touched = record.contact_of(model.host, finger)?;
    match touched.surface {
        ContactSurface::Body(body) => {
            let body = usize::from(body);
            let contact = state.finger_contact(model, model.host, finger, body)?;
            Some(state.bodies.get(body)?.pose.to_world(contact.anchor))
        }
        ContactSurface::Soft => {
            let out = touched.force.try_normalize()?;
            Some(record.readings.get(finger)?.pose.position + out * touched.depth_m)
        }
        ContactSurface::Wall(_) => None,
    }
}
