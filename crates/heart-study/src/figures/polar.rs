//! Polar maps of the 17 segments of the left ventricle, as SVG.

use super::style::ramp;
use maud::{Markup, html};

/// Walls of the segments of the basal and the middle ring, and of the apical ring, in the order of Cerqueira et al. 2002,
/// doi:10.1161/hc0402.102975.
const WALLS: [&str; 6] = [
    "anterior",
    "anteroseptal",
    "inferoseptal",
    "inferior",
    "inferolateral",
    "anterolateral",
];
const APICAL_WALLS: [&str; 4] = ["anterior", "septal", "inferior", "lateral"];
/// Width and height of a map, and the coordinates of its centre.
const SIZE: [f64; 2] = [280.0, 330.0];
const CENTRE: [f64; 2] = [140.0, 180.0];
/// Width of a ring.
const RING: f64 = 28.0;
/// Width of the colour bar with its labels, and its number of colours.
const BAR: f64 = 110.0;
const COLOURS: usize = 32;

/// Draws polar maps of the 17 segments of the American Heart Association side by side, with one colour scale from 0 to `largest`, and
/// returns the SVG, with an accessible label. The apex is in the centre, the anterior wall on top, the septum on the left. The numbers
/// are percent of `largest`. A map is a title and the values of segments 1 to 17.
pub(crate) fn polar_maps(maps: &[(&str, [f64; 17])], largest: f64, unit: &str) -> String {
    let titles: Vec<&str> = maps.iter().map(|(title, _)| *title).collect();
    let label = format!(
        "Polar maps of 17 segments: {}; percent of {largest:.4} {unit}",
        titles.join(", ")
    );
    let right = SIZE[0] * maps.len() as f64;
    let width = right + BAR;
    let svg = html! {
        svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label=(label) width=(width) height=(SIZE[1])
            viewBox={ "0 0 " (width) " " (SIZE[1]) } font-family="sans-serif" font-size="15" text-anchor="middle" {
            @for (k, (title, values)) in maps.iter().enumerate() {
                g transform={ "translate(" (SIZE[0] * k as f64) " 0)" } {
                    text x=(CENTRE[0]) y="20" font-size="17" { (title) }
                    (walls())
                    @for (segment, value) in values.iter().enumerate() { (drawn(segment, *value, largest)) }
                }
            }
            g transform={ "translate(" (right) " 0)" } { (colour_bar(largest, unit)) }
        }
    };
    svg.into_string()
}

/// Names of the walls around a map.
fn walls() -> Markup {
    let beyond = 4.0 * RING + 14.0;
    let [x, y] = CENTRE;
    let across = |x: f64, angle: f64| format!("translate({x} {y}) rotate({angle})");
    html! {
        text x=(x) y=(y - beyond + 6.0) { "anterior" }
        text x=(x) y=(y + beyond + 4.0) { "inferior" }
        text transform=(across(x - beyond + 6.0, -90.0)) { "septal" }
        text transform=(across(x + beyond - 6.0, 90.0)) { "lateral" }
    }
}

/// A segment with its value in percent.
fn drawn(segment: usize, value: f64, largest: f64) -> Markup {
    let fraction = (value / largest).clamp(0.0, 1.0);
    let ink = if fraction > 0.55 { "#000" } else { "#fff" };
    // Ring from the centre, number of sectors, the sector, and the name.
    let (ring, sectors, sector, name) = match segment {
        0..6 => (3.0, 6.0, segment, format!("basal {}", WALLS[segment])),
        6..12 => (2.0, 6.0, segment - 6, format!("mid {}", WALLS[segment - 6])),
        12..16 => {
            let name = format!("apical {}", APICAL_WALLS[segment - 12]);
            (1.0, 4.0, segment - 12, name)
        }
        _ => (0.0, 1.0, 0, "apex".to_owned()),
    };
    // Counter-clockwise from the anterior wall on top.
    let at = |radius: f64, sector: f64| {
        let angle = std::f64::consts::TAU * (0.25 + sector / sectors);
        [
            CENTRE[0] + radius * angle.cos(),
            CENTRE[1] - radius * angle.sin(),
        ]
    };
    let middle = sector as f64;
    let [from, to] = [middle - 0.5, middle + 0.5];
    let (inner, outer) = (RING * ring, RING * (ring + 1.0));
    let [x, y] = if ring > 0.0 {
        at(inner + 0.5 * RING, middle)
    } else {
        CENTRE
    };
    let point = |[x, y]: [f64; 2]| format!("{x:.2} {y:.2}");
    let outline = format!(
        "M{} A{outer} {outer} 0 0 0 {} L{} A{inner} {inner} 0 0 1 {} Z",
        point(at(outer, from)),
        point(at(outer, to)),
        point(at(inner, to)),
        point(at(inner, from))
    );
    html! {
        g {
            title { (segment + 1) " " (name) ": " (format!("{value:.4}")) }
            @if ring > 0.0 {
                path d=(outline) fill=(colour(fraction)) stroke="#fff" {}
            } @else {
                circle cx=(x) cy=(y) r=(outer) fill=(colour(fraction)) stroke="#fff" {}
            }
            text x=(format!("{x:.2}")) y=(format!("{:.2}", y + 5.0)) fill=(ink) { (format!("{:.0}", 100.0 * value / largest)) }
        }
    }
}

/// The colour scale from 0 to the largest value.
fn colour_bar(largest: f64, unit: &str) -> Markup {
    let (top, step) = (CENTRE[1] - 4.0 * RING, 8.0 * RING / COLOURS as f64);
    let bottom = top + step * COLOURS as f64;
    let fraction = |k: usize| (COLOURS as f64 - 0.5 - k as f64) / COLOURS as f64;
    html! {
        @for k in 0..COLOURS {
            rect x="6" y=(top + step * k as f64) width="16" height=(step + 0.5) fill=(colour(fraction(k))) {}
        }
        g text-anchor="start" {
            text x="6" y=(top - 12.0) { (unit) }
            text x="28" y=(top + 10.0) { (format!("{largest:.4}")) }
            text x="28" y=(bottom) { "0" }
        }
    }
}

fn colour(fraction: f64) -> String {
    let colour = ramp(fraction);
    format!("#{:02x}{:02x}{:02x}", colour.0, colour.1, colour.2)
}
