//! What a host lets its devices render, whatever a scene from elsewhere asks for.

use cotouch_scene::scene::{GovernorLimits, Scene};

/// A ceiling for `governor.max_force_n` and `governor.max_slew_n_per_s`: of the user's own scene, of the command line, or the
/// built-in one. A scene that came over the network or from a page is run, recorded and predicted with no more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnLimits {
    max_force_n: f64,
    /// Where it is a limit: else the largest force may come in one tick.
    max_slew_n_per_s: Option<f64>,
}

impl OwnLimits {
    /// Where nobody said anything: the default of `governor.max_force_n`.
    pub const BUILT_IN: Self = Self::max_force(20.0);

    /// No more than `newtons`, which may come in one tick.
    #[must_use]
    pub const fn max_force(newtons: f64) -> Self {
        Self { max_force_n: newtons, max_slew_n_per_s: None }
    }

    /// Those of a scene that is the user's own.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let GovernorLimits { max_force_n, max_slew_n_per_s, .. } = scene.governor;
        let is_limit = max_slew_n_per_s < in_one_tick_n_per_s(scene, max_force_n);
        Self { max_force_n, max_slew_n_per_s: is_limit.then_some(max_slew_n_per_s) }
    }

    /// `scene` with no more than is allowed.
    #[must_use]
    pub fn apply(&self, scene: &Scene) -> Scene {
        let max_force_n = self.max_force_n;
        let max_slew = self.max_slew_n_per_s.unwrap_or_else(|| in_one_tick_n_per_s(scene, max_force_n));
        let limit = |governor: &mut GovernorLimits| {
            governor.max_force_n = governor.max_force_n.min(max_force_n);
            governor.max_slew_n_per_s = governor.max_slew_n_per_s.min(max_slew);
        };
        scene
            .edit(|scene| limit(&mut scene.governor))
            .expect("limits of a scene or of the command line are allowed")
    }

    /// What `scene` asks for and does not get, in words.
    #[must_use]
    pub fn refusal(&self, scene: &Scene) -> Option<String> {
        let given = self.apply(scene);
        let (asked, given) = (&scene.governor, &given.governor);
        if asked.max_force_n > given.max_force_n {
            return Some(format!(
                "the scene asks for {} N (governor.max_force_n), this host allows {} N",
                asked.max_force_n, given.max_force_n
            ));
        }
        (asked.max_slew_n_per_s > given.max_slew_n_per_s).then(|| {
            format!(
                "the scene asks for {} N/s (governor.max_slew_n_per_s), this host allows {} N/s",
                asked.max_slew_n_per_s, given.max_slew_n_per_s
            )
        })
    }
}

/// The slew at which this force comes in one tick, N/s: no limit at all.
fn in_one_tick_n_per_s(scene: &Scene, force_n: f64) -> f64 {
    force_n * scene.rates.control_hz.hz()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(set: &[&str]) -> Scene {
        let set: Vec<_> = set.iter().map(|set| set.parse().unwrap()).collect();
        cotouch_scene::load("single-axis", &set).unwrap()
    }

    #[test]
    fn a_scene_never_raises_what_is_allowed_and_may_ask_for_less() {
        let greedy = scene(&["governor.max_force_n=1000", "governor.max_slew_n_per_s=1e9"]);
        let given = OwnLimits::BUILT_IN.apply(&greedy);
        let given = (given.governor.max_force_n, given.governor.max_slew_n_per_s);
        assert_eq!(given, (20.0, 20.0 * 1024.0));
        let refusal = OwnLimits::BUILT_IN.refusal(&greedy).unwrap();
        assert_eq!(refusal, "the scene asks for 1000 N (governor.max_force_n), this host allows 20 N");

        let modest = scene(&["governor.max_force_n=3", "governor.max_slew_n_per_s=100"]);
        assert_eq!(OwnLimits::BUILT_IN.apply(&modest), modest);
        assert_eq!(OwnLimits::BUILT_IN.refusal(&modest), None);
        let own = OwnLimits::of(&modest);
        assert_eq!(own.apply(&greedy).governor.max_slew_n_per_s, 100.0);
        let fast = scene(&["governor.max_force_n=3", "governor.max_slew_n_per_s=200"]);
        assert_eq!(
            own.refusal(&fast).unwrap(),
            "the scene asks for 200 N/s (governor.max_slew_n_per_s), this host allows 100 N/s"
        );
    }

    #[test]
    fn the_built_in_limit_is_the_default_of_scenes_and_takes_nothing_from_built_in_ones() {
        assert_eq!(OwnLimits::BUILT_IN.max_force_n, scene(&[]).governor.max_force_n);
        for name in cotouch_scene::builtin::names() {
            let scene = cotouch_scene::load(name, &[]).unwrap();
            assert_eq!(OwnLimits::BUILT_IN.apply(&scene), scene, "{name}");
        }
    }
}
