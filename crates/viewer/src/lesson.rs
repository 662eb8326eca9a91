//! The lesson of a session: what it is set to, and what it would be with other settings.

use std::sync::Mutex;

use cotouch_runtime::LiveSession;
use cotouch_scene::builtin;
use cotouch_scene::scene::Scene;

use crate::control::Control;
use crate::controls;
use crate::lock::lock;
use crate::protocol::{MapAxes, MapAxis};
use crate::setting::{Setting, Settings, shortened};
use crate::settings::{ARCHITECTURE, Base, Chosen, SCENE, family_of};

/// Most values along an axis of a map, and on a map.
const MAX_VALUES: usize = 200;
const MAX_POINTS: usize = 20_000;

/// See the module. Without a base nothing can be set or predicted.
pub(crate) struct Lesson {
    present: Option<Mutex<Present>>,
}

/// What the session is set to.
#[derive(Clone)]
pub(crate) struct Present {
    pub(crate) chosen: Chosen,
    pub(crate) scene: Scene,
    /// What the session does differently from what was asked for.
    pub(crate) note: String,
}

impl Lesson {
    /// The lesson of `live`, which runs the scene of `base`.
    pub(crate) fn new(live: &LiveSession, base: Option<Base>) -> Self {
        let present = base.and_then(|base| {
            let plain = Chosen::new(base.clone(), Settings::new()).open().ok()?;
            // What the session's packets meet was not said in the scene.
            let chosen = Chosen::new(base, impairment_besides(&plain, &live.scene().0));
            let scene = chosen.open().ok()?;
            let note = live.as_it_would_run(&scene).1.unwrap_or_default();
            Some(Mutex::new(Present { chosen, scene, note }))
        });
        Self { present }
    }

    /// The controls of what is set.
    pub(crate) fn controls(&self) -> Vec<Control> {
        let Some(present) = self.present() else { return Vec::new() };
        controls::controls(&present.chosen, &present.scene)
    }

    /// What `controls` are set to, with what the session does differently.
    pub(crate) fn settings(&self, controls: &[Control]) -> (Settings, String) {
        let Some(present) = &self.present else { return (Settings::new(), String::new()) };
        let present = lock(present);
        (controls::values(controls, &present.chosen, &present.scene), present.note.clone())
    }

    /// A copy of what is set; nothing where nothing can be.
    pub(crate) fn present(&self) -> Option<Present> {
        self.present.as_ref().map(|present| lock(present).clone())
    }

    pub(crate) fn replace(&self, next: Present) {
        if let Some(present) = &self.present {
            *lock(present) = next;
        }
    }
}

impl Present {
    /// With `settings` changed: `present_controls` are those of what is set at present. Or what is wrong, in words.
    pub(crate) fn with(
        &self,
        settings: &Settings,
        present_controls: &[Control],
        live: &LiveSession,
    ) -> Result<(Self, Vec<Control>), String> {
        is_a_scene(settings, self.chosen.first())?;
        let mut chosen = self.chosen.with(settings);
        let choices = [SCENE, ARCHITECTURE].map(|key| settings.get(key));
        let controls = if choices.iter().all(Option::is_none) {
            controls::check(present_controls, settings)?;
            present_controls.to_vec()
        } else {
            // Of the scene without the numbers, so that nothing that was not checked is used.
            let plain = chosen.plain();
            let controls = controls::controls(&plain, &plain.open()?);
            controls::check(&controls, settings)?;
            // What was set of the network before, in another scene, stays where it fits.
            chosen = chosen.fitting(settings, |key, setting| {
                let alone = Settings::from([(key.to_owned(), setting.clone())]);
                controls.iter().all(|control| control.key != key)
                    || controls::check(&controls, &alone).is_ok()
            });
            controls
        };
        let scene = chosen.open()?;
        let note = live.as_it_would_run(&scene).1.unwrap_or_default();
        Ok((Self { chosen, scene, note }, controls))
    }
}

/// Refuses to open what is no scene of the lesson: neither built in nor the one that it began with.
fn is_a_scene(settings: &Settings, first: &str) -> Result<(), String> {
    let Some(Setting::Choice(name)) = settings.get(SCENE) else { return Ok(()) };
    if name == first || builtin::names().any(|known| known == name && family_of(known) == known) {
        return Ok(());
    }
    let names: Vec<&str> = builtin::names().filter(|name| family_of(name) == *name).collect();
    Err(format!("there is no scene \"{}\" here; there are {}", shortened(name, 60), names.join(", ")))
}

/// Refuses a map that no control asks for, or that is too large.
pub(crate) fn check_map(axes: &MapAxes, controls: &[Control]) -> Result<(), String> {
    check_axis(&axes.x, controls)?;
    check_axis(&axes.y, controls)?;
    if axes.x.key == axes.y.key {
        return Err("the two axes of a map must be different settings".to_owned());
    }
    if axes.x.count * axes.y.count > MAX_POINTS {
        return Err(format!("a map can have at most {MAX_POINTS} points"));
    }
    Ok(())
}

fn check_axis(axis: &MapAxis, controls: &[Control]) -> Result<(), String> {
    let MapAxis { ref key, from, to, count, log } = *axis;
    let is_number = |control: &&Control| control.key == key && control.choices.is_empty();
    if !controls.iter().any(|control| is_number(&control)) {
        return Err(format!("a map can have no axis \"{}\" in this scene", shortened(key, 60)));
    }
    if !(2..=MAX_VALUES).contains(&count) {
        return Err(format!("an axis of a map has 2 to {MAX_VALUES} values, not {count}"));
    }
    if from >= to || (log && from <= 0.0) {
        return Err(format!(
            "an axis of a map must go up, on a logarithm from above 0; this goes from {from} to {to}"
        ));
    }
    Ok(())
}

/// What `running` meets on its links besides what `scene` says.
fn impairment_besides(scene: &Scene, running: &Scene) -> Settings {
    let keys = ["latency_s", "jitter_s", "loss_rate", "loss_burst_packets", "reorder_rate", "duplicate_rate"];
    let keys = keys
        .into_iter()
        .chain(["rate_limit_bytes_per_s", "outage_from_s", "outage_duration_s"])
        .map(|key| format!("link.impairment.{key}"));
    keys.filter_map(|key| {
        let number = running.number(&key).filter(|number| scene.number(&key) != Some(*number))?;
        Some((key, Setting::Number(number)))
    })
    .collect()
}
