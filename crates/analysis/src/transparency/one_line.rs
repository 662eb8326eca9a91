//! A scene as chapter 6 of Fotoohi Ghiam 2006 looks at it: on one line, with users' forces as inputs.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{SceneValues, Space, SpringDamper, User, WallSides};
use serde::Serialize;

use crate::compile::{along_normal, compile};
use crate::loop_spec::LoopSpec;
use crate::operating_point::{Settled, has_surface};

/// How a scene came to lie on one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reduction {
    /// It is on a line as it is.
    None,
    /// [`along_normal`]: along the direction in which fingers press, all on the centre of the first body.
    AlongNormal,
}

/// A scene on one line; its contacts are closed for good.
pub(super) struct OneLine {
    pub(super) scene: SceneValues,
    pub(super) reduction: Reduction,
    /// What was left out or changed, in plain sentences.
    pub(super) notes: Vec<String>,
}

impl OneLine {
    /// In free motion.
    pub(super) fn free(scene: &SceneValues) -> Self {
        let mut line = Self::of(scene);
        if scene.wall.exists() {
            line.notes.push("The scene has a wall; this is about free motion, away from it.".to_owned());
        }
        line.scene.wall.stiffness_n_per_m = 0.0;
        line.scene.wall.damping_n_s_per_m = 0.0;
        line
    }

    /// Against the wall, if there is one.
    pub(super) fn at_wall(scene: &SceneValues) -> Self {
        let mut line = Self::of(scene);
        let wall = &mut line.scene.wall;
        *wall = scene.wall.clone();
        wall.sides = WallSides::Two;
        wall.planes.clear();
        if line.reduction == Reduction::AlongNormal && scene.wall.exists() {
            let corners = corners_at_first_wall(scene);
            wall.stiffness_n_per_m *= corners as f64;
            wall.damping_n_s_per_m *= corners as f64;
            line.notes.push(format!(
                "The first body is against a wall, with {corners} of its corners at once; each has the wall's spring and \
                 damper."
            ));
        }
        line
    }

    fn of(scene: &SceneValues) -> Self {
        let bodies = scene.world_bodies();
        let is_line = scene.space == Space::Line && bodies.len() == 1 && !has_surface(&bodies[0].shape);
        let (scene, reduction) = if is_line {
            (scene.clone(), Reduction::None)
        } else {
            (along_normal(scene), Reduction::AlongNormal)
        };
        let mut notes = Vec::new();
        if reduction == Reduction::AlongNormal {
            notes.push(
                "All fingers are coupled to the centre of the first body by the normal springs and dampers, along one line."
                    .to_owned(),
            );
        }
        let (scene, note) = without_tracking(&scene);
        notes.extend(note);
        Self { scene, reduction, notes }
    }

    /// The one loop.
    pub(super) fn spec(&self) -> LoopSpec {
        compile(&self.scene).swap_remove(0).spec
    }
}

/// A scene without the springs by which scripts make fingers follow a path, and a note where it had some.
pub(super) fn without_tracking(scene: &SceneValues) -> (SceneValues, Option<String>) {
    let note = scene.users.iter().any(tracks).then(|| {
        "The springs by which scripts make fingers follow a path are part of the users' forces and left out."
            .to_owned()
    });
    let mut scene = scene.clone();
    for user in &mut scene.users {
        user.tracking = SpringDamper::default();
    }
    (scene, note)
}

fn tracks(user: &User) -> bool {
    (0..user.fingers.len()).any(|finger| user.tracking_of(finger) != SpringDamper::default())
}

/// How many corners of the first body lie against a wall at once; 1 where it has none.
fn corners_at_first_wall(scene: &SceneValues) -> usize {
    let settled = Settled::of(scene);
    let at = |lean: usize| {
        let point = settled.point(scene, &[], &[lean]);
        point.corners.iter().filter(|at| at.host == HostIndex::FIRST && at.body == 0).count()
    };
    (0..settled.leans.len()).map(at).find(|&corners| corners > 0).unwrap_or(1)
}

/// Of one user; all have as many.
pub(super) fn fingers(scene: &SceneValues) -> f64 {
    scene.users.first().map_or(1.0, |user| user.fingers.len() as f64)
}
