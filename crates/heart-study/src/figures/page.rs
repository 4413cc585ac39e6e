//! `index.html`: the figures in order with captions, and tables of numbers, in one file without scripts.

use super::{CURVES_SIZE, Picture};
use crate::StudyError;
use crate::html::document;
use heart_phantom::files::write_atomically;
use maud::{Markup, Render, html};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A page of figures and tables in a folder. It writes the images that are added to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Page {
    folder: PathBuf,
    title: String,
    introduction: Vec<String>,
    sections: Vec<Section>,
}

/// A part of a page: text, then figures, then tables.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Section {
    title: String,
    text: String,
    figures: Vec<Illustration>,
    tables: Vec<Table>,
}

/// An image file with its caption, which is also the alternative text.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Illustration {
    /// Relative to the page.
    file: String,
    caption: String,
    /// Width and height in pixels, so that the page does not jump while it loads.
    size: [u32; 2],
}

/// A table of formatted numbers; the first cell of a row names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Table {
    caption: String,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Page {
    /// The name of the page in its folder.
    pub(crate) const FILE: &str = "index.html";

    /// A page with a heading and paragraphs below it.
    pub(crate) fn new(folder: &Path, title: &str, introduction: Vec<String>) -> Self {
        Self {
            folder: folder.into(),
            title: title.into(),
            introduction,
            sections: Vec::new(),
        }
    }

    /// Starts a part of the page with a paragraph.
    pub(crate) fn section(&mut self, title: &str, text: impl Into<String>) {
        self.sections.push(Section {
            title: title.into(),
            text: text.into(),
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
        picture.write_png(&self.folder.join(file))?;
        self.figure(file, [picture.width(), picture.height()], caption);
        Ok(())
    }

    /// Writes an SVG of [`curves`](super::curves()) and adds it to the current part.
    pub(crate) fn drawing(
        &mut self,
        file: &str,
        svg: &str,
        caption: impl Into<String>,
    ) -> Result<(), StudyError> {
        write_atomically(&self.folder.join(file), |out| out.write_all(svg.as_bytes()))?;
        self.figure(file, CURVES_SIZE.into(), caption);
        Ok(())
    }

    /// Adds an image file of the folder, of some pixels, to the current part.
    pub(super) fn figure(&mut self, file: &str, size: [u32; 2], caption: impl Into<String>) {
        self.current().figures.push(Illustration {
            file: file.into(),
            caption: caption.into(),
            size,
        });
    }

    /// Adds a table to the current part; the first cell of a row names it.
    pub(crate) fn table(&mut self, caption: &str, header: &[&str], rows: Vec<Vec<String>>) {
        let table = Table::new(caption, header, rows);
        self.current().tables.push(table);
    }

    fn current(&mut self) -> &mut Section {
        if self.sections.is_empty() {
            self.sections.push(Section::default());
        }
        let last = self.sections.len() - 1;
        &mut self.sections[last]
    }

    /// Returns the page as one HTML document; all text is escaped.
    pub(super) fn to_html(&self) -> String {
        let body = html! {
            @for text in &self.introduction { p { (text) } }
            @if self.sections.len() > 1 {
                nav { ol {
                    @for (i, section) in self.sections.iter().enumerate() {
                        li { a href={ "#part" (i + 1) } { (section.title) } }
                    }
                } }
            }
            main {
                @for (i, section) in self.sections.iter().enumerate() {
                    section id={ "part" (i + 1) } {
                        h2 { (section.title) }
                        @if !section.text.is_empty() { p { (section.text) } }
                        @for figure in &section.figures { (figure) }
                        @for table in &section.tables { (table) }
                    }
                }
            }
        };
        document(&self.title, "", &body)
    }

    /// Writes the page; returns the names of its images and its own.
    pub(crate) fn write(&self) -> Result<Vec<PathBuf>, StudyError> {
        let html = self.to_html();
        write_atomically(&self.folder.join(Self::FILE), |out| {
            out.write_all(html.as_bytes())
        })?;
        let figures = self.sections.iter().flat_map(|section| &section.figures);
        let files = figures.map(|figure| figure.file.as_str());
        Ok(files.chain([Self::FILE]).map(PathBuf::from).collect())
    }
}

impl Render for Illustration {
    fn render(&self) -> Markup {
        let ([width, height], file) = (self.size, address(&self.file));
        html! {
            figure {
                a href=(file) {
                    img src=(file) width=(width) height=(height) loading="lazy" alt=(self.caption);
                }
                figcaption { (self.caption) }
            }
        }
    }
}

impl Table {
    pub(crate) fn new(caption: &str, header: &[&str], rows: Vec<Vec<String>>) -> Self {
        Self {
            caption: caption.into(),
            header: header.iter().map(|&name| name.into()).collect(),
            rows,
        }
    }
}

impl Render for Table {
    fn render(&self) -> Markup {
        html! {
            div.wide { table {
                caption { (self.caption) }
                thead { tr { @for cell in &self.header { th scope="col" { (cell) } } } }
                tbody {
                    @for row in &self.rows { tr {
                        @for (k, cell) in row.iter().enumerate() {
                            @if k == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                        }
                    } }
                }
            } }
        }
    }
}

/// Returns a relative file name as a URL: everything except letters, digits and `-._~/` is percent-encoded.
fn address(file: &str) -> String {
    let mut safe = String::with_capacity(file.len());
    for byte in file.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte) {
            safe.push(char::from(byte));
        } else {
            let _ = write!(safe, "%{byte:02X}");
        }
    }
    safe
}
