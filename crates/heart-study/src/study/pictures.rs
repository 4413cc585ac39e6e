//! The figures of the study.

use super::evolving::EvolvingStudy;
use super::membranes::DirectStudy;
use super::rubber::{RUBBER, RubberStudy};
use super::run::Run;
use crate::figures::{
    self, CircleStudy, Cut, ForceFrame, IsoView, Picture, Shape, View, Volume, WallState, bodies,
    curves, force_frames, histories, images, isosurface, poses, projection, shapes, slice,
    wall_meshes, window,
};
use crate::html::Page;
use crate::report::{self, Report};
use heart_phantom::membrane_newton::Equilibrium;
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::revolve_voxel::nalgebra::Vector3;
use heart_phantom::{Balloon, HeartShape, PhantomError};
use std::sync::Arc;

/// Files of the figures, without those of [`VOLUMES`].
pub(super) const FILES: [&str; 12] = [
    "fig08-shapes.png",
    "newton-jacobian.png",
    "fig09-forces.png",
    "fig10-norm.png",
    "fig11-wall.png",
    "fig12-bodies.png",
    "rubber-wall.png",
    "rubber-pressure.svg",
    "rubber-view.svg",
    "fig13-pose.png",
    "fig14-projections.png",
    "fig18-circle.png",
];
/// Figures of each reconstruction.
pub(super) const VOLUMES: [&str; 3] = ["slice", "slices", "volume"];
/// Grey window of the three reconstructions, for comparison of streaks.
const WINDOW: [f64; 2] = [-0.25, 1.25];
/// Direction of view of solids.
const VIEW: View = View {
    azimuth: 0.4,
    elevation: 0.35,
};
/// Layers and cells of the mesh between the membranes.
const WALL_MESH: (usize, usize) = (5, 60);

/// Reference configurations: Table 1.
pub(super) fn reference(page: &mut Page, reference: &report::Reference) {
    page.section(
        "Reference configurations",
        "Two balloons, each a cylinder of 8.5 cm closed by a hemisphere (Table 1). The table compares the \
             polygon through the nodes (section 3.3) with the closed forms.",
    );
    let row = |name: &str, discrete: f64, exact: f64| {
        vec![
            name.into(),
            format!("{discrete:.8}"),
            format!("{exact:.8}"),
            format!("{:.1e}", (discrete - exact) / exact),
        ]
    };
    let rows = [("inner", &reference.inner), ("outer", &reference.outer)]
        .iter()
        .flat_map(|(name, r)| {
            [
                row(&format!("{name}: length (cm)"), r.length, r.length_exact),
                row(&format!("{name}: area (cm²)"), r.area, r.area_exact),
                row(&format!("{name}: volume (cm³)"), r.volume, r.volume_exact),
            ]
        })
        .collect();
    page.table(
        "Reference configurations",
        &["quantity", "polygon", "closed form", "relative difference"],
        rows,
    );
}

/// The direct method: Fig. 8, Newton's residuals.
pub(super) fn direct(page: &mut Page, study: &DirectStudy) -> Result<(), PhantomError> {
    let figures = &study.figures;
    page.section(
        "Direct method",
        format!(
            "Newton's method on the discrete equilibrium (section 3.1.2, Eq. 14 with corrected \
             signs). At the study's volume gain the pair needs {} steps from the reference configuration: \
             pressures {:.11} inside and {:.11} outside (mesh-independent: {:.11} and {:.11}), relative \
             change of the wall volume {:.1e}.",
            figures.newton_iterations,
            figures.f_inner,
            figures.f_outer,
            figures.limit.f_inner,
            figures.limit.f_outer,
            figures.wall_volume_error,
        ),
    );
    let points: Vec<_> = study.family.iter().map(Equilibrium::points).collect();
    let family: Vec<Shape<'_>> = (study.family.iter().zip(&points))
        .map(|(shape, nodes)| Shape {
            nodes,
            load: shape.intensity,
            area: shape.measures.area,
            volume: shape.measures.volume,
        })
        .collect();
    page.picture(
        "fig08-shapes.png",
        &shapes(&family)?,
        "Fig. 8: the inner balloon under a family of pressures, by the direct method.",
    )?;
    let [printed, right] = &study.histories;
    page.picture(
        "newton-jacobian.png",
        &histories(
            "norm of the forces",
            None,
            &[
                ("Jacobian as printed in Eq. 14", printed),
                ("Jacobian with the corrected signs", right),
            ],
        )?,
        format!(
            "Cause of the oscillation in the paper: with the two signs of Eq. 14 as printed, Newton's method \
             has a residual force of {:.2} after 60 steps (201 nodes, f/lambda = 17.5 cm); with the \
             corrected signs it converges quadratically.",
            figures.printed_jacobian_residual_after_60
        ),
    )
}

/// The evolving method: Fig. 9 and 10.
pub(super) fn evolving(page: &mut Page, study: &EvolvingStudy) -> Result<(), PhantomError> {
    let figures = &study.figures;
    page.section(
        "Evolving method",
        format!(
            "Implicit Euler in time (section 3.2), elastic forces implicit, the pressure of Eq. 4 \
             linearised, damped. With a step of {} it reaches equilibrium in {} steps; its last shape \
             is within {:.1e} cm of that of the direct method.",
            figures.dt, figures.steps, figures.distance_to_direct
        ),
    );
    let frames: Vec<ForceFrame<'_>> = study
        .frames
        .iter()
        .map(|frame| ForceFrame {
            iteration: frame.step,
            nodes: &frame.points,
            elastic: &frame.elastic,
            pressure: &frame.pressure,
        })
        .collect();
    page.picture(
        "fig09-forces.png",
        &force_frames(&frames)?,
        "Fig. 9: nodes (red), elastic forces (magenta) and pressure forces (black) on the way to \
         equilibrium, where they balance; forces over the stiffness, per unit of the material coordinate.",
    )?;
    let series: Vec<(&str, &[f64])> = (study.histories.iter())
        .map(|(label, norms)| (*label, norms.as_slice()))
        .collect();
    page.picture(
        "fig10-norm.png",
        &histories("norm of pressure and elastic forces", Some(1e-4), &series)?,
        "Fig. 10: the norm of the forces by iteration. It decreases monotonically for large steps \
         only; with small steps the membrane oscillates.",
    )
}

/// The pair of membranes: Fig. 11 and 12.
pub(super) fn pair(page: &mut Page, states: &[Arc<HeartShape>]) -> Result<(), PhantomError> {
    page.section(
        "Two membranes",
        "The outer pressure is solved for together with both shapes, so that the volume of the wall \
             is constant without trial and error.",
    );
    let titles: Vec<String> = states
        .iter()
        .map(|s| {
            format!(
                "gain {:.2}: f/λ = {:.2} and {:.2} cm",
                s.gain(),
                s.solution().inner.intensity,
                s.solution().outer.intensity
            )
        })
        .collect();
    let walls: Vec<WallState<'_>> = (titles.iter().zip(states))
        .map(|(title, state)| wall_state(title, state))
        .collect();
    page.picture(
        "fig11-wall.png",
        &wall_meshes(&walls, WALL_MESH.0, WALL_MESH.1)?,
        "Fig. 11: both membranes and the mesh between them at three pressures, f over the stiffness of the inner \
         and of the outer one.",
    )?;
    page.picture(
        "fig12-bodies.png",
        &bodies(&[walls[0], walls[walls.len() - 1]])?,
        "Fig. 12: the heart in the reference configuration and dilated, rendered from the exact body with the \
         normals of the meridian; above cut open, below the mesh of the outer membrane.",
    )
}

fn wall_state<'a>(title: &'a str, shape: &'a HeartShape) -> WallState<'a> {
    let [inner, outer] = shape.curves();
    WallState {
        title,
        inner,
        outer,
    }
}

/// The same balloons as rubber, which the paper does not have.
pub(super) fn rubber(page: &mut Page, study: &RubberStudy) -> Result<(), PhantomError> {
    let figures = &study.figures;
    let (mu, thickness) = RUBBER;
    page.section(
        "The same balloons as rubber",
        format!(
            "Springs pull along the meridian only. Rubber is incompressible and has tension around the axis too, so that its \
             loads are physical pressures. Neo-Hookean, {mu} kPa, {thickness} mm thick in the reference configuration: {:.2} mmHg across \
             the inner balloon and {:.2} mmHg across the outer one at the study's volume gain. Relative change of the wall volume: {:.1e}. \
             A view of the two hearts differs by {:.2} % (root mean square).",
            figures.inner_mmhg,
            figures.outer_mmhg,
            figures.wall_volume_error,
            100.0 * figures.view_difference
        ),
    );
    let titles = ["springs", "rubber"];
    let walls = [0, 1].map(|k| wall_state(titles[k], &study.dilated[k]));
    page.picture(
        "rubber-wall.png",
        &wall_meshes(&walls, WALL_MESH.0, WALL_MESH.1)?,
        "Both membranes and the mesh between them, of springs and of rubber, at the same volumes.",
    )?;
    page.drawing(
        "rubber-pressure.svg",
        &curves("volume gain", "pressure (mmHg)", &study.pressures)?,
        format!(
            "Pressure across the inner balloon over its volume, of rubbers of {mu} kPa and {thickness} mm. The neo-Hookean pressure \
             has a maximum, beyond which it falls while the balloon grows; chains of finite length (Gent) stiffen again. \
             The stiffness of the springs gives the neo-Hookean pressure at the study's gain (mean pressure: intensity over length)."
        ),
    )?;
    let profiles = [0, 1].map(|k| (titles[k], &study.profiles[k]));
    page.drawing(
        "rubber-view.svg",
        &curves("s (cm)", "wall on the ray (cm)", &profiles)?,
        format!(
            "The middle row of one projection of both at {:.0}°: length of each ray in the wall.",
            study.angle.to_degrees()
        ),
    )?;
    let row = |what: &str, [springs, rubber]: [f64; 2]| {
        vec![
            what.into(),
            format!("{:.3}", 10.0 * springs),
            format!("{:.3}", 10.0 * rubber),
        ]
    };
    page.table(
        "Thickness of the wall when dilated",
        &["place", "springs (mm)", "rubber (mm)"],
        vec![row("side", figures.side), row("apex", figures.apex)],
    );
    Ok(())
}

/// The pose of the heart: Fig. 13.
pub(super) fn pose(page: &mut Page, run: &Run<'_>) -> Result<(), PhantomError> {
    page.section(
        "Tomography",
        format!(
            "The camera rotates about z by 180 degrees in {} views while the heart beats {} times per \
             minute. Sinograms from exact chords of the revolved membranes, reconstructed slice by \
             slice to {}³ voxels of {:.4} cm.",
            run.phantom.camera().n_views(),
            run.options.beats_per_minute,
            run.phantom.camera().n_bins(),
            run.phantom.camera().pitch()
        ),
    );
    let rest = run.phantom.heart().reference_shape()?;
    let middle = (Balloon::OUTER.length + Balloon::OUTER.radius) / 2.0;
    let upright = Pose::axis_along_z(middle).map_err(PhantomError::from)?;
    page.picture(
        "fig13-pose.png",
        &poses(
            &wall_state("", &rest),
            &[
                ("axis along z", upright),
                (
                    "rotated 45° about x, then 45° about y",
                    *run.phantom.heart().pose(),
                ),
            ],
            VIEW,
        )?,
        "Fig. 13: the heart before and after its rotation; the circle is the orbit of the camera about z.",
    )
}

/// Projections of the reference configuration: Fig. 14.
pub(super) fn projection_images(
    page: &mut Page,
    run: &Run<'_>,
    samples: &[f32],
) -> Result<(), PhantomError> {
    let camera = run.phantom.camera();
    let angles = camera.geometry().angles();
    let views: Vec<Cut> = [0, angles.len() / 3, 2 * angles.len() / 3]
        .map(|k| {
            let title = format!("θ = {:.0}°", angles[k].to_degrees());
            let from = k * camera.view_len();
            projection(title, camera, &samples[from..from + camera.view_len()])
        })
        .into();
    page.picture(
        "fig14-projections.png",
        &images(&views, window(&views), "chord (cm)")?,
        "Fig. 14: projections of the reference configuration at three angles; exact chord lengths, no voxels.",
    )
}

/// One reconstruction: Fig. 15, 16 or 17.
pub(super) fn reconstruction(
    page: &mut Page,
    run: &Run<'_>,
    (number, name): (usize, &str),
    volume: &[f32],
) -> Result<(), PhantomError> {
    let n = run.phantom.camera().n_bins();
    let volume = Volume {
        grid: *run.phantom.camera().grid(),
        values: volume,
    };
    let slices = |indices: &[usize]| -> Result<Picture, PhantomError> {
        let cuts: Vec<Cut> = indices.iter().map(|&k| slice(&volume, k)).collect();
        images(&cuts, WINDOW, "activity")
    };
    let of = |what: &str| format!("fig{number}-{name}-{what}.png");
    page.picture(
        &of("slice"),
        &slices(&[n / 2])?,
        format!("Fig. {number}a: the middle slice of the {name} acquisition, Ram-Lak."),
    )?;
    // From -4.5 cm to 3.5 cm; the heart of the study extends from -5.2 to 4.2 cm at rest.
    let planes = [0, 1, 2, 3, 4, 5].map(|k| n * (11 + 5 * k) / 50);
    page.picture(
        &of("slices"),
        &slices(&planes)?,
        format!("Fig. {number}b: slices of the same."),
    )?;
    // The cut runs through the axis of the body and faces the viewer; it shows the inside of the wall with its motion artefacts.
    let axis = run.phantom.heart().pose().axis();
    let toward = Vector3::from(VIEW.toward());
    let normal = toward - axis * toward.dot(&axis);
    let view = IsoView {
        level: 0.5,
        view: VIEW,
        cut: Some((normal.into(), 0.0)),
    };
    page.picture(
        &of("volume"),
        &isosurface(volume, &view)?,
        format!(
            "Fig. {number}c: the isosurface at half the activity of the wall, cut along the axis."
        ),
    )
}

/// The table of image quality.
pub(super) fn measures(page: &mut Page, report: &Report) {
    page.section(
        "Effects of motion",
        "The wall's activity is 1, everything else 0. Wall and background are the same voxels \
             for the three acquisitions. The RMSE is relative to the exact volume. The views of the short scan \
             acquire different shapes of the heart, so its reference is the average over all views. A dash is a quantity \
             without voxels: the eroded wall of a small volume has none.",
    );
    let cell = |v: Option<f64>| v.map_or("–".into(), |v| format!("{v:.5}"));
    let row = |name: &str, a: &report::Acquisition| {
        vec![
            name.into(),
            cell(a.quality.rmse_truth),
            cell(a.quality.eroded_wall_mean),
            cell(a.quality.wall_std),
            cell(a.quality.background_rms),
            cell(a.quality.cavity_mean),
            a.quality
                .total_activity
                .map_or("–".into(), |v| format!("{v:.3}")),
        ]
    };
    let windows = [("Ram-Lak", &report.ram_lak), ("Hann", &report.hann)];
    let rows = windows.into_iter().flat_map(|(window, acquisitions)| {
        (acquisitions.named()).map(|(name, a)| row(&format!("{name}, {window}"), a))
    });
    page.table(
        "Reconstructions against the ground truth",
        &[
            "acquisition",
            "RMSE",
            "wall mean",
            "wall std",
            "background RMS",
            "cavity mean",
            "total (cm³)",
        ],
        rows.collect(),
    );
}

/// The circle of the appendix: Fig. 18.
pub(super) fn circle(page: &mut Page, study: &CircleStudy, order: f64) -> Result<(), PhantomError> {
    page.section(
        "Appendix: the circle",
        "A membrane whose reference configuration is a straight line inflates to an arc of a circle; with the \
             corrected constant C the discrete solution converges to it.",
    );
    page.picture(
        "fig18-circle.png",
        &figures::circle(study)?,
        format!(
            "Fig. 18: the line, the inflated shape and the exact circle; error against the number \
             of nodes, observed order {order:.3}."
        ),
    )
}
