//! HTML pages; text and attributes are escaped by construction.

use crate::figures::{CURVES_SIZE, Picture};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use heart_phantom::PhantomError;
use heart_phantom::files::write_atomically;
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};
use std::path::{Path, PathBuf};

const STYLE: &str = include_str!("../assets/page.css");

/// A document with a heading; `style` is added to the rules of every page.
pub(crate) fn document(title: &str, style: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(style)) }
            }
            body {
                h1 { (title) }
                (body)
            }
        }
    };
    page.into_string() + "\n"
}

/// A part of a page under its heading.
pub(crate) fn section(title: &str, body: &Markup) -> Markup {
    html! { section { h2 { (title) } (body) } }
}

/// A table; the first cell of a row names it.
pub(crate) fn table(caption: &str, header: &[&str], rows: Vec<Vec<String>>) -> Markup {
    html! {
        div.wide { table {
            caption { (caption) }
            thead { tr { @for cell in header { th scope="col" { (cell) } } } }
            tbody {
                @for row in rows { tr {
                    @for (k, cell) in row.iter().enumerate() {
                        @if k == 0 { th scope="row" { (cell) } } @else { td { (cell) } }
                    }
                } }
            }
        } }
    }
}

/// An embedded image with its caption, which is also the alternative text.
///
/// # Errors
/// [`PhantomError::File`] if the image cannot be encoded.
pub(crate) fn figure(picture: &Picture, caption: &str) -> Result<Markup, PhantomError> {
    let png = STANDARD.encode(picture.to_png()?);
    Ok(html! {
        figure {
            img src={ "data:image/png;base64," (png) } width=(picture.width) height=(picture.height) alt=(caption);
            figcaption { (caption) }
        }
    })
}

/// A page of figures and tables in a folder. It writes the images that are added to it.
#[derive(Debug)]
pub(crate) struct Page {
    folder: PathBuf,
    title: String,
    introduction: Vec<String>,
    /// Heading and content of each part.
    parts: Vec<(String, String)>,
    /// Names of the images.
    files: Vec<PathBuf>,
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
            parts: Vec::new(),
            files: Vec::new(),
        }
    }

    /// Starts a part of the page with a paragraph.
    pub(crate) fn section(&mut self, title: &str, text: impl Render) {
        let text = html! { p { (text) } };
        self.parts.push((title.into(), text.into_string()));
    }

    /// Writes an image and adds it to the current part.
    pub(crate) fn picture(
        &mut self,
        file: &str,
        picture: &Picture,
        caption: impl Render,
    ) -> Result<(), PhantomError> {
        picture.write_png(&self.folder.join(file))?;
        self.figure(file, [picture.width, picture.height], caption);
        Ok(())
    }

    /// Writes an SVG of [`curves`](crate::figures::curves()) and adds it to the current part.
    pub(crate) fn drawing(
        &mut self,
        file: &str,
        svg: &str,
        caption: impl Render,
    ) -> Result<(), PhantomError> {
        write_atomically(&self.folder.join(file), |out| out.write_all(svg.as_bytes()))?;
        self.figure(file, CURVES_SIZE.into(), caption);
        Ok(())
    }

    /// Adds an image file of the folder to the current part; its caption is also the alternative text. The size in pixels keeps the
    /// page from moving while it loads.
    pub(crate) fn figure(&mut self, file: &str, [width, height]: [u32; 2], caption: impl Render) {
        self.files.push(file.into());
        self.add(html! {
            figure {
                a href=(file) {
                    img src=(file) width=(width) height=(height) loading="lazy" alt=(caption);
                }
                figcaption { (caption) }
            }
        });
    }

    /// Adds a table to the current part; the first cell of a row names it.
    pub(crate) fn table(&mut self, caption: &str, header: &[&str], rows: Vec<Vec<String>>) {
        self.add(table(caption, header, rows));
    }

    /// Adds to the current part.
    fn add(&mut self, content: Markup) {
        if let Some((_, part)) = self.parts.last_mut() {
            part.push_str(&content.into_string());
        }
    }

    /// Returns the page as one HTML document; all text is escaped.
    pub(crate) fn to_html(&self) -> String {
        let body = html! {
            @for text in &self.introduction { p { (text) } }
            nav { ol {
                @for (i, (title, _)) in self.parts.iter().enumerate() {
                    li { a href={ "#part" (i + 1) } { (title) } }
                }
            } }
            main {
                @for (i, (title, content)) in self.parts.iter().enumerate() {
                    section id={ "part" (i + 1) } { h2 { (title) } (PreEscaped(content)) }
                }
            }
        };
        document(&self.title, "", &body)
    }

    /// Writes the page; returns the names of its images and its own.
    pub(crate) fn write(&self) -> Result<Vec<PathBuf>, PhantomError> {
        let html = self.to_html();
        write_atomically(&self.folder.join(Self::FILE), |out| {
            out.write_all(html.as_bytes())
        })?;
        let page = PathBuf::from(Self::FILE);
        Ok(self.files.iter().cloned().chain([page]).collect())
    }
}
