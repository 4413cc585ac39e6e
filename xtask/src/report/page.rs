//! The page: a table and a plot a case.

use std::fmt::Write as _;

use super::machine::Machine;
use super::rows::Row;

/// Rows that answer the same question.
pub(super) struct Group<'a> {
    pub(super) study: &'a str,
    pub(super) case: &'a str,
    pub(super) rows: Vec<&'a Row>,
}

impl Group<'_> {
    /// Name of its plot.
    pub(super) fn file(&self) -> String {
        let name = format!("performance {} {}", self.study, self.case).to_lowercase();
        let words = name.split(|c: char| !c.is_ascii_alphanumeric());
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        format!("{}.svg", words.join("-"))
    }

    /// Its rows by method and threads, each a curve.
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

/// The rows by study and case, in the order in which these first appear.
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
    // cases of one study stand together, wherever they were measured
    let first = |study: &str| rows.iter().position(|row| row.study == study);
    groups.sort_by_key(|group| first(group.study));
    groups
}

/// The whole page; `flags` are those the report was called with.
pub(super) fn markdown(rows: &[Row], machine: &Machine, flags: &str) -> String {
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
        Written by `cargo xtask report{flags}` on {date} at commit {commit}. {processor}, {threads} hardware threads,\n\
        {compiler}; load {load} before it began (above 1, other work took a share, of two threads most). With `--peers`\n\
        the rows of other software, measured in the same run on the same inputs, stand beside ours. All numbers:\n\
        [performance.json](performance.json).\n\n\
        A time is the median of some repeats, of processor time for the motion and of wall time elsewhere, after one run that\n\
        does not count. Every plot has the error to the right and the time upwards, both as logarithms: the better method stands\n\
        further down and further to the left. Errors of zero are in the tables only.\n"
    );
    let mut study = "";
    for group in groups(rows) {
        if group.study != study {
            study = group.study;
            let _ = write!(page, "\n## {study}\n");
        }
        let kind = &group.rows[0].error_kind;
        let _ = write!(
            page,
            "\n### {}\n\n![{}: {}](img/{})\n\n| method | size | threads | time | {kind} |\n| --- | --- | --- | --- | --- |\n",
            group.case,
            group.study,
            group.case,
            group.file()
        );
        for row in &group.rows {
            let Row {
                method,
                size,
                threads,
                seconds,
                error,
                ..
            } = row;
            let time = in_units(*seconds);
            let _ = writeln!(
                page,
                "| {method} | {size} | {threads} | {time} | {error:.1e} |"
            );
        }
    }
    page
}

fn in_units(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.1} us", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}
