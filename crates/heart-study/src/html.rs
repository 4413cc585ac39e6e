//! Self-contained HTML documents; text and attributes are escaped by construction.

use crate::figures::Picture;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use heart_phantom::PhantomError;
use maud::{DOCTYPE, Markup, PreEscaped, html};

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
