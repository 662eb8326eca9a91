//! How users' hands are held to the ground: by what their scripts track, by a pointer on the page, or by nothing.

use cotouch_scene::scene::{Action, SceneValues, SpringDamper, User};

/// What holds a user's hand besides its own impedance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Hand {
    /// What the script says.
    #[default]
    Told,
    /// A pointer on the page, with [`User::pointer_spring`].
    Taken,
    /// Nothing: a device that only renders forces.
    OnDevice,
}

/// The ways in which a user's hand can be held that differ; as told first.
pub(super) fn ways(user: &User) -> Vec<Hand> {
    let (_, tracked) = springs(user);
    let differs = |spring: SpringDamper| tracked.iter().any(|&of_finger| of_finger != spring);
    let mut ways = vec![Hand::Told];
    ways.extend(differs(user.pointer_spring()).then_some(Hand::Taken));
    ways.extend(differs(SpringDamper::default()).then_some(Hand::OnDevice));
    ways
}

/// All hands held in one way, and, where these are no more than `most`, each way of one hand while the others are held as
/// told; without all as told.
pub(super) fn all_ways(users: &[User], most: f64) -> Vec<Vec<Hand>> {
    let ways: Vec<Vec<Hand>> = users.iter().map(ways).collect();
    let longest = ways.iter().map(Vec::len).max().unwrap_or(1);
    let together = (1..longest).map(|way| ways.iter().map(|ways| ways[way.min(ways.len() - 1)]).collect());
    let alone = ways.iter().enumerate().flat_map(|(user, ways)| {
        ways[1..].iter().map(move |&hand| {
            (0..users.len()).map(|other| if other == user { hand } else { Hand::Told }).collect()
        })
    });
    let alone: Vec<Vec<Hand>> = alone.collect();
    let alone = if alone.len() as f64 <= most { alone } else { Vec::new() };
    together.chain(alone).collect()
}

/// The scene with hands that are held so, for compiling only: what scripts press with is part of an operating point.
pub(super) fn held(scene: &SceneValues, hands: &[Hand]) -> SceneValues {
    let mut held = scene.clone();
    for (user, hand) in held.users.iter_mut().zip(hands).filter(|(_, hand)| **hand != Hand::Told) {
        user.fingers.iter_mut().for_each(|finger| finger.script.clear());
        user.script.clear();
        if *hand == Hand::Taken {
            user.tracking = user.pointer_spring();
            user.script.push(Action::Hold { duration_s: 1.0 });
        }
    }
    held
}

/// What users' hands have besides their script's events, finger by finger.
pub(super) fn springs(user: &User) -> (SpringDamper, Vec<SpringDamper>) {
    (user.pointer_spring(), (0..user.fingers.len()).map(|finger| user.tracking_of(finger)).collect())
}
