//! The bytes of mesh files, within a budget.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use super::error::MeshError;

/// Longest mesh file, in bytes.
pub(crate) const LONGEST_FILE: u64 = 1 << 28;

/// The bytes of a regular file.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, MeshError> {
    let unreadable = |error: std::io::Error| MeshError::Unreadable(error.to_string());
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(MeshError::Unreadable("it is not a regular file".to_owned()));
    }
    let mut bytes = Vec::new();
    File::open(path)
        .map_err(unreadable)?
        .take(LONGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > LONGEST_FILE {
        return Err(MeshError::Unreadable(format!("it is longer than {LONGEST_FILE} bytes")));
    }
    Ok(bytes)
}
