//! Collects the figures and writes the page.

use crate::StudyError;
use crate::figures::{CURVES_SIZE, Illustration, Page, Picture, Section, Table};
use heart_phantom::files::write_atomically;
use std::path::{Path, PathBuf};

pub(crate) const PAGE: &str = "index.html";

/// Images written so far, and their page.
pub(crate) struct Gallery<'a> {
    out: &'a Path,
    sections: Vec<Section>,
}

impl<'a> Gallery<'a> {
    pub(crate) fn new(out: &'a Path) -> Self {
        Self {
            out,
            sections: Vec::new(),
        }
    }

    /// Starts a part of the page.
    pub(crate) fn section(&mut self, title: &str, text: impl Into<String>) {
        self.sections.push(Section {
            title: title.into(),
            text: vec![text.into()],
            ..Section::default()
        });
    }

    /// Writes an image and adds it to the current part.
    pub(crate) fn picture(
        &mut self,
        file: &str,
        picture: &Picture,
        caption: impl Into<String>,
    ) -> Result<(), StudyError> {
        picture.write_png(self.out.join(file))?;
        self.show(file, caption, [picture.width(), picture.height()]);
        Ok(())
    }

    /// Writes an SVG of curves and adds it to the current part.
    pub(crate) fn drawing(
        &mut self,
        file: &str,
        svg: &str,
        caption: impl Into<String>,
    ) -> Result<(), StudyError> {
        write_atomically(&self.out.join(file), |out| out.write_all(svg.as_bytes()))?;
        self.show(file, caption, CURVES_SIZE.into());
        Ok(())
    }

    fn show(&mut self, file: &str, caption: impl Into<String>, size: [u32; 2]) {
        self.current().figures.push(Illustration {
            file: file.into(),
            caption: caption.into(),
            size,
        });
    }

    /// Adds a table to the current part.
    pub(crate) fn table(&mut self, caption: &str, header: &[&str], rows: Vec<Vec<String>>) {
        self.current()
            .tables
            .push(Table::new(caption, header, rows));
    }

    /// Writes the page; returns the names of all files.
    pub(crate) fn finish(
        self,
        title: &str,
        introduction: Vec<String>,
    ) -> Result<Vec<PathBuf>, StudyError> {
        let figures = self.sections.iter().flat_map(|section| &section.figures);
        let mut files: Vec<PathBuf> = figures.map(|figure| (&figure.file).into()).collect();
        files.push(PAGE.into());
        let page = Page {
            title: title.into(),
            introduction,
            sections: self.sections,
        };
        page.write_html(self.out.join(PAGE))?;
        Ok(files)
    }

    fn current(&mut self) -> &mut Section {
        if self.sections.is_empty() {
            self.sections.push(Section::default());
        }
        let last = self.sections.len() - 1;
        &mut self.sections[last]
    }
}
