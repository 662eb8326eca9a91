//! The keys of a shape and of where it stands: the same in `[object]` and in `[[body]]`.

/// `shape`.
macro_rules! kind {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Choice(crate::scene::ShapeKind::WORDS), Is("point"), "", "Point: no surface, every finger is coupled to the centre; the others are touched from outside.", at!($($field).+))
    };
}
/// `size_m`.
macro_rules! size {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Vector { max: 10.0 }, Is("0"), "m", "Edges of a box along its x, y and z axis.", at!($($field).+))
    };
}
/// `radius_m`.
macro_rules! radius {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Number { min: 0.0, max: 10.0 }, Is("0"), "m", "Of a ball or a capsule.", at!($($field).+))
    };
}
/// `length_m`.
macro_rules! length {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Number { min: 0.0, max: 10.0 }, Is("0"), "m", "Between the centres of a capsule's two ends, along its y axis.", at!($($field).+))
    };
}
/// `mesh`.
macro_rules! mesh {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Text { min: 0, max: 4096 }, Is(""), "", "File of a hull or mesh: .stl, .obj, .gltf or .glb, from the scene's folder; its centre of mass becomes the body's origin.", at!($($field).+))
    };
}
/// `mesh_scale`.
macro_rules! mesh_scale {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Number { min: 1e-6, max: 1e6 }, Is("1"), "", "Metres in one unit of the mesh file.", at!($($field).+))
    };
}
/// `position_m`.
macro_rules! position {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Vector { max: 10.0 }, Is("0"), "m", "Where the centre of mass is at the start.", at!($($field).+))
    };
}
/// `rotation_rad`.
macro_rules! rotation {
    ($name:literal, $($field:ident).+) => {
        Key::new($name, Kind::Vector { max: 100.0 }, Is("0"), "rad", "How it is turned at the start: about this vector, by its length.", at!($($field).+))
    };
}
pub(crate) use {kind, length, mesh, mesh_scale, position, radius, rotation, size};
