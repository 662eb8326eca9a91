use super::check::Checked;
use super::error::DiagramError;
use nalgebra::DMatrix;
pub(crate) fn lift(checked: &Checked<'_>) -> Result<DMatrix<f64>, DiagramError> {
    Ok(super::stepping::lift(checked))
}
