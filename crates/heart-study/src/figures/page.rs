//! `index.html`: the figures in order with captions, and tables of numbers, in one file without scripts.

use super::{CURVES_SIZE, Picture};
use crate::html::{document, table};
use heart_phantom::PhantomError;
use heart_phantom::files::write_atomically;
use maud::{Markup, PreEscaped, Render, html};
use std::path::{Path, PathBuf};

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

    /// Writes an SVG of [`curves`](super::curves()) and adds it to the current part.
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
    pub(super) fn figure(&mut self, file: &str, [width, height]: [u32; 2], caption: impl Render) {
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
    pub(super) fn to_html(&self) -> String {
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
