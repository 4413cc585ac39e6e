//! Surfaces: STL and PLY in millimetres along the axes of the lab.

use super::names::check_extension;
use crate::error::PhantomError;
use crate::files::write_atomically;
use revolve_voxel::Mesh;
use std::path::Path;

/// Writes a surface as binary STL in millimetres; the header states the unit.
///
/// # Errors
/// [`PhantomError::Extension`] unless the path ends in `.stl`; [`PhantomError::File`].
pub fn write_stl(path: &Path, mesh: &Mesh) -> Result<(), PhantomError> {
    check_extension(path, "stl")?;
    let mesh = in_millimetres(mesh);
    write_atomically(path, |out| {
        mesh.write_stl(
            "heart-phantom; unit: mm; axes: x left, y posterior, z superior",
            out,
        )
    })
}

/// Writes a surface with normals as binary PLY in millimetres; PLY has no field for the unit.
///
/// # Errors
/// [`PhantomError::Extension`] unless the path ends in `.ply`; [`PhantomError::File`].
pub fn write_ply(path: &Path, mesh: &Mesh) -> Result<(), PhantomError> {
    check_extension(path, "ply")?;
    let mesh = in_millimetres(mesh);
    write_atomically(path, |out| mesh.write_ply(out))
}

/// Bytes of a surface as STL: a header, and 50 per triangle.
pub(crate) fn stl_bytes(mesh: &Mesh) -> u64 {
    84 + 50 * mesh.triangles.len() as u64
}

fn in_millimetres(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    for vertex in &mut mesh.vertices {
        *vertex *= 10.0;
    }
    mesh
}
