//! The commands.

use super::arguments::{Arguments, Paper};
use super::output::{Answer, Failure, complain};
use crate::ejection::{QUICK, ejection};
use crate::look::Look;
use clap::CommandFactory;
use clap::error::ErrorKind;
use heart_phantom::files::{self, Section, Volume};
use heart_phantom::revolve_voxel::VoxelGrid;
use heart_phantom::{
    Observer, Phantom, PhantomError, Product, Progress, Run, RunReport, check_count, check_value,
    escape,
};
use indicatif::{BinaryBytes, ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::fs;
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

pub(crate) type Done = Result<Answer, Failure>;

pub(super) fn paper(arguments: &Arguments, paper: &Paper) -> Done {
    let (report, removed) = observed(arguments, &paper.out, |progress| {
        crate::run(&paper.options, &paper.out, progress)
    })?;
    let shown = if paper.options.figures {
        "index.html"
    } else {
        "report.json"
    };
    let mut lines: Vec<String> = crate::study::summary(&report)
        .lines()
        .map(String::from)
        .collect();
    lines.push(format!("written to {}", paper.out.join(shown).display()));
    Ok(Answer::Report(with_removed(json!(report), removed), lines))
}

pub(super) fn ef(arguments: &Arguments, out: &Path, quick: bool) -> Done {
    let (report, removed) = observed(arguments, out, |progress| ejection(quick, out, progress))?;
    let (mut found, mut lines) = (with_removed(json!(report), removed), report.summary());
    if quick {
        found["warnings"] = json!([{ "message": QUICK }]);
    }
    lines.push(format!("written to {}", out.join("index.html").display()));
    Ok(Answer::Report(found, lines))
}

/// The regular files in a directory, without hidden and temporary ones.
fn files_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path()).filter(|path| {
        let name = path
            .file_name()
            .map_or("".into(), |name| name.to_string_lossy());
        path.is_file() && !name.starts_with('.') && !name.ends_with(".tmp")
    });
    paths.collect()
}

/// Runs work that writes to a directory, with a progress bar. Returns its result and the number of files of an earlier run that it has
/// removed and not written again, and prints this number, which JSON output contains.
fn observed<T, E>(
    arguments: &Arguments,
    out: &Path,
    work: impl FnOnce(Observer<'_, Progress>) -> Result<T, E>,
) -> Result<(T, usize), E> {
    let (bar, before) = (bar(arguments), files_in(out));
    let result = work(&|progress: Progress| {
        bar.set_message(progress.stage);
        bar.set_position((progress.fraction * 1000.0) as u64);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    let removed = before.iter().filter(|path| !path.exists()).count();
    if removed > 0 && !arguments.json {
        complain(&format!("removed {removed} files of an earlier run"));
    }
    Ok((result?, removed))
}

fn with_removed(mut report: Value, removed: usize) -> Value {
    if removed > 0 {
        report["removed"] = json!(removed);
    }
    report
}

/// Returns an error for an existing file, which is never replaced.
fn check_new(path: &Path) -> Result<(), PhantomError> {
    if fs::symlink_metadata(path).is_err() {
        return Ok(());
    }
    let source = io::Error::new(io::ErrorKind::AlreadyExists, "the file exists");
    let path = path.to_path_buf();
    Err(PhantomError::File { path, source })
}

/// Writes a template to a new file.
pub(crate) fn init(file: Option<&Path>, text: String) -> Done {
    let Some(path) = file else {
        return Ok(Answer::Text(text));
    };
    check_new(path)?;
    files::write_atomically(path, |out| out.write_all(text.as_bytes()))?;
    Ok(Answer::Report(
        json!({ "file": path.to_string_lossy() }),
        Vec::new(),
    ))
}

/// Loads the phantom of a scene with the memory of the arguments, and that of a page.
fn load(arguments: &Arguments, scene: &Path, page: bool) -> Result<Phantom, PhantomError> {
    let phantom = Phantom::load(scene)?;
    let further = if page { Look::bytes(&phantom) } else { 0 };
    let phantom = phantom.with_memory_share(1, further);
    Ok(match arguments.memory {
        Some(mib) => phantom.with_memory(mib << 20),
        None => phantom,
    })
}

pub(super) fn check(arguments: &Arguments, path: &Path) -> Done {
    let phantom = load(arguments, path, true)?;
    phantom.prepare()?;
    warn(arguments, &phantom)?;
    let (camera, numbers) = (phantom.camera(), phantom.numbers()?);
    let files = phantom.files()?.into_iter();
    let mut files: Vec<(PathBuf, u64)> = files.map(|file| (file.name, file.bytes)).collect();
    // Images and page, before the report, which is written last.
    let last = files.len().saturating_sub(1);
    let beside = Look::new(&phantom, true).files().into_iter();
    files.splice(last..last, beside.map(|name| (name, 0)));
    let samples = phantom.n_gates() * camera.n_views() * camera.view_len();
    let [images, states] = phantom.images_and_states()?;
    let bytes: u64 = files.iter().map(|(_, bytes)| bytes).sum();
    let named = files
        .iter()
        .map(|(name, bytes)| json!({ "name": name, "bytes": bytes }));
    let found = json!({
        "scene": value_of(&phantom.scene().to_json()), "gates": phantom.n_gates(), "samples": samples,
        "voxels": camera.grid().len(), "voxel_cm": camera.grid().spacing(), "numbers": numbers,
        "files": named.collect::<Vec<_>>(), "bytes": bytes, "memory": phantom.memory(), "warnings": phantom.warnings()?,
        "images_of_the_heart": images, "states_of_the_truth": states, "work": phantom.work(),
    });
    let ([nx, ny, nz], [x, y, z]) = (camera.grid().shape(), camera.grid().spacing());
    let [low, high] = phantom.cycle().gains();
    let sets = match phantom.n_gates() {
        1 => String::new(),
        n => format!("{n} gates of "),
    };
    let mut lines = vec![
        format!("{} is valid", path.display()),
        format!(
            "  {sets}{} views, {} rows x {} bins",
            camera.n_views(),
            camera.n_rows(),
            camera.n_bins()
        ),
        format!("  {nx} x {ny} x {nz} voxels of {x:.4} x {y:.4} x {z:.4} cm"),
        format!(
            "  EDV {:.2} mL, ESV {:.2} mL, ejection fraction {:.4} (volume gain {low:.4} to {high:.4})",
            numbers.edv, numbers.esv, numbers.ejection_fraction
        ),
        format!("  {images} images of the heart, {states} states of it in the ground truth"),
        format!(
            "  {} of memory at most, {} of data in {} files:",
            BinaryBytes(phantom.memory().total()),
            BinaryBytes(bytes),
            files.len()
        ),
    ];
    lines.extend(files.iter().map(|(name, bytes)| match *bytes {
        0 => format!("    {}", name.display()),
        bytes => format!("    {} {}", name.display(), BinaryBytes(bytes)),
    }));
    Ok(Answer::Report(found, lines))
}

pub(super) fn run_scene(arguments: &Arguments, scene: &Path, out: &Path, page: bool) -> Done {
    let phantom = load(arguments, scene, page)?;
    let (report, removed) = observed(arguments, out, |progress| {
        let name = scene.file_name().unwrap_or(scene.as_os_str());
        let title = escape(&format!("Run of {}", name.display()));
        run_to_look_at(arguments, &phantom, (page, &title), (out, progress))
    })?;
    let numbers = &report.numbers;
    let mut lines = vec![format!(
        "EDV {:.2} mL  ESV {:.2} mL  EF {:.4}  wall {:.2} mL",
        numbers.edv, numbers.esv, numbers.ejection_fraction, numbers.wall_volume
    )];
    lines.extend(error_of_samples(&report));
    lines.extend([
        format!(
            "{} shapes solved, {} rays cast, {} rays skipped",
            report.work.shapes_solved, report.work.rays_cast, report.work.rays_skipped
        ),
        format!("{} files written to {}", report.files.len(), out.display()),
    ]);
    let found = with_removed(value_of(&report.to_json()), removed);
    Ok(Answer::Report(found, lines))
}

/// Parses JSON of `heart-phantom`, whose serialiser is compiled with that crate.
fn value_of(json: &str) -> Value {
    serde_json::from_str(json).unwrap_or_default()
}

/// Runs a scene and writes its images and page.
fn run_to_look_at(
    arguments: &Arguments,
    phantom: &Phantom,
    (page, title): (bool, &str),
    (out, progress): (&Path, Observer<'_, Progress>),
) -> Result<RunReport, PhantomError> {
    let mut look = Look::new(phantom, page);
    // Validates as `check` does, before the warnings.
    let mut run = Run::begin(phantom, out, &look.files())?;
    warn(arguments, phantom)?;
    for gate in 0..phantom.n_gates() {
        look.see(gate, &run.gate(gate, progress)?)?;
    }
    run.finish(progress, |report| look.write(report, title, out))
}

/// Returns the largest bound on sample errors of all gates; `None` for instantaneous line integrals.
fn error_of_samples(report: &RunReport) -> Option<String> {
    let gate = report.gates.first()?;
    let errors = report.gates.iter().filter_map(|gate| gate.view_error);
    let worst = errors.map(|error| error.total()).fold(0.0, f64::max);
    let mut how = Vec::new();
    if let Some(steps) = gate.quadrature_steps {
        how.push(format!("{steps} time steps per beat"));
    }
    if let Some(resolution) = gate.resolution {
        let density = resolution.density;
        how.push(format!(
            "{density} quadrature nodes per standard deviation of the response"
        ));
    }
    // Rounded up.
    let near = format!("{worst:.1e}");
    let worst = match near.parse().is_ok_and(|near: f64| near >= worst) {
        true => near,
        false => format!("{:.1e}", worst + 0.05 * 10f64.powf(worst.log10().floor())),
    };
    (!how.is_empty()).then(|| {
        format!(
            "sample error: at most {worst} of the largest sample ({})",
            how.join(", ")
        )
    })
}

/// Prints warnings before the work; JSON output contains them.
fn warn(arguments: &Arguments, phantom: &Phantom) -> Result<(), PhantomError> {
    if !arguments.json {
        for warning in phantom.warnings()? {
            complain(&format!("warning: {warning}"));
        }
    }
    Ok(())
}

pub(super) fn truth(arguments: &Arguments, scene: &Path, phase: f64, out: Option<&Path>) -> Done {
    check_value("phase", phase, [0.0, 1.0])?;
    let phase = phase + 0.0; // -0 is 0
    let phantom = Phantom::load(scene)?;
    let format = phantom.scene().output.volumes;
    let [activity, labels] = ["activity", "labels"].map(|name| {
        let extensions = format.info().volume;
        let files = [Some(extensions.header), extensions.data]
            .into_iter()
            .flatten();
        let files = files.map(|extension| format!("{name}.{extension}").into());
        files.collect::<Vec<PathBuf>>()
    });
    let surfaces = ["inner.stl", "outer.stl"].map(PathBuf::from);
    let written = [&activity[..], &labels, &surfaces].concat();
    let folder = out.map(files::Folder::lock).transpose()?;
    if let Some(folder) = &folder {
        files::check_unlisted(folder.path(), &written)?;
        let mut paths = written.iter().map(|name| folder.path().join(name));
        paths.try_for_each(|path| check_new(&path))?;
    }
    let products: &[Product] = match out {
        Some(_) => &[Product::Truth, Product::Labels],
        None => &[],
    };
    phantom.check_memory(products, 0)?;
    warn(arguments, &phantom)?;
    let shape = phantom.shape(phase)?;
    let [cavity, outer] = shape.volumes();
    let thickness = phantom.thickness(phase)?;
    if let Some(out) = out {
        let grid = *phantom.camera().grid();
        let samples = phantom.activity(phase)?;
        let volume = Volume::new(grid, samples.as_slice())?;
        files::write(&out.join(&activity[0]), &volume, format)?;
        let samples = phantom.labels(phase)?;
        let volume = Volume::new(grid, samples.as_slice())?;
        files::write(&out.join(&labels[0]), &volume, format)?;
        for (file, mesh) in surfaces.iter().zip(&phantom.meshes(phase)?) {
            files::write_stl(&out.join(file), mesh)?;
        }
    }
    let found = json!({
        "phase": phase, "gain": shape.gain(), "cavity_ml": cavity, "wall_ml": outer - cavity, "thickness_cm": thickness,
        "numbers": phantom.numbers()?, "warnings": phantom.warnings()?, "work": phantom.work(),
    });
    let lines = vec![
        format!(
            "phase {phase}: cavity {cavity:.4} mL, wall {:.4} mL",
            outer - cavity
        ),
        format!(
            "wall {:.3} mm at the side, {:.3} mm at the apex",
            10.0 * thickness.side,
            10.0 * thickness.apex
        ),
    ];
    Ok(Answer::Report(found, lines))
}

pub(super) fn one_view(arguments: &Arguments, scene: &Path, at: [usize; 2], out: &Path) -> Done {
    let [gate, view_idx] = at;
    // The extension is validated before any work,
    let ends_in = |wanted: &str| out.extension().is_some_and(|extension| extension == wanted);
    if !ends_in("png") && !ends_in("npy") {
        let (path, expected) = (out.to_path_buf(), "npy or .png");
        return Err(PhantomError::Extension { path, expected }.into());
    }
    let phantom = Phantom::load(scene)?;
    check_count("view", view_idx, [0, phantom.camera().n_views() - 1])?;
    check_count("gate", gate, [0, phantom.n_gates() - 1])?;
    // and so is the directory; `x.npy` has none.
    let folder = out.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new("."));
    files::create_writable_folder(folder)?;
    if let Some(name) = out.file_name() {
        files::check_unlisted(folder, &[name.into()])?;
    }
    check_new(out)?;
    let camera = phantom.camera();
    phantom.check_memory(&[Product::Projections], 1)?;
    warn(arguments, &phantom)?;
    let view = phantom.view(gate, view_idx)?;
    let view = phantom.in_values_of_output(gate, view_idx, &view)?;
    if ends_in("npy") {
        files::write_npy(out, &[camera.n_rows(), camera.n_bins()], &view)?;
    } else {
        let [bin, row] = camera.detector().pitch();
        let grid = VoxelGrid::centred(
            [camera.n_bins(), 1, camera.n_rows()],
            [bin, bin, row],
            [0.0; 3],
        )
        .map_err(PhantomError::from)?;
        let most = view.iter().copied().fold(0.0f32, f32::max);
        let grey = [0.0, if most > 0.0 { f64::from(most) } else { 1.0 }];
        let picture = Volume::new(grid, &*view)?;
        files::write_png(out, &picture, Section::Coronal(0), grey)?;
    }
    let found = json!({
        "file": out.to_string_lossy(), "gate": gate, "view": view_idx, "rows": camera.n_rows(), "bins": camera.n_bins(),
        "warnings": phantom.warnings()?, "work": phantom.work(),
    });
    Ok(Answer::Report(found, Vec::new()))
}

/// Returns the manual page of the program or of one command, given as the names that lead to it.
pub(super) fn man(command: &[String]) -> Done {
    let mut page = Arguments::command();
    page.build();
    // Subcommands have no version.
    let source = page.render_version();
    for name in command {
        let Some(subcommand) = page.find_subcommand(name) else {
            let what = format!("command `{name}` does not exist");
            return Err(page.error(ErrorKind::InvalidValue, what).into());
        };
        page = subcommand.clone();
    }
    let mut roff = Vec::new();
    let title = page.get_display_name().unwrap_or(page.get_name());
    clap_mangen::Man::new(page.clone())
        .title(title.to_uppercase())
        .source(source.trim_end())
        .render(&mut roff)
        .map_err(|source| PhantomError::File {
            path: "the manual page".into(),
            source,
        })?;
    Ok(text(&roff))
}

pub(super) fn text(bytes: &[u8]) -> Answer {
    Answer::Text(String::from_utf8_lossy(bytes).into_owned())
}

pub(crate) fn bar(arguments: &Arguments) -> ProgressBar {
    if arguments.quiet || arguments.json {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(1000);
    // As wide as the terminal, so that the longest message does not wrap.
    let template =
        "{wide_bar:.cyan/blue} {percent:>3}% {elapsed_precise}, remaining {eta_precise} {msg:14}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}
