//! A session with other settings: which scene that is.

use cotouch_scene::scene::{Architecture, Scene};
use cotouch_scene::{Override, builtin};

use crate::setting::{Setting, Settings};

/// The control that chooses a scene.
pub(crate) const SCENE: &str = "scene";
/// The control that chooses an architecture.
pub(crate) const ARCHITECTURE: &str = "session.architecture";
/// What the name of a built-in scene's centralized twin ends in.
const TWIN: &str = "-centralized";

/// Where the scene of a session comes from, so that it can be had with other settings.
#[derive(Clone, Debug)]
pub struct Base {
    /// A built-in scene or a file.
    pub scene: String,
    /// What `--set` said on the command line.
    pub overrides: Vec<Override>,
}

/// What has been set so far, on top of a base.
#[derive(Clone, Debug)]
pub(crate) struct Chosen {
    base: Base,
    /// Only what differs from the scene's own.
    settings: Settings,
}

impl Chosen {
    pub(crate) fn new(base: Base, settings: Settings) -> Self {
        Self { base, settings }
    }

    /// The name of the scene without that of its architecture.
    pub(crate) fn family(&self) -> &str {
        match self.settings.get(SCENE) {
            Some(Setting::Choice(name)) => name,
            _ => family_of(&self.base.scene),
        }
    }

    /// The same of the scene that the session began with.
    pub(crate) fn first(&self) -> &str {
        family_of(&self.base.scene)
    }

    /// With `more` set too. Another scene or architecture has couplings of its own: what was set of these is forgotten,
    /// while the network stays as it is.
    pub(crate) fn with(&self, more: &Settings) -> Self {
        let mut next = self.clone();
        let changes = |key: &str| more.get(key).is_some_and(|setting| *setting != self.present(key));
        if changes(SCENE) {
            next.settings.retain(|key, _| is_of_the_network(key));
        } else if changes(ARCHITECTURE) {
            next.settings.retain(|key, _| is_of_the_network(key) || key == SCENE || key == "session.users");
        }
        next.settings.extend(more.iter().map(|(key, setting)| (key.clone(), setting.clone())));
        next
    }

    /// What one of the two choices is at present, whether it was set or not.
    fn present(&self, key: &str) -> Setting {
        if let Some(setting) = self.settings.get(key) {
            return setting.clone();
        }
        Setting::Choice(match key {
            SCENE => self.family().to_owned(),
            _ => self.open().map_or_else(|_| String::new(), |scene| architecture(&scene).to_owned()),
        })
    }

    /// Without what does not fit the scene any more, besides what is `asked`: what `fits` refuses, and what the scene does not
    /// allow together with the rest.
    pub(crate) fn fitting(&self, asked: &Settings, fits: impl Fn(&str, &Setting) -> bool) -> Self {
        let mut fitting = self.plain();
        fitting.settings.extend(asked.clone());
        for (key, setting) in self.settings.iter().filter(|(key, setting)| fits(key, setting)) {
            let mut more = fitting.clone();
            more.settings.entry(key.clone()).or_insert_with(|| setting.clone());
            if more.open().is_ok() {
                fitting = more;
            }
        }
        fitting
    }

    /// The scene with these settings, or what is wrong with them, in words.
    pub(crate) fn open(&self) -> Result<Scene, String> {
        let (name, is_twin) = self.name();
        let mut overrides = Vec::new();
        if family_of(&name) == family_of(&self.base.scene) {
            overrides.extend(self.base.overrides.iter().cloned());
        }
        for (key, setting) in &self.settings {
            if key != SCENE && !(is_twin && key == ARCHITECTURE) {
                overrides.push(as_override(key, setting)?);
            }
        }
        cotouch_scene::load(&name, &overrides).map_err(|errors| errors.to_string().trim().replace('\n', "; "))
    }

    /// The scene as its own text has it: what sliders are centred about.
    pub(crate) fn plain(&self) -> Self {
        let mut plain = self.clone();
        plain.settings.retain(|key, _| [SCENE, ARCHITECTURE].contains(&key.as_str()));
        plain
    }

    /// The scene to load, and whether its name says its architecture.
    fn name(&self) -> (String, bool) {
        let family = self.family();
        let twin = format!("{family}{TWIN}");
        if builtin::source(&twin).is_none() {
            let is_base = !self.settings.contains_key(SCENE);
            return (if is_base { self.base.scene.clone() } else { family.to_owned() }, false);
        }
        let is_centralized = match self.settings.get(ARCHITECTURE) {
            Some(Setting::Choice(word)) => word == "centralized",
            _ => !self.settings.contains_key(SCENE) && self.base.scene == twin,
        };
        (if is_centralized { twin } else { family.to_owned() }, true)
    }
}

/// The built-in scenes of which there is one for each architecture are one family.
pub(crate) fn family_of(name: &str) -> &str {
    name.strip_suffix(TWIN).filter(|family| builtin::source(family).is_some()).unwrap_or(name)
}

/// The word for a scene's architecture.
pub(crate) fn architecture(scene: &Scene) -> &'static str {
    match scene.session.architecture {
        Architecture::Centralized => "centralized",
        Architecture::Distributed => "distributed",
    }
}

fn is_of_the_network(key: &str) -> bool {
    key.starts_with("link.") || key.starts_with("rates.")
}

fn as_override(key: &str, setting: &Setting) -> Result<Override, String> {
    match setting {
        Setting::Number(number) => Ok(Override::number(key, *number)),
        Setting::Choice(word) => {
            format!("{key}={word}").parse().map_err(|_| format!("{key} cannot be \"{word}\""))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(scene: &str) -> Chosen {
        Chosen::new(Base { scene: scene.to_owned(), overrides: Vec::new() }, Settings::new())
    }

    fn settings<const N: usize>(of: [(&str, Setting); N]) -> Settings {
        of.into_iter().map(|(key, setting)| (key.to_owned(), setting)).collect()
    }

    fn choice(word: &str) -> Setting {
        Setting::Choice(word.to_owned())
    }

    const STIFFNESS: &str = "coupling.object_object.stiffness_n_per_m";

    #[test]
    fn numbers_and_choices_are_set() {
        let set = chosen("single-axis").with(&settings([
            (STIFFNESS, Setting::Number(1234.5)),
            ("rates.network_hz", choice("64")),
            ("session.users", Setting::Number(3.0)),
        ]));
        let scene = set.open().unwrap();
        assert_eq!(scene.coupling.object_object.stiffness_n_per_m, 1234.5);
        assert_eq!(scene.rates.network_hz.hz(), 64.0);
        assert_eq!(scene.session.users, 3);
    }

    #[test]
    fn a_scene_with_a_twin_takes_the_twins_couplings() {
        let set = chosen("single-axis").with(&settings([
            (STIFFNESS, Setting::Number(900.0)),
            ("link.delay_periods", Setting::Number(3.0)),
        ]));
        let central = set.with(&settings([(ARCHITECTURE, choice("centralized"))])).open().unwrap();
        let twin = cotouch_scene::load("single-axis-centralized", &[]).unwrap();
        assert_eq!(central.coupling, twin.coupling);
        assert_eq!(central.link.delay_periods, 3);
        let back = chosen("single-axis-centralized").with(&settings([(ARCHITECTURE, choice("distributed"))]));
        assert_eq!(back.open().unwrap(), cotouch_scene::load("single-axis", &[]).unwrap());
    }

    #[test]
    fn what_was_set_stays_until_the_scene_is_another_one() {
        let set = chosen("single-axis").with(&settings([(STIFFNESS, Setting::Number(900.0))]));
        let same =
            set.with(&settings([(SCENE, choice("single-axis")), ("session.users", Setting::Number(3.0))]));
        assert_eq!(same.open().unwrap().coupling.object_object.stiffness_n_per_m, 900.0);
        let grasp = set.with(&settings([(SCENE, choice("grasp"))])).open().unwrap();
        assert_eq!(grasp, cotouch_scene::load("grasp", &[]).unwrap());
    }

    #[test]
    fn what_does_not_fit_another_scene_is_left_behind() {
        let set = chosen("single-axis").with(&settings([
            ("link.delay_periods", Setting::Number(3.0)),
            ("rates.network_hz", choice("64")),
        ]));
        let asked = settings([(SCENE, choice("balloon"))]);
        let is_delay = |key: &str, _: &Setting| key == "link.delay_periods";
        let balloon = set.with(&asked).fitting(&asked, is_delay).open().unwrap();
        let own = cotouch_scene::load("balloon", &[]).unwrap();
        assert_eq!((balloon.link.delay_periods, &balloon.rates), (3, &own.rates));
        let wrong = settings([(SCENE, choice("balloon")), (STIFFNESS, Setting::Number(-1.0))]);
        assert!(
            set.with(&wrong).fitting(&wrong, |_, _| true).open().is_err(),
            "what is asked is not dropped"
        );
    }

    #[test]
    fn overrides_of_the_command_line_count_for_its_scene_only() {
        let heavy: Override = "object.mass_kg=2".parse().unwrap();
        let base = Base { scene: "single-axis".to_owned(), overrides: vec![heavy] };
        let chosen = Chosen::new(base, Settings::new());
        assert_eq!(chosen.open().unwrap().object.mass_kg, 2.0);
        let other = chosen.with(&settings([(SCENE, choice("grasp"))]));
        assert_eq!(other.open().unwrap().object.mass_kg, 0.4);
    }

    #[test]
    fn what_is_wrong_is_said_in_words() {
        let wrong = chosen("single-axis").with(&settings([(STIFFNESS, Setting::Number(-5.0))]));
        let error = wrong.open().unwrap_err();
        assert!(error.contains(STIFFNESS) && error.contains("must be a number from 0"), "{error}");
    }
}
