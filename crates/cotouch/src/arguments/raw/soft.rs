//! Flags of `soft`.

use clap::Subcommand;

use super::super::invocation::Soft;
use super::numbers::point;

#[derive(Debug, Subcommand)]
pub(super) enum SoftCommand {
    /// The joint static compliance of points of a soft object, m/N
    #[command(after_help = "\
Points are in the scene's frame: inside a tetrahedron the point of the material that is there, otherwise the nearest point \
of the surface within a millionth of the object's size. Row and column 3·i + axis belong to the i-th point: the displacement \
of the row's point for a force of 1 N at the column's.

Example:
  cotouch soft compliance soft-block --at 0.35,0.05,0.0375 --at 0.175,0.05,0.075")]
    Compliance {
        /// A built-in scene with a soft object, or a TOML file
        scene: String,
        /// A point, m; may be repeated
        #[arg(long, value_name = "X,Y,Z", value_parser = point, required = true, allow_hyphen_values = true)]
        at: Vec<glam::DVec3>,
    },
    /// Where a soft object comes to rest under gravity
    #[command(after_help = "\
Example, a block of jelly that sags:
  cotouch soft deflect soft-block --set gravity_m_per_s2=[0,0,-9.81] --at 0.35,0.05,0.0375")]
    Deflect {
        /// A built-in scene with a soft object, or a TOML file
        scene: String,
        /// A point whose displacement is wanted, m; may be repeated
        #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
        at: Vec<glam::DVec3>,
    },
}

impl SoftCommand {
    pub(super) fn lift(self) -> Soft {
        match self {
            Self::Compliance { scene, at } => Soft::Compliance { scene, at },
            Self::Deflect { scene, at } => Soft::Deflect { scene, at },
        }
    }
}
