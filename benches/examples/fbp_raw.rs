//! Reconstructs a raw little-endian f32 stack and prints the time of each repeat; used by the comparison with other tools.
//!
//! `fbp_raw INPUT OUTPUT n_views n_slices n_bins WINDOW INTERPOLATION ORDER REPEATS [THREADS [METHOD]]`, METHOD `auto`
//! (default), `direct` or the tolerance of a Fourier method, for instance
//! `fbp_raw sinogram.f32 volume.f32 90 256 256 ram-lak linear view-slice-bin 7 2`; an OUTPUT of `-` writes nothing.

use std::time::Instant;

use radon::{
    FbpMethod, FbpOptions, FbpPlan, ImageGrid, Interpolation, ParallelGeometry, StackOrder, Window,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [
        input,
        output,
        n_views,
        n_slices,
        n_bins,
        window,
        interpolation,
        order,
        repeats,
        rest @ ..,
    ] = &args[..]
    else {
        return Err("usage: fbp_raw INPUT OUTPUT n_views n_slices n_bins WINDOW INTERPOLATION ORDER REPEATS [THREADS [METHOD]]".into());
    };
    if let Some(threads) = rest.first() {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.parse()?)
            .build_global()?;
    }
    let method = match rest.get(1).map(String::as_str) {
        None | Some("auto") => FbpMethod::Auto,
        Some("direct") => FbpMethod::Direct,
        Some(tolerance) => FbpMethod::Fourier {
            tolerance: tolerance.parse()?,
        },
    };
    let window = match window.as_str() {
        "ram-lak" => Window::RamLak,
        "shepp-logan" => Window::SheppLogan,
        "hann" => Window::Hann,
        other => return Err(format!("no window {other}").into()),
    };
    let interpolation = match interpolation.as_str() {
        "linear" => Interpolation::Linear,
        "band-limited" => Interpolation::BandLimited,
        other => return Err(format!("no interpolation {other}").into()),
    };
    let order = match order.as_str() {
        "view-slice-bin" => StackOrder::ViewSliceBin,
        "slice-view-bin" => StackOrder::SliceViewBin,
        other => return Err(format!("no order {other}").into()),
    };
    let (n_views, n_slices, n_bins): (usize, usize, usize) =
        (n_views.parse()?, n_slices.parse()?, n_bins.parse()?);
    let projections: Vec<f32> = std::fs::read(input)?
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();

    let geometry = ParallelGeometry::half_turn(n_views, n_bins, 1.0)?;
    let grid = ImageGrid::square(n_bins, 1.0)?;
    let options = FbpOptions::default()
        .with_window(window)
        .with_interpolation(interpolation)
        .with_method(method);
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &options)?;
    let mut volume = vec![0.0; n_slices * plan.image_len()];
    let mut scratch = radon::FbpScratch::default();
    // A warm-up run, then the repeats.
    let mut seconds = Vec::new();
    for _ in 0..=repeats.parse::<usize>()? {
        let start = Instant::now();
        plan.reconstruct_slab_into(
            &projections,
            n_slices,
            order,
            0..n_slices,
            &mut volume,
            &mut scratch,
        )?;
        seconds.push(start.elapsed().as_secs_f64());
    }
    let seconds: Vec<String> = seconds[1..].iter().map(|s| format!("{s:.6}")).collect();
    println!("{}", seconds.join(" "));
    if output != "-" {
        std::fs::write(
            output,
            volume
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect::<Vec<u8>>(),
        )?;
    }
    Ok(())
}
