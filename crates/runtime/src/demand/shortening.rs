//! Actions that go on and on, cut to the time in which they come to a steady state.
//!
//! Scripts of sessions that are watched relax, hold or swing for ten minutes. When everything is at rest or periodic, the rest of such an
//! action shows nothing new; it is left out, a whole number of periods of what swings. Whether that was so is looked at when
//! the action ends. What changes is when scripts meet: what comes after such an action comes sooner.

use cotouch_scene::scene::{Action, Scene, User};

/// No action is cut that is not longer, s.
const SHORTEST_S: f64 = 40.0;
/// The longest to which one is cut, s.
const LONGEST_S: f64 = 150.0;
/// A steady state is waited for so long after everything else has come to its end, s.
const STEADY_S: f64 = 25.0;

/// How long an action may last that changes nothing while it does, in this scene, s: until the others' scripts have come to their
/// ends, and the time that it takes to see that nothing changes any more.
pub(super) fn longest_action_s(scene: &Scene) -> f64 {
    let ends = scripts(scene).map(|actions| actions.iter().fold(0.0, end_s));
    (ends.fold(0.0, f64::max) + STEADY_S).clamp(SHORTEST_S, LONGEST_S)
}

/// When a script has done an action, given when it began, s; what can be cut counts as nothing.
fn end_s(began_s: f64, action: &Action) -> f64 {
    match *action {
        Action::WaitUntil { until_s } => began_s.max(until_s),
        _ if is_cut(action, SHORTEST_S) => began_s,
        _ => began_s + action.duration_s(),
    }
}

/// All scripts of a session, in the order in which [`SimulatedUser::places_in_scripts`] tells of them, host by host.
///
/// [`SimulatedUser::places_in_scripts`]: cotouch_device::SimulatedUser::places_in_scripts
pub(super) fn scripts(scene: &Scene) -> impl Iterator<Item = &[Action]> {
    scene.users.iter().flat_map(scripts_of)
}

fn scripts_of(user: &User) -> impl Iterator<Item = &[Action]> {
    let is_followed = user.fingers.iter().any(|finger| finger.script.is_empty());
    let own = user.fingers.iter().map(|finger| &finger.script[..]).filter(|script| !script.is_empty());
    is_followed.then_some(&user.script[..]).into_iter().chain(own)
}

/// Whether an action is cut where none may last longer than `longest_s`.
pub(super) fn is_cut(action: &Action, longest_s: f64) -> bool {
    period_s(action).is_some() && action.duration_s() > longest_s
}

/// Cuts all long actions of a user.
pub(super) fn shorten(user: &mut User, longest_s: f64) {
    let own = user.fingers.iter_mut().map(|finger| &mut finger.script);
    let actions = own.chain([&mut user.script]).flatten();
    actions.filter(|action| is_cut(action, longest_s)).for_each(|action| shorten_action(action, longest_s));
}

/// With what period an action does the same again and again, s: 0 where it does nothing but go on, `None` where it leads somewhere.
fn period_s(action: &Action) -> Option<f64> {
    match *action {
        Action::Relax { .. } | Action::Hold { .. } | Action::Force { .. } | Action::Tremor { .. } => {
            Some(0.0)
        }
        Action::Sinusoid { frequency_hz, .. } | Action::SinusoidalForce { frequency_hz, .. } => {
            Some(frequency_hz.recip()).filter(|period_s| period_s.is_finite())
        }
        _ => None,
    }
}

fn shorten_action(action: &mut Action, longest_s: f64) {
    let period_s = period_s(action).unwrap_or(0.0);
    match action {
        Action::Relax { duration_s }
        | Action::Hold { duration_s }
        | Action::Force { duration_s, .. }
        | Action::Tremor { duration_s, .. }
        | Action::Sinusoid { duration_s, .. }
        | Action::SinusoidalForce { duration_s, .. } => {
            let surplus_s = *duration_s - longest_s;
            *duration_s -= if period_s > 0.0 { (surplus_s / period_s).floor() * period_s } else { surplus_s };
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_swings_is_cut_by_whole_periods_and_what_leads_somewhere_is_not() {
        let cut = |mut action: Action| {
            if is_cut(&action, 40.0) {
                shorten_action(&mut action, 40.0);
            }
            action.duration_s()
        };
        let swing = |frequency_hz, duration_s| Action::SinusoidalForce {
            amplitude_n: glam::DVec3::X,
            frequency_hz,
            phase_rad: 0.3,
            duration_s,
        };
        assert_eq!(cut(Action::Relax { duration_s: 600.0 }), 40.0);
        assert_eq!(cut(Action::Hold { duration_s: 39.0 }), 39.0);
        assert_eq!(cut(swing(0.5, 600.5)), 40.5);
        assert_eq!(cut(swing(0.001, 600.5)), 600.5);
        assert_eq!(cut(Action::Reach { to_m: glam::DVec3::X, duration_s: 600.0 }), 600.0);
        assert_eq!(cut(Action::WaitUntil { until_s: 600.0 }), 600.0);
    }

    #[test]
    fn a_long_action_outlasts_what_others_do() {
        let script = |text: &str| {
            let text = format!(
                "[session]\nusers = 2\n[[user]]\ntracking.stiffness_n_per_m = 100\nscript = [{text}]\n[[user]]\nscript = [{{ do = \"relax\", duration_s = 600 }}]"
            );
            longest_action_s(&cotouch_scene::parse(&text, "test", None, &[]).unwrap())
        };
        assert_eq!(script(r#"{ do = "force", force_n = 1, duration_s = 600 }"#), 40.0);
        assert_eq!(
            script(r#"{ do = "wait-until", until_s = 30 }, { do = "force", force_n = 1, duration_s = 10 }"#),
            65.0
        );
    }
}
