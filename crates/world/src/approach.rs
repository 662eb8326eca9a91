//! From which side a sphere came to a surface.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::proxy::ProxyState;

/// What a contact remembers between ticks to tell from which side its sphere came: a plain value.
///
/// The centre of a sphere may be beneath a surface, even beyond the other side of a thin body. Then the closest point
/// says nothing about where it came from, and this does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Approach {
    /// On a shape that has closed forms.
    Side(ApproachSide),
    /// On a triangle mesh.
    Mesh(ProxyState),
}

/// The side of a ball, capsule, box or hull.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ApproachSide {
    /// Whether `point` says anything.
    pub seen: bool,
    /// The face or feature above the centre, while the centre is beneath the surface.
    pub face: Option<u32>,
    /// Where the sphere's centre was when it was last outside, body frame, m.
    pub point: DVec3,
}

impl Default for Approach {
    fn default() -> Self {
        Self::Side(ApproachSide::default())
    }
}

impl Approach {
    /// The face above the centre, while the centre is beneath the surface; on a mesh the triangle in contact.
    #[must_use]
    pub fn face(&self) -> Option<u32> {
        match self {
            Self::Side(side) => side.face,
            Self::Mesh(proxy) => proxy.triangle(),
        }
    }

    /// On a shape that has closed forms; new if it was about a mesh.
    pub(crate) fn side(&self) -> ApproachSide {
        match self {
            Self::Side(side) => *side,
            Self::Mesh(_) => ApproachSide::default(),
        }
    }

    /// On a mesh; new if it was about another shape.
    pub(crate) fn mesh(&self) -> ProxyState {
        match self {
            Self::Side(_) => ProxyState::default(),
            Self::Mesh(proxy) => *proxy,
        }
    }
}
