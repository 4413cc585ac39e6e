//! `index.html`: the figures in order with captions, and tables of numbers, in one file without scripts.

use crate::StudyError;
use crate::html::document;
use heart_phantom::check_length;
use heart_phantom::files::write_atomically;
use maud::{Markup, Render, html};
use std::fmt::Write as _;
use std::path::Path;

/// A page of figures and tables.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Page {
    /// Heading of the page.
    pub title: String,
    /// Paragraphs below it.
    pub introduction: Vec<String>,
    /// Parts of the page, in order.
    pub sections: Vec<Section>,
}

/// A part of a page: text, then figures, then tables.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Section {
    /// Heading.
    pub title: String,
    /// Paragraphs.
    pub text: Vec<String>,
    /// Figures, in order.
    pub figures: Vec<Illustration>,
    /// Tables, in order.
    pub tables: Vec<Table>,
}

/// An image file with its caption.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Illustration {
    /// File name, relative to the page.
    pub file: String,
    /// Caption, also the alternative text.
    pub caption: String,
    /// Width and height in pixels, so that the page does not jump while it loads.
    pub size: [u32; 2],
}

/// A table of formatted numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Caption.
    pub caption: String,
    /// Headings of the columns.
    pub header: Vec<String>,
    /// Rows of as many cells; the first names the row.
    pub rows: Vec<Vec<String>>,
}

impl Page {
    /// Returns the page as one HTML document; all text is escaped.
    ///
    /// # Errors
    /// [`StudyError::Phantom`] if a table's row has another number of cells than its header.
    pub fn to_html(&self) -> Result<String, StudyError> {
        for table in self.sections.iter().flat_map(|section| &section.tables) {
            for row in &table.rows {
                check_length("cells of a row", row.len(), table.header.len())?;
            }
        }
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
                        @for text in &section.text { p { (text) } }
                        @for figure in &section.figures { (figure) }
                        @for table in &section.tables { (table) }
                    }
                }
            }
        };
        Ok(document(&self.title, "", &body))
    }

    /// Writes the page atomically.
    ///
    /// # Errors
    /// As [`Page::to_html`], and [`StudyError::Phantom`] if the file cannot be written.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), StudyError> {
        let html = self.to_html()?;
        write_atomically(path.as_ref(), |out| out.write_all(html.as_bytes()))?;
        Ok(())
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
