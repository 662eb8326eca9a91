//! Added damping of turning: the simplified model of Fig 6.3 with moments of inertia, which needs no contact point.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Object, SceneValues, Space, SpringDamper};
use glam::{DQuat, DVec3};
use nalgebra::Matrix3;
use serde::Serialize;

use super::error::TransparencyError;
use super::one_line::OneLine;
use super::viscous::Compensated;
use crate::operating_point::has_surface;

/// About one axis, by the simplified model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TurningDamping {
    /// A principal axis of the first body through its centre of mass, in the world as the body is at the start.
    pub axis: [f64; 3],
    /// J about it.
    pub inertia_kg_m2: f64,
    /// (6.2) with torque and angular velocity.
    pub simplified_damping_n_m_s_per_rad: Option<f64>,
    /// Of the copies that nobody holds: the real pole nearest 1 that is not 1 by structure.
    pub drag_pole: Option<f64>,
    /// `object.rotational_damping_n_m_s_per_rad` that cancels the simplified damping, as Fotoohi Ghiam 2006 proposes.
    pub compensation_n_m_s_per_rad: Option<f64>,
    /// What remains with it.
    pub damping_if_compensated_n_m_s_per_rad: Option<f64>,
    /// The drag pole with it.
    pub drag_pole_if_compensated: Option<f64>,
}

/// About each axis about which the first body of a scene turns.
pub(super) fn about_axes(
    scene: &SceneValues,
    user: HostIndex,
) -> Result<Vec<TurningDamping>, TransparencyError> {
    axes(scene).into_iter().map(|(axis, inertia)| about(scene, user, axis, inertia)).collect()
}

/// A turn is a motion along a line whose mass is J and whose coupler between copies is the rotational one.
fn about(
    scene: &SceneValues,
    user: HostIndex,
    axis: DVec3,
    inertia_kg_m2: f64,
) -> Result<TurningDamping, TransparencyError> {
    let mut line = OneLine::free(scene).scene;
    let coupler = scene.coupling.object_object_rotational;
    line.object = Object {
        mass_kg: inertia_kg_m2,
        damping_n_s_per_m: scene.object.rotational_damping_n_m_s_per_rad,
        ..Object::default()
    };
    line.coupling.object_object = SpringDamper {
        stiffness_n_per_m: coupler.stiffness_n_m_per_rad,
        damping_n_s_per_m: coupler.damping_n_m_s_per_rad,
    };
    let Compensated { before, compensation, after } = Compensated::of_copies(&line, user)?;
    Ok(TurningDamping {
        axis: axis.to_array(),
        inertia_kg_m2,
        simplified_damping_n_m_s_per_rad: before.simplified,
        drag_pole: before.drag_pole,
        compensation_n_m_s_per_rad: compensation,
        damping_if_compensated_n_m_s_per_rad: after.and_then(|after| after.simplified),
        drag_pole_if_compensated: after.and_then(|after| after.drag_pole),
    })
}

/// Principal axes (world) and moments of inertia (kg·m²) of the first body's turns.
fn axes(scene: &SceneValues) -> Vec<(DVec3, f64)> {
    let Some(body) = scene.world_bodies().into_iter().next() else { return Vec::new() };
    if !has_surface(&body.shape) || body.fixed {
        return Vec::new();
    }
    let turn = DQuat::from_scaled_axis(body.rotation_rad);
    let inertia = body.shape.mass_properties(body.mass_kg).inertia_kg_m2;
    match scene.space {
        Space::Line => Vec::new(),
        Space::Plane => {
            let about_z = turn.conjugate() * DVec3::Z;
            vec![(DVec3::Z, about_z.dot(inertia * about_z))]
        }
        Space::Space => {
            let off_diagonal = [inertia.x_axis.y, inertia.x_axis.z, inertia.y_axis.z];
            if off_diagonal == [0.0; 3] {
                let moments = [inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z];
                return DVec3::AXES.into_iter().map(|axis| turn * axis).zip(moments).collect();
            }
            let principal = Matrix3::from_fn(|row, column| inertia.col(column)[row]).symmetric_eigen();
            let axis = |index: usize| {
                let vector = principal.eigenvectors.column(index);
                turn * DVec3::new(vector[0], vector[1], vector[2])
            };
            (0..3).map(|index| (axis(index), principal.eigenvalues[index])).collect()
        }
    }
}
