//! The commands of `heart-phantom cohort`.

use super::arguments::{Arguments, Cohort as Command, Shards};
use super::commands::{Done, bar, init};
use super::output::{Answer, Failure};
use super::slurm::sbatch;
use heart_cohort::{
    Cohort, Row, RunOptions, Shard, Survey, VerifyReport, export, merge, run_shard, survey, verify,
};
use indicatif::BinaryBytes;
use serde_json::json;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

/// Runs in the thread pool of the arguments.
pub(crate) fn run(arguments: &Arguments, command: &Command) -> Done {
    match command {
        Command::Init { clinical, file } => {
            let text = match clinical {
                true => Cohort::CLINICAL,
                false => Cohort::TEMPLATE,
            };
            init(file.as_deref(), text.to_owned())
        }
        Command::Check { cohort, members } => {
            let found = survey(&Cohort::load(cohort)?, *members, &options(arguments))?;
            Ok(Answer::Report(json!(found), lines(&found)))
        }
        Command::Run { cohort, out, shard } => shards(arguments, cohort, out, shard.clone()),
        Command::Merge { dir } => merged(dir),
        Command::Verify {
            cohort,
            out,
            members,
            seed,
        } => {
            let cohort = Cohort::load(cohort)?;
            let report = verify(&cohort, out, *members, *seed, &options(arguments))?;
            verified(&report)
        }
        Command::Export {
            cohort,
            member,
            out,
        } => {
            let files = export(
                &Cohort::load(cohort)?,
                *member,
                out,
                options(arguments).memory,
            )?;
            let names: Vec<String> = (files.iter())
                .map(|file| out.join(file).to_string_lossy().into_owned())
                .collect();
            Ok(Answer::Report(json!({ "files": names }), names))
        }
        Command::Slurm(options) => sbatch(arguments, options),
    }
}

/// Reports a verification; faults are a failure.
fn verified(report: &VerifyReport) -> Done {
    let mut found = json!({
        "shards": report.shards, "complete": report.complete, "members": report.recomputed, "rejected": report.rejected,
        "warned": report.warned, "faults": report.faults,
    });
    let line = format!(
        "{} of {} shards are complete{}; {} members were recomputed and are bitwise identical",
        report.complete,
        report.shards,
        warned(report.warned),
        report.recomputed.len()
    );
    let faults = report.faults.iter().map(ToString::to_string);
    let lines: Vec<String> = faults.chain([line]).collect();
    if report.faults.is_empty() {
        return Ok(Answer::Report(found, lines));
    }
    found["error"] = json!(lines[0]);
    found["code"] = json!(1);
    Err(Failure::Report(found, lines))
}

/// Writes one manifest of all shards of a directory.
fn merged(dir: &Path) -> Done {
    let report = merge(dir)?;
    let found = json!({
        "members": report.members, "rejected": report.rejected, "warned": report.warned, "shards": report.shards, "bytes": report.bytes,
        "files": [report.path.to_string_lossy()],
    });
    let line = format!(
        "{} members in {} shards ({}), {} rejected{}",
        report.members,
        report.shards,
        BinaryBytes(report.bytes),
        report.rejected,
        warned(report.warned)
    );
    let written = format!("  {}", report.path.display());
    Ok(Answer::Report(found, vec![line, written]))
}

/// The number of members with warnings, which the manifest lists; empty for none.
fn warned(count: u64) -> String {
    match count {
        0 => String::new(),
        count => format!(", {count} with warnings"),
    }
}

fn options(arguments: &Arguments) -> RunOptions {
    let mut options = RunOptions::new(rayon::current_num_threads());
    if let Some(mib) = arguments.memory {
        options.memory = mib << 20;
    }
    options
}

fn shards(arguments: &Arguments, cohort: &Path, out: &Path, shards: Shards) -> Done {
    let cohort = Cohort::load(cohort)?;
    let of = shards.of;
    let which = shards.which;
    let (mut made, mut skipped, mut members, mut rejected, mut bytes) = (0, 0, 0, 0, 0);
    let (mut with_warnings, mut first, mut first_warning) = (0, None, None);
    let bar = bar(arguments);
    let total: u64 = (which.clone())
        .map(|shard| Shard { shard, of }.members(&cohort))
        .try_fold(0, |sum, range| {
            range.map(|range| sum + range.end - range.start)
        })?;
    bar.set_length(total);
    for shard in which {
        let progress = |done| {
            bar.set_position(members + done);
            ControlFlow::Continue(())
        };
        let report = run_shard(
            &cohort,
            out,
            Shard { shard, of },
            &options(arguments),
            &progress,
        )?;
        skipped += u64::from(report.skipped);
        made += u64::from(!report.skipped);
        rejected += report.rejected;
        with_warnings += report.warned;
        members += report.rows.len() as u64;
        bytes += report.bytes;
        let reason = |row: Row| {
            row.rejected
                .map(|reason| format!("{} rejected: {reason}", row.key))
        };
        let warning = |row: &Row| Some(format!("{} warning: {}", row.key, row.warnings.first()?));
        first_warning = first_warning.or_else(|| report.rows.iter().find_map(warning));
        first = first.or_else(|| report.rows.into_iter().find_map(reason));
    }
    bar.finish_and_clear();
    let mut found = json!({
        "shards_made": made, "shards_skipped": skipped, "members": members, "rejected": rejected, "warned": with_warnings,
        "bytes": bytes,
    });
    let line = format!(
        "{made} shards computed, {skipped} already complete; {members} members ({}), {rejected} rejected{}, in {}",
        BinaryBytes(bytes),
        warned(with_warnings),
        out.display()
    );
    let mut lines = vec![line];
    for (key, first) in [("first_rejected", first), ("first_warning", first_warning)] {
        if let Some(first) = first {
            found[key] = json!(first);
            lines.push(format!("  {first}"));
        }
    }
    if rejected < members {
        return Ok(Answer::Report(found, lines));
    }
    found["error"] = json!(format!("all {members} members are rejected"));
    found["code"] = json!(2);
    Err(Failure::Report(found, lines))
}

/// Formats seconds in a unit in which the number is not small.
fn duration(seconds: f64) -> String {
    let (amount, unit) = match seconds {
        _ if seconds < 100.0 => (seconds, "seconds"),
        _ if seconds < 6000.0 => (seconds / 60.0, "minutes"),
        _ => (seconds / 3600.0, "hours"),
    };
    format!("{amount:.1} {unit}")
}

fn lines(found: &Survey) -> Vec<String> {
    let mut lines = vec![format!(
        "{} members; {} draws for the first {}",
        found.members, found.draws, found.drawn
    )];
    for (case, count) in found.cases.iter().filter(|(case, _)| !case.is_empty()) {
        lines.push(format!("  {case}: {count} members"));
    }
    for field in &found.fields {
        let range = field
            .range
            .map_or("names or tables".to_owned(), |[least, mean, most]| {
                format!("{least:.4} to {most:.4}, mean {mean:.4}")
            });
        let few = field
            .values
            .map_or(String::new(), |n| format!(", {n} distinct values"));
        lines.push(format!("  {}: {range}{few}", field.path));
    }
    for (key, reason) in &found.rejected {
        lines.push(format!("  {key} rejected: {reason}"));
    }
    // warnings that differ only in their numbers are one
    let mut kinds = BTreeMap::new();
    for (warning, count) in &found.warnings {
        let kind = warning.replace(|c: char| c.is_ascii_digit() || c == '.', "");
        kinds.entry(kind).or_insert((warning, 0)).1 += count;
    }
    for (warning, count) in kinds.values() {
        lines.push(format!("  {count} times: warning: {warning}"));
    }
    let seconds = found.members as f64 / found.members_per_second;
    lines.push(format!(
        "{} in total; {:.2} members per second on {} threads ({} computed): {} for all",
        BinaryBytes(found.bytes),
        found.members_per_second,
        found.threads,
        found.tried,
        duration(seconds)
    ));
    lines
}
