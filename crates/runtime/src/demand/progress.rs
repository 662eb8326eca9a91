//! How far all scripts of a session are.

use cotouch_device::{PlaceInScript, SimulatedUser};
use cotouch_scene::scene::{Action, Scene};

use super::shortening::{is_cut, scripts};

/// Repeated scripts are looked at so often: they meet those of others at other times again and again.
const PASSES: u32 = 3;

/// How far all scripts are, seen now and then.
pub(super) struct Progress {
    scripts: Vec<Followed>,
}

/// One script.
struct Followed {
    /// Which of its actions were cut.
    cut: Vec<bool>,
    /// Where it was when it was seen last.
    place: Option<PlaceInScript>,
    /// How often it has begun again.
    passes: u32,
}

/// What has happened to scripts since they were seen last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct News {
    /// One that does not repeat has gone on to another action.
    pub(super) goes_on: bool,
    /// An action that was cut has ended for the first time.
    pub(super) cut_ended: bool,
}

impl Progress {
    /// The scripts of `scene`, in which actions longer than `longest_s` are cut.
    pub(super) fn new(scene: &Scene, longest_s: f64) -> Self {
        let followed = |actions: &[Action]| Followed {
            cut: actions.iter().map(|action| is_cut(action, longest_s)).collect(),
            place: None,
            passes: 0,
        };
        Self { scripts: scripts(scene).map(followed).collect() }
    }

    /// Takes note of where scripts are, and says what is new.
    pub(super) fn observe<'a>(&mut self, users: impl Iterator<Item = &'a SimulatedUser>) -> News {
        let places = users.flat_map(SimulatedUser::places_in_scripts);
        let news = self.scripts.iter_mut().zip(places).map(|(script, place)| script.observe(place));
        news.fold(News::default(), |all, one| News {
            goes_on: all.goes_on || one.goes_on,
            cut_ended: all.cut_ended || one.cut_ended,
        })
    }

    /// Whether there is nothing more to see, where what moves is steady or not: of scripts that repeat that is not asked.
    pub(super) fn is_done(&self, steady: bool) -> bool {
        let repeats = self.scripts.iter().any(|script| script.place.is_some_and(|place| place.repeats));
        (repeats || steady) && self.scripts.iter().all(Followed::is_done)
    }
}

impl Followed {
    fn observe(&mut self, place: PlaceInScript) -> News {
        let Some(before) = self.place.replace(place).filter(|before| *before != place) else {
            return News::default();
        };
        let cut_ended = self.passes == 0 && self.is_cut(before.action);
        // One that is so short that it goes through unseen is counted when it is seen next.
        self.passes += u32::from(place.repeats && place.action <= before.action);
        News { goes_on: !place.repeats, cut_ended }
    }

    fn is_cut(&self, action: usize) -> bool {
        self.cut.get(action).is_some_and(|&cut| cut)
    }

    /// Whether it is over, or at the end of what is seen of it.
    fn is_done(&self) -> bool {
        self.place.is_some_and(|place| match place.repeats {
            true => self.passes >= PASSES,
            false => place.action >= self.cut.len() || place.is_last && self.is_cut(place.action),
        })
    }
}
