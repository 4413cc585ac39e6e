//! The page: eight questions, each with a plot and a table.

use std::fmt::Write as _;

use super::machine::Machine;
use super::rows::Row;

/// Rows of the same question.
pub(super) struct Group<'a> {
    pub(super) study: &'a str,
    pub(super) case: &'a str,
    pub(super) rows: Vec<&'a Row>,
}

impl Group<'_> {
    /// Returns the file name of its plot.
    pub(super) fn file(&self) -> String {
        let name = format!("performance {} {}", self.study, self.case).to_lowercase();
        let words = name.split(|c: char| !c.is_ascii_alphanumeric());
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        format!("{}.svg", words.join("-"))
    }

    /// Returns its rows by method and threads; each is a curve.
    pub(super) fn curves(&self) -> Vec<(String, Vec<&Row>)> {
        let many = self.rows.iter().any(|row| row.threads > 1);
        let mut curves: Vec<(String, Vec<&Row>)> = Vec::new();
        for row in &self.rows {
            let name = match (many, row.threads) {
                (false, _) => row.method.clone(),
                (true, 1) => format!("{}, 1 thread", row.method),
                (true, n) => format!("{}, {n} threads", row.method),
            };
            match curves.iter_mut().find(|(known, _)| *known == name) {
                Some((_, curve)) => curve.push(row),
                None => curves.push((name, vec![row])),
            }
        }
        curves
    }
}

/// Groups the rows by study and case, in order of first appearance.
pub(super) fn groups(rows: &[Row]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for row in rows {
        let same = |group: &&mut Group<'_>| group.study == row.study && group.case == row.case;
        match groups.iter_mut().find(same) {
            Some(group) => group.rows.push(row),
            None => groups.push(Group {
                study: &row.study,
                case: &row.case,
                rows: vec![row],
            }),
        }
    }
    // cases of one study are adjacent, even if measured separately
    let first = |study: &str| rows.iter().position(|row| row.study == study);
    groups.sort_by_key(|group| first(group.study));
    groups
}

/// A question of the page, and the study that answers it.
struct Question {
    title: &'static str,
    answer: &'static str,
    study: &'static str,
    case: &'static str,
    /// The header of the column of sizes.
    size: &'static str,
    /// The header of the column of errors: the norm, and the reference.
    error: &'static str,
    /// The benchmark, and its criterion groups for the same kind of computation.
    bench: &'static str,
}

const QUESTIONS: [Question; 8] = [
    Question {
        title: "Reconstruct one slice",
        answer: "Filtered back-projection of 512 x 512 pixels from 720 views. `ours` selects the method by size, `ours-direct` sums over the views, and\n`ours-band-limited` has band-limited instead of linear interpolation between bins. `finufft` uses a type-1 non-uniform fast Fourier\ntransform of FINUFFT with the tolerance 1e-3.",
        study: "FBP",
        case: "shepp-logan, 1 x 512 x 512 from 720 views",
        size: "views",
        error: "image error",
        bench: "`radon`, groups `radon/fbp/...`",
    },
    Question {
        title: "Reconstruct a stack of slices",
        answer: "Filtered back-projection of 256 slices of 256 x 256 pixels from 90 views.",
        study: "FBP",
        case: "shell, 256 x 256 x 256 from 90 views",
        size: "views",
        error: "image error",
        bench: "`radon`, group `radon/backprojection/256x256x90x256`",
    },
    Question {
        title: "Reconstruct a large slice",
        answer: "FBP of 2048 x 2048 pixels from 2880 views by Fourier gridding; `finufft-1e-4` has the tolerance 1e-4.",
        study: "FBP",
        case: "shepp-logan 2048, 1 x 2048 x 2048 from 2880 views",
        size: "views",
        error: "image error",
        bench: "`slices`, groups `radon/large/...`",
    },
    Question {
        title: "Project a volume",
        answer: "Forward projection of 256^3 voxels into 90 views, compared with exact bin averages.\n`Joseph, ray by ray` is a plain implementation.",
        study: "projectors",
        case: "shell, 256 x 256 x 256 from 90 views, against bin means",
        size: "views",
        error: "relative L2 difference after a least-squares scale factor",
        bench: "`projector`, groups `projector/forward/...`",
    },
    Question {
        title: "Find an equilibrium",
        answer: "The inner membrane of the study (stiffness 1) at the intensity f = 17.5, from its reference configuration. The reference volume has a\nrelative uncertainty of 3e-11; smaller errors are not significant.",
        study: "static solve",
        case: "balloon at f = 17.5, from rest",
        size: "degree or mesh points",
        error: "relative error of the volume",
        bench: "`membrane`, groups `membrane/gain-0.6` and `membrane/rubber-gain-0.6`",
    },
    Question {
        title: "Follow a motion",
        answer: "The inner membrane with 101 nodes (stiffness, mass and damping 1) from its reference configuration at f = 17.5 until t = 5.\nTimes are processor times. The reference is Tsit45 of diffsol at a tolerance of 1e-13.",
        study: "motion",
        case: "balloon at f = 17.5 to t = 5, 101 nodes",
        size: "time steps",
        error: "largest distance of a node from the reference, cm",
        bench: "`motion`",
    },
    Question {
        title: "Acquire views through a collimator, in a chest",
        answer: "64 views of a static heart in an attenuating chest with depth-dependent resolution, at two tolerances; the reference has 5e-5.",
        study: "SPECT",
        case: "64 exact views of a heart in a chest through a collimator",
        size: "bins per row",
        error: "relative L2 difference",
        bench: "`phantom --rows`",
    },
    Question {
        title: "Simulate a gated study",
        answer: "Projections and FBP reconstructions of 16 gates of 64 views, without noise.",
        study: "whole study",
        case: "16 gates of 64 views",
        size: "bins per row",
        error: "RMS difference of the first gate from its ground truth (wall activity 1)",
        bench: "`phantom --rows`",
    },
];

/// Prefixes of the names of methods of other packages, and of ours without the optimisation.
const RIVALS: [&str; 10] = [
    "astra",
    "rtk",
    "scikit-image",
    "finufft",
    "SciPy",
    "diffsol",
    "every plane",
    "as in a textbook",
    "Joseph, ray by ray",
    "every frustum",
];
/// Table rows of our methods, and of others.
const ROWS: usize = 4;

/// Returns the rows that no other row beats in both time and error, thinned to [`ROWS`].
fn best<'a>(rows: &[&'a Row], rival: bool) -> Vec<&'a Row> {
    let is_rival = |row: &Row| RIVALS.iter().any(|name| row.method.starts_with(name));
    let threads = rows.iter().map(|row| row.threads).max();
    let mut kind: Vec<&Row> = (rows.iter().copied())
        .filter(|row| is_rival(row) == rival && Some(row.threads) == threads)
        .collect();
    if kind.is_empty() {
        kind = (rows.iter().copied())
            .filter(|row| is_rival(row) == rival)
            .collect();
    }
    kind.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let mut least = f64::INFINITY;
    kind.retain(|row| {
        let better = row.error < least;
        least = least.min(row.error);
        better
    });
    let step = kind.len().saturating_sub(1).max(1) as f64 / (ROWS - 1) as f64;
    let mut shown: Vec<&Row> = (0..ROWS.min(kind.len()))
        .filter_map(|k| {
            kind.get((k as f64 * step.max(1.0)).round() as usize)
                .copied()
        })
        .collect();
    shown.dedup_by(|a, b| std::ptr::eq(*a, *b));
    shown
}

/// Returns the groups of the page in order.
pub(super) fn shown<'a>(rows: &'a [Row]) -> Vec<Group<'a>> {
    let mut groups = groups(rows);
    let place = |group: &Group<'_>| {
        (QUESTIONS.iter()).position(|q| (q.study, q.case) == (group.study, group.case))
    };
    groups.retain(|group| place(group).is_some());
    groups.sort_by_key(place);
    groups
}

/// Writes the whole page.
pub(super) fn markdown(rows: &[Row], machine: &Machine) -> String {
    let Machine {
        processor,
        threads,
        load,
        compiler,
        date,
        commit,
    } = machine;
    let mut page = format!(
        "# Run time against error\n\n\
        Measured by `cargo xtask report --peers` on {date} at commit {commit}: {processor}, {threads} hardware threads, {compiler},\n\
        load {load} at the start. Other programs ran in the same minute on the same input. Each time is the median of at least nine runs\n\
        after one warm-up run; the spread is (median - minimum) / minimum, bold above 10 %. Each table contains up to four rows of our\n\
        methods and up to four of other programs, without rows that are both slower and less accurate than another row of the same kind;\n\
        plots contain all rows, [performance.json](performance.json) all studies. An image error is the root mean square difference from\n\
        the exact pixel averages within the inscribed circle, after division of the image by its scale factor (the ratio of both means\n\
        inside the object, away from edges). The largest activity is 1.\n"
    );
    for group in shown(rows) {
        let Some(question) = QUESTIONS
            .iter()
            .find(|q| (q.study, q.case) == (group.study, group.case))
        else {
            continue;
        };
        let Question {
            title,
            answer,
            size,
            error,
            bench,
            ..
        } = question;
        let _ = write!(
            page,
            "\n## {title}\n\n{answer} Benchmark: {bench}.\n\n![{title}](img/{})\n\n| method | {size} | threads | time | spread | {error} |\n| --- | --- | --- | --- | --- | --- |\n",
            group.file()
        );
        for row in best(&group.rows, false)
            .into_iter()
            .chain(best(&group.rows, true))
        {
            let Row {
                method,
                size,
                threads,
                seconds,
                error,
                ..
            } = row;
            let time = in_units(*seconds);
            let mark = if row.is_steady() { "" } else { "**" };
            let spread = 100.0 * row.spread();
            let _ = writeln!(
                page,
                "| {method} | {size} | {threads} | {time} | {mark}{spread:.0} %{mark} | {error:.1e} |"
            );
        }
    }
    page
}

fn in_units(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.1} µs", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}
