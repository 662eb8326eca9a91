//! Where each number of the soft loop's state lies, and what it is called.

use std::fmt;

use cotouch_scene::names::{Axis, Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{LocalModelKind, SurfaceHold};

use super::{SoftLoop, Way};
use crate::lift::layout::Registers;

/// A number of the state of a session with a soft body, just before the tick at which a pattern begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoftCoordinate {
    /// Of a hand, or a sample on its way.
    Named(Coordinate),
    /// The integral's force of a finger slot at a host, N along the contact's normal.
    Integral {
        /// Whose local model.
        host: HostIndex,
        /// Counted over all users' fingers.
        slot: u8,
    },
    /// A number of a host's body after its last step: displacements, then velocities of its free coordinates (or of
    /// what these were reduced to).
    Body {
        /// Whose body.
        host: HostIndex,
        /// From 0.
        index: u32,
    },
    /// How far a contact is from rest, m, in the frame that came `age` periods before the next one; 1 is the last.
    Surface {
        /// Whose frame.
        host: HostIndex,
        /// Periods.
        age: u32,
        /// The contact's finger slot.
        slot: u8,
        /// World frame.
        axis: Axis,
    },
    /// The force of a contact with which that frame was stepped, N.
    SteppedForce {
        /// Whose frame.
        host: HostIndex,
        /// Periods.
        age: u32,
        /// The contact's finger slot.
        slot: u8,
        /// World frame.
        axis: Axis,
    },
}

impl fmt::Display for SoftCoordinate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis_name = |axis: Axis| Quantity::Position(axis);
        match *self {
            Self::Named(coordinate) => coordinate.fmt(formatter),
            Self::Integral { host, slot } => write!(formatter, "{host}.integral{}", slot + 1),
            Self::Body { host, index } => write!(formatter, "{host}.soft{}", index + 1),
            Self::Surface { host, age, slot, axis } => {
                write!(formatter, "{host}.surface{}.{}.age{age}", slot + 1, axis_name(axis))
            }
            Self::SteppedForce { host, age, slot, axis } => {
                write!(formatter, "{host}.stepped{}.{}.age{age}", slot + 1, axis_name(axis))
            }
        }
    }
}

/// A shift register of a finger's positions.
#[derive(Clone, Debug)]
pub(super) struct Register {
    pub(super) hand: usize,
    /// Worlds that read it.
    worlds: Vec<usize>,
    /// Samples of ages 1 to this number are in the state.
    pub(super) length: u32,
}

/// The state's numbers, in order.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) coordinates: Vec<SoftCoordinate>,
    pub(super) registers: Vec<Register>,
}

impl Layout {
    pub(super) fn new(of: &SoftLoop, kind: Registers) -> Self {
        let mut layout = Self { coordinates: Vec::new(), registers: registers(of, kind) };
        layout.add_hands(of);
        layout.add_samples(of);
        layout.add_sent_forces(of);
        (0..of.worlds.len()).for_each(|world| layout.add_world(of, world));
        layout
    }

    pub(super) fn size(&self) -> usize {
        self.coordinates.len()
    }

    /// Where a world finds a held finger's samples.
    pub(super) fn register_of(&self, world: usize, hand: usize) -> Option<usize> {
        self.registers.iter().position(|register| register.hand == hand && register.worlds.contains(&world))
    }

    fn add_hands(&mut self, of: &SoftLoop) {
        let states = of.hands.iter().flat_map(|hand| hand.body.states.iter().copied());
        self.coordinates.extend(states.map(SoftCoordinate::Named));
    }

    fn add_samples(&mut self, of: &SoftLoop) {
        for register in &self.registers {
            let hand = &of.hands[register.hand];
            let (from, part) = (hand.user, Part::Hand(hand.finger));
            let host = register.worlds.first().map_or(from, |&world| of.worlds[world].host);
            for age in 1..=register.length {
                self.coordinates.extend(hand.body.axes.iter().map(|dof| {
                    let quantity = Quantity::Position(dof.axis());
                    SoftCoordinate::Named(Coordinate::Held { host, from, part, quantity, age })
                }));
            }
        }
    }

    fn add_sent_forces(&mut self, of: &SoftLoop) {
        let server = of.worlds[0].host;
        for touch in &of.worlds[0].touches {
            let Some(delay) = touch.force_back else { continue };
            let hand = &of.hands[touch.hand];
            for age in 1..=delay.samples(&of.network) {
                self.coordinates.extend(hand.body.axes.iter().map(|dof| {
                    let (part, quantity) = (Part::Force(hand.finger), Quantity::Force(dof.axis()));
                    SoftCoordinate::Named(Coordinate::Held {
                        host: hand.user,
                        from: server,
                        part,
                        quantity,
                        age,
                    })
                }));
            }
        }
    }

    fn add_world(&mut self, of: &SoftLoop, index: usize) {
        let world = &of.worlds[index];
        let host = world.host;
        let slots: Vec<u8> = world.touches.iter().map(|touch| of.hands[touch.hand].slot).collect();
        if of.kind == LocalModelKind::Pi {
            self.coordinates.extend(slots.iter().map(|&slot| SoftCoordinate::Integral { host, slot }));
        }
        let states = world.body.a.nrows() as u32;
        self.coordinates.extend((0..states).map(|index| SoftCoordinate::Body { host, index }));
        let of_contacts = |coordinate: &dyn Fn(u8, Axis) -> SoftCoordinate| {
            let all = slots.iter().flat_map(|&slot| Axis::ALL.map(|axis| coordinate(slot, axis)));
            all.collect::<Vec<_>>()
        };
        let first = if world.body.shown.is_some() { 2 } else { 1 };
        for age in first..=of.frames() {
            self.coordinates.extend(of_contacts(&|slot, axis| SoftCoordinate::Surface {
                host,
                age,
                slot,
                axis,
            }));
        }
        for age in 1..=of.frames_with_forces() {
            self.coordinates.extend(of_contacts(&|slot, axis| SoftCoordinate::SteppedForce {
                host,
                age,
                slot,
                axis,
            }));
        }
    }
}

impl SoftLoop {
    /// Frames before the present period that a pattern needs: those that are in use in its first period.
    pub(super) fn frames(&self) -> u32 {
        let before = if self.hold == SurfaceHold::First { 1 } else { 0 };
        1 + self.result_delay_periods + before
    }

    /// Those whose forces it needs.
    pub(super) fn frames_with_forces(&self) -> u32 {
        if self.kind == LocalModelKind::Compliance { 1 + self.result_delay_periods } else { 0 }
    }
}

fn registers(of: &SoftLoop, kind: Registers) -> Vec<Register> {
    let mut registers: Vec<Register> = Vec::new();
    for (world, touch) in of
        .worlds
        .iter()
        .enumerate()
        .flat_map(|(index, world)| world.touches.iter().map(move |touch| (index, touch)))
    {
        let Way::Samples(delay) = touch.way else { continue };
        let length = delay.samples(&of.network);
        let shared =
            registers.iter_mut().find(|register| kind == Registers::Shared && register.hand == touch.hand);
        if let Some(register) = shared {
            register.length = register.length.max(length);
            register.worlds.push(world);
        } else {
            registers.push(Register { hand: touch.hand, worlds: vec![world], length });
        }
    }
    registers
}
