//! Comparison with an earlier run: the ratio of each time and of each error.

use std::fmt::Write as _;
use std::path::Path;

use super::rows::{Measured, Row};

/// Rows with a larger ratio of times are marked; smaller ratios are within the noise of a machine with other work.
const SLOWER: f64 = 1.25;
/// Rows with a larger ratio of errors are marked; results are reproducible, except in rows that measure their own time.
const WORSE: f64 = 1.01;

/// The rows of an earlier docs/performance.json, and their commit.
pub(super) struct Earlier {
    rows: Vec<Row>,
    commit: String,
}

impl Earlier {
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let Measured { machine, rows } = Measured::read(path)?;
        let commit = machine.commit;
        Ok(Self { rows, commit })
    }

    /// Writes a line for each common row, with a verdict.
    pub(super) fn beside(&self, rows: &[Row]) -> String {
        let mut text = format!(
            "against {}: time and error over those of then\n",
            self.commit
        );
        let (mut times, mut slower, mut worse) = (Vec::new(), 0, 0);
        for row in rows {
            let Some(then) = self.rows.iter().find(|then| same(row, then)) else {
                continue;
            };
            let time = row.seconds / then.seconds;
            let (error, is_worse) = match (row.error, then.error) {
                (0.0, 0.0) => (String::from("1.00"), false),
                (now, 0.0) => (format!("0 -> {now:.0e}"), true),
                (now, then) => (format!("{:.2}", now / then), now > WORSE * then),
            };
            let marks = match (time > SLOWER, is_worse) {
                (false, false) => "",
                (true, false) => "  slower",
                (false, true) => "  worse",
                (true, true) => "  slower, worse",
            };
            times.push(time);
            slower += usize::from(time > SLOWER);
            worse += usize::from(is_worse);
            let Row {
                study,
                method,
                case,
                size,
                threads,
                ..
            } = row;
            let _ = writeln!(
                text,
                "{time:8.2} {error:>9}  {study}, {case}: {method}, size {size}, threads {threads}{marks}"
            );
        }
        times.sort_by(f64::total_cmp);
        let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
        let alone = |of: &[Row], in_others: &[Row]| {
            let missing = |row: &&Row| !in_others.iter().any(|other| same(row, other));
            of.iter().filter(missing).count()
        };
        let _ = match times.len() {
            0 => writeln!(text, "no common row"),
            n => writeln!(
                text,
                "{n} rows, median of the times {median:.2}; {slower} slower than {SLOWER}, {worse} with a larger error; {} new, {} gone",
                alone(rows, &self.rows),
                alone(&self.rows, rows)
            ),
        };
        text
    }
}

/// Whether two rows have the same question and method.
fn same(a: &Row, b: &Row) -> bool {
    let key = |row: &Row| {
        let Row {
            study,
            method,
            case,
            error_kind,
            ..
        } = row;
        [study, method, case, error_kind].map(String::clone)
    };
    a.size == b.size && a.threads == b.threads && key(a) == key(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::machine::Machine;
    use crate::report::rows::parse;
    use std::fs;

    fn row(method: &str, size: usize, seconds: f64, error: f64) -> Row {
        let line = format!(
            r#"row {{"study":"s","method":"{method}","case":"c","size":{size},"threads":1,"seconds":{seconds},"least":{seconds},"repeats":9,"error":{error},"error_kind":"rms"}}"#
        );
        parse(&line).unwrap().remove(0)
    }

    #[test]
    fn ratios_are_printed_and_worse_rows_are_marked() {
        let then = [
            row("a", 1, 1.0, 0.1),
            row("a", 2, 2.0, 0.1),
            row("b", 1, 1.0, 0.0),
            row("gone", 1, 1.0, 0.1),
        ];
        let path = std::env::temp_dir().join(format!("xtask-against-{}.json", std::process::id()));
        let measured = Measured {
            machine: Machine::example(),
            rows: then.to_vec(),
        };
        fs::write(&path, measured.json().unwrap()).unwrap();
        let earlier = Earlier::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        let now = [
            row("a", 1, 0.5, 0.1),
            row("a", 2, 3.0, 0.2),
            row("b", 1, 1.1, 1e-3),
            row("new", 1, 1.0, 0.1),
        ];
        let text = earlier.beside(&now);
        for wanted in [
            "against abc1234",
            "    0.50      1.00  s, c: a, size 1, threads 1\n",
            "    1.50      2.00  s, c: a, size 2, threads 1  slower, worse\n",
            "    1.10 0 -> 1e-3  s, c: b, size 1, threads 1  worse\n",
            "3 rows, median of the times 1.10; 1 slower than 1.25, 2 with a larger error; 1 new, 1 gone\n",
        ] {
            assert!(text.contains(wanted), "{wanted} in\n{text}");
        }
        assert!(earlier.beside(&[]).contains("no common row"));
        assert!(Earlier::read(&path).is_err());
        let kept = Earlier::read(&crate::workspace::root().join("docs/performance.json")).unwrap();
        assert!(!kept.rows.is_empty());
    }
}
