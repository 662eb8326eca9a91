//! What hands do to find what a verdict does not tell.

use cotouch_scene::scene::{Action, Scene, SceneValues, User};
use cotouch_testkit::Random;
use glam::DVec3;

use super::scenes::Drawn;

/// Hands begin so long after the session does: the soft start is over, s.
const BEGIN_S: f64 = 0.4;
/// They excite the session for so long at most, and then press or let go, s.
const EXCITE_S: f64 = 2.0;
/// What they do then lasts as long as any run, s.
const TO_THE_END_S: f64 = 1e4;
/// Hands that come back do so for so long, s.
const RETURN_S: f64 = 2.0;
/// How fast a pointer goes to its place, s.
const POINTER_S: f64 = 0.15;
/// How fast one does that touches gently, s, and how deep it goes: what is squeezed harder slips away sooner, m.
const GENTLY_S: f64 = 0.6;
const GENTLY_M: f64 = 0.006;
/// How far from the surface fingers begin, and how deep a pointer draws them, m.
const DEEP_M: f64 = 0.015;

/// From which time on (s) hands do nothing but press or hold.
pub(super) const EXCITED_UNTIL_S: f64 = BEGIN_S + EXCITE_S + 0.5;

/// What the hands of a scene do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Policy {
    /// All press, each with another force.
    Press,
    /// One presses, and nobody else does anything.
    PressAlone,
    /// The fingers of one of the worst modes press, with hands held as in that mode.
    PressAimed(usize),
    /// They are thrown at the surface, and press.
    ThrowAimed(usize),
    /// All are thrown at the surface, and press.
    Throw,
    /// All touch and let go in a rhythm of their own, and press.
    Tap,
    /// One touches and lets go, the others press.
    TapBesidePresses,
    /// All push to and fro in the rhythm of the worst pole, and press.
    Swing,
    /// The same, let go, and press late.
    SwingAndReturn,
    /// One pushes to and fro in that rhythm, the others press.
    SwingBesidePresses,
    /// Pointers draw all to the surface and hold them there.
    Point,
    /// A pointer draws one to the surface, the others press.
    PointBesidePresses,
    /// Pointers draw all to the surface, along it, and hold them.
    Slide,
    /// Pointers draw all to the surface and away again.
    TouchAndLetGo,
    /// Pointers draw all to the middle of their sides, against each other through the centre, and hold them there.
    Squeeze,
    /// Pointers draw all to the middle of their sides, and they press there.
    PressCentred,
}

/// What the analysis tells those who try to prove it wrong.
pub(super) struct Known {
    /// The frequency of the worst pole, Hz.
    pub(super) hz: f64,
    /// The worst modes.
    pub(super) aims: Vec<Aim>,
    /// How long a run lasts, s.
    pub(super) seconds: f64,
}

/// A contact mode that hands try to bring about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Aim {
    /// For each user, for each finger, whether it touches.
    touches: Vec<Vec<bool>>,
    /// For each user, whether a pointer holds the hand.
    held: Vec<bool>,
}

impl Aim {
    /// Of a mode's contacts, as the analysis names them.
    pub(super) fn new(scene: &Scene, contacts: &[String]) -> Self {
        let names = |text: String| contacts.iter().any(|contact| contact.starts_with(&text));
        let touches = |user: &User| {
            (1..=user.fingers.len()).map(|finger| names(format!("{}.finger{finger}", user.name))).collect()
        };
        let held = |user: &User| names(format!("{}'s hand taken", user.name));
        Self {
            touches: scene.users.iter().map(touches).collect(),
            held: scene.users.iter().map(held).collect(),
        }
    }
}

/// The worst modes that hands aim at.
pub(super) const AIMS: usize = 3;

impl Policy {
    /// What finds most comes first.
    pub(super) const ALL: [Self; 20] = [
        Self::PressAimed(0),
        Self::Press,
        Self::Point,
        Self::ThrowAimed(0),
        Self::PressAlone,
        Self::Throw,
        Self::PressAimed(1),
        Self::PointBesidePresses,
        Self::Swing,
        Self::Tap,
        Self::ThrowAimed(1),
        Self::PressAimed(2),
        Self::ThrowAimed(2),
        Self::TapBesidePresses,
        Self::SwingBesidePresses,
        Self::SwingAndReturn,
        Self::Slide,
        Self::TouchAndLetGo,
        Self::Squeeze,
        Self::PressCentred,
    ];

    /// Whether hands themselves shake for a while: then only what shakes to the end counts.
    pub(super) fn is_rhythmic(self) -> bool {
        matches!(
            self,
            Self::Tap
                | Self::TapBesidePresses
                | Self::Swing
                | Self::SwingBesidePresses
                | Self::SwingAndReturn
        )
    }

    /// The scene with hands that do so. None where there is no such mode to aim at.
    pub(super) fn told(self, drawn: &Drawn, known: &Known, random: &mut Random) -> Option<Scene> {
        let aim = match self {
            Self::PressAimed(number) | Self::ThrowAimed(number) => Some(known.aims.get(number)?),
            _ => None,
        };
        let change = |scene: &mut SceneValues| {
            for (user, told) in scene.users.iter_mut().enumerate() {
                told.tracking = told.pointer_spring();
                for (number, finger) in told.fingers.iter_mut().enumerate() {
                    let hand =
                        Hand { user, at: finger.position_m, inward: drawn.inward[user][number], known };
                    finger.script = match aim {
                        Some(aim) => self.aimed(&hand, aim, number, random),
                        None => self.script(&hand, random),
                    };
                }
            }
        };
        Some(drawn.scene.edit(change).expect("hands may do so"))
    }

    /// A hand that is held is drawn to where it touches, or held where it does not.
    fn aimed(self, hand: &Hand, aim: &Aim, finger: usize, random: &mut Random) -> Vec<Action> {
        let is_held = aim.held[hand.user];
        let begin = match is_held {
            true => Action::Hold { duration_s: BEGIN_S },
            false => Action::Relax { duration_s: BEGIN_S },
        };
        let mut actions = vec![begin];
        actions.extend(match (aim.touches[hand.user][finger], self) {
            (false, _) if is_held => hand.hold(),
            (false, _) => hand.let_go(),
            (true, Self::ThrowAimed(_)) => {
                hand.throw(if is_held { hand.point() } else { hand.press() }, random)
            }
            (true, _) if is_held => hand.point(),
            (true, _) => hand.press(),
        });
        actions
    }

    fn script(self, hand: &Hand, random: &mut Random) -> Vec<Action> {
        let is_first = hand.user == 0;
        let mut actions = vec![Action::Relax { duration_s: BEGIN_S }];
        actions.extend(match self {
            Self::PressAlone if !is_first => hand.let_go(),
            Self::Throw => hand.throw(hand.press(), random),
            Self::Tap => hand.taps(random),
            Self::TapBesidePresses if is_first => hand.taps(random),
            Self::Swing => hand.swing(),
            Self::SwingBesidePresses if is_first => hand.swing(),
            Self::SwingAndReturn => hand.swing_and_return(),
            Self::Point => hand.point(),
            Self::PointBesidePresses if is_first => hand.point(),
            Self::Slide => hand.slide(),
            Self::TouchAndLetGo => hand.touch_and_let_go(),
            Self::Squeeze => hand.centred(hand.hold()),
            Self::PressCentred => hand.centred(hand.press()),
            _ => hand.press(),
        });
        actions
    }
}

/// A finger that is told what to do.
struct Hand<'a> {
    user: usize,
    at: DVec3,
    inward: DVec3,
    known: &'a Known,
}

impl Hand<'_> {
    /// A force into the surface, of which each user has an own one so that they do not cancel each other, N.
    fn force_n(&self) -> DVec3 {
        self.inward * (1.0 + 0.3 * self.user as f64)
    }

    fn press(&self) -> Vec<Action> {
        vec![Action::Force { force_n: self.force_n(), duration_s: TO_THE_END_S }]
    }

    fn let_go(&self) -> Vec<Action> {
        vec![Action::Relax { duration_s: TO_THE_END_S }]
    }

    fn hold(&self) -> Vec<Action> {
        vec![Action::Hold { duration_s: TO_THE_END_S }]
    }

    fn throw(&self, then: Vec<Action>, random: &mut Random) -> Vec<Action> {
        let force_n = 3.0 * self.force_n();
        let mut actions = vec![
            Action::Force { force_n, duration_s: 0.05 + 0.2 * random.unit() },
            Action::Relax { duration_s: 0.01 + 0.3 * random.unit() },
        ];
        actions.extend(then);
        actions
    }

    fn taps(&self, random: &mut Random) -> Vec<Action> {
        let duration_s = 1.0 / random.log_uniform(2.0, 20.0);
        self.rhythm(duration_s, 0.2 + 0.6 * random.unit(), self.press())
    }

    fn swing(&self) -> Vec<Action> {
        self.rhythm(1.0 / self.known.hz, 0.5, self.press())
    }

    /// What grew meanwhile without contact is felt when it is touched.
    fn swing_and_return(&self) -> Vec<Action> {
        let mut then = vec![Action::Relax { duration_s: self.known.seconds - EXCITED_UNTIL_S - RETURN_S }];
        then.extend(self.press());
        self.rhythm(1.0 / self.known.hz, 0.5, then)
    }

    fn rhythm(&self, duration_s: f64, share: f64, then: Vec<Action>) -> Vec<Action> {
        let push_s = share * duration_s;
        let tap = Action::PushAndLetGo { force_n: 2.0 * self.force_n(), push_s, duration_s };
        let mut actions = vec![tap; (EXCITE_S / duration_s) as usize];
        actions.extend(then);
        actions
    }

    fn reach(&self, to_m: DVec3) -> Action {
        Action::Reach { to_m, duration_s: POINTER_S }
    }

    fn deep(&self) -> DVec3 {
        self.at + self.inward * DEEP_M
    }

    fn point(&self) -> Vec<Action> {
        let mut actions = vec![self.reach(self.deep())];
        actions.extend(self.hold());
        actions
    }

    /// Away from the surface to above the middle of its side, along the axis next to its inward direction, and gently in.
    fn centred(&self, then: Vec<Action>) -> Vec<Action> {
        let axis = nearest_axis(self.inward);
        let above = axis * self.at.dot(axis);
        let mut actions = vec![
            self.reach(self.at - self.inward * DEEP_M),
            self.reach(above - axis * DEEP_M),
            Action::Reach { to_m: above + axis * GENTLY_M, duration_s: GENTLY_S },
        ];
        actions.extend(then);
        actions
    }

    fn slide(&self) -> Vec<Action> {
        let along = self.inward.cross(if self.inward.z.abs() < 0.9 { DVec3::Z } else { DVec3::X });
        let to = |share: f64| self.reach(self.deep() + along.normalize() * share * DEEP_M);
        let side = if self.user.is_multiple_of(2) { 1.0 } else { -1.0 };
        let mut actions = vec![to(0.0)];
        actions.extend((0..4).flat_map(|_| [to(side), to(-side)]));
        actions.extend(self.hold());
        actions
    }

    fn touch_and_let_go(&self) -> Vec<Action> {
        let mut actions: Vec<Action> =
            (0..4).flat_map(|_| [self.reach(self.deep()), self.reach(self.at)]).collect();
        actions.extend(self.hold());
        actions
    }
}

/// The unit vector along an axis that is next to a direction.
fn nearest_axis(direction: DVec3) -> DVec3 {
    let along = DVec3::AXES.map(|axis| axis * direction.dot(axis));
    let longest = along.into_iter().max_by(|one, other| one.length().total_cmp(&other.length()));
    longest.map_or(direction, DVec3::normalize)
}
