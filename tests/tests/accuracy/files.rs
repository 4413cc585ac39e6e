//! Files: surfaces.

use crate::Row;
use heart_phantom::Phantom;
use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{Mode, Scene};
use tests::Random;

pub(crate) const ROWS: &[Row] = &[Row {
    name: "heart_phantom::Output::mesh_tolerance",
    what: "volume enclosed by a surface mesh",
    reference: "volume of the membrane, from its curve",
    norm: "relative",
    quick: 4,
    problem: surface,
}];

/// Inner and outer surface of a random heart at a random phase and pose.
fn surface(random: &mut Random) -> Option<f64> {
    let phase = random.uniform(0.0, 1.0);
    let mut scene = Scene::default().with_mode(Mode::Static { phase });
    scene.heart.discretisation = DiscretisationSettings::Spectral {
        degree: 12,
        per_piece: 1,
        tolerance: 1e-7,
    };
    scene.heart.inner.length = random.uniform(6.0, 10.0);
    scene.heart.outer.length = scene.heart.inner.length + random.uniform(0.0, 1.0);
    (scene.pose.rotate_x, scene.pose.rotate_y) =
        (random.degrees(-180.0, 180.0), random.degrees(-180.0, 180.0));
    // The body follows the curve to 1e-6 cm, about 1e-6 of its volume.
    let tolerance = random.decades(-4.0, -1.0);
    scene.output.mesh_tolerance = tolerance;
    let phantom = Phantom::new(scene).ok()?;
    let meshes = phantom.meshes(phase).ok()?;
    let volumes = phantom.shape(phase).ok()?.volumes();
    let error = |(mesh, volume): (&heart_phantom::revolve_voxel::Mesh, f64)| {
        (mesh.volume() / volume - 1.0).abs()
    };
    let worst = meshes.iter().zip(volumes).map(error).fold(0.0, f64::max);
    Some(worst / tolerance)
}
