//! `index.html`: the figures in order with captions, and tables of numbers, in one file without scripts.

use crate::StudyError;
use std::fmt::Write as _;
use std::path::Path;

use super::{check};
use heart_phantom::files::write_atomically;

/// A page of figures and tables.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Page {
    /// Heading of the page.
    pub title: String,
    /// Paragraphs below it.
    pub introduction: Vec<String>,
    /// The page's parts, in order.
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

/// A picture file and what it shows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Illustration {
    /// File name, relative to the page.
    pub file: String,
    /// Caption; also read out in place of the picture.
    pub caption: String,
    /// Width and height in pixels, so that the page does not jump while it loads.
    pub size: [u32; 2],
}

/// A table of numbers, already written out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Caption.
    pub caption: String,
    /// Headings of the columns.
    pub header: Vec<String>,
    /// Rows of as many cells; the first names the row.
    pub rows: Vec<Vec<String>>,
}

const STYLE: &str = "\
:root{color-scheme:light}\
*{box-sizing:border-box}\
body{margin:0 auto;max-width:62rem;padding:1.2rem 1rem 4rem;background:#fff;color:#1c1c1c;\
font:1.05rem/1.6 'DejaVu Sans','Segoe UI',Roboto,Helvetica,Arial,sans-serif}\
h1{font-size:1.9rem;line-height:1.25;margin:.6rem 0 1rem}\
h2{font-size:1.35rem;line-height:1.3;margin:3rem 0 .6rem;padding-top:.8rem;border-top:1px solid #ddd}\
p{margin:.6rem 0;max-width:46rem}\
nav ol{margin:.4rem 0;padding-left:1.4rem}\
a{color:#00578a}\
figure{margin:1.6rem 0}\
figure img{display:block;max-width:100%;height:auto;margin:0 auto}\
figcaption,caption{font-size:.92rem;color:#444;text-align:left;padding:.5rem 0}\
figcaption{max-width:46rem;margin:0 auto}\
.wide{overflow-x:auto;margin:1.4rem 0}\
table{border-collapse:collapse;font-size:.92rem;font-variant-numeric:tabular-nums}\
th,td{padding:.32rem .8rem;text-align:right;border-bottom:1px solid #e4e4e4;white-space:nowrap}\
thead th{border-bottom:2px solid #1c1c1c}\
th:first-child,td:first-child{text-align:left;padding-left:0}\
tbody th{font-weight:normal}\
@media print{body{max-width:none;padding:0;font-size:10pt}nav{display:none}\
figure,table{break-inside:avoid}h2{break-after:avoid}a{color:inherit;text-decoration:none}}";

impl Page {
    /// The page as one HTML document; all text is escaped.
    ///
    /// # Errors
    /// [`StudyError::Mismatch`] if a table's row has another number of cells than its header.
    pub fn to_html(&self) -> Result<String, StudyError> {
        let mut html = head(&self.title, "");
        paragraphs(&mut html, &self.introduction);
        if self.sections.len() > 1 {
            html.push_str("<nav><ol>\n");
            for (i, section) in self.sections.iter().enumerate() {
                let _ = writeln!(
                    html,
                    "<li><a href=\"#part{}\">{}</a></li>",
                    i + 1,
                    escape(&section.title)
                );
            }
            html.push_str("</ol></nav>\n");
        }
        html.push_str("<main>\n");
        for (i, section) in self.sections.iter().enumerate() {
            let _ = writeln!(
                html,
                "<section id=\"part{}\">\n<h2>{}</h2>",
                i + 1,
                escape(&section.title)
            );
            paragraphs(&mut html, &section.text);
            for figure in &section.figures {
                figure.push(&mut html);
            }
            for table in &section.tables {
                table.push(&mut html)?;
            }
            html.push_str("</section>\n");
        }
        html.push_str("</main>\n</body>\n</html>\n");
        Ok(html)
    }

    /// Writes the page, whole or not at all.
    ///
    /// # Errors
    /// As [`Page::to_html`], and [`StudyError::Phantom`] if the file cannot be written.
    pub fn write_html(&self, path: impl AsRef<Path>) -> Result<(), StudyError> {
        let html = self.to_html()?;
        write_atomically(path.as_ref(), |out| out.write_all(html.as_bytes()))
            
    }
}

impl Illustration {
    fn push(&self, html: &mut String) {
        let [width, height] = self.size;
        let caption = escape(&self.caption);
        let _ = writeln!(
            html,
            "<figure>\n<a href=\"{file}\"><img src=\"{file}\" width=\"{width}\" height=\"{height}\" loading=\"lazy\" \
             alt=\"{caption}\"></a>\n<figcaption>{caption}</figcaption>\n</figure>",
            file = address(&self.file)
        );
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

    pub(crate) fn push(&self, html: &mut String) -> Result<(), StudyError> {
        // Writing to a String does not fail.
        let _ = write!(
            html,
            "<div class=\"wide\"><table>\n<caption>{}</caption>\n<thead><tr>",
            escape(&self.caption)
        );
        for cell in &self.header {
            let _ = write!(html, "<th scope=\"col\">{}</th>", escape(cell));
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            check::same_len("cells of a row", row.len(), self.header.len())?;
            html.push_str("<tr>");
            for (k, cell) in row.iter().enumerate() {
                let (open, close) = if k == 0 {
                    ("<th scope=\"row\">", "</th>")
                } else {
                    ("<td>", "</td>")
                };
                let _ = write!(html, "{open}{}{close}", escape(cell));
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody>\n</table></div>\n");
        Ok(())
    }
}

/// A document up to its heading, with more rules of style than those of every page.
pub(crate) fn head(title: &str, style: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>{STYLE}{style}</style>\n</head>\n<body>\n<h1>{title}</h1>\n",
        title = escape(title)
    )
}

fn paragraphs(html: &mut String, texts: &[String]) {
    for text in texts {
        let _ = writeln!(html, "<p>{}</p>", escape(text));
    }
}

/// Text for an element or a quoted attribute.
pub(crate) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            _ => safe.push(c),
        }
    }
    safe
}

/// A relative file name as an address: everything but letters, digits and `-._~/` percent-encoded.
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
