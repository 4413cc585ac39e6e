//! Scatter of a heart in a chest of water, in four directions.

use photon_scatter::*;

/// A ball of radius 4 cm with activity 1 per cm^3, 5 cm to the left and 5 cm in front of the axis.
struct Heart;

impl Source for Heart {
    fn emit(&self, random: &mut Random) -> Emission {
        let (r, direction) = (4.0 * random.uniform().cbrt(), random.direction());
        Emission {
            position: std::array::from_fn(|k| [5.0, 5.0, 0.0][k] + r * direction[k]),
            weight: 4.0 / 3.0 * std::f64::consts::PI * 64.0,
        }
    }
}

/// An elliptic cylinder of water, 40 cm wide and 25 cm deep.
struct Chest;

impl Medium for Chest {
    fn pieces(&self, p: [f64; 3], d: [f64; 3], pieces: &mut Vec<Piece>) {
        let (px, py, vx, vy) = (p[0] / 20.0, p[1] / 12.5, d[0] / 20.0, d[1] / 12.5);
        let vv = (vx * vx + vy * vy).max(1e-12);
        let middle = -(px * vx + py * vy) / vv;
        let half = ((1.0 - (px * vy - py * vx).powi(2) / vv) / vv).max(0.0);
        pieces.push(Piece {
            enter: middle - half.sqrt(),
            exit: middle + half.sqrt(),
            density: 1.0,
        });
    }
}

fn main() -> Result<(), ScatterError> {
    let response = Response {
        slope: 0.0186,
        at_face: 0.0637,
        intrinsic: 0.161,
    };
    let (radius, degrees) = (25.0, [0.0f64, 90.0, 180.0, 270.0]);
    let angles = degrees.map(f64::to_radians);
    let views = angles.map(|angle| View { angle, radius });
    let camera = Camera::new([64; 2], [0.64; 2], &views, response)?;
    let spectrum = Spectrum::new(140.5, 0.1, &[[126.45, 154.55]])?;
    let options = ScatterOptions::new(0.01);
    let scatter = Scatter::new(&Heart, &Chest, &camera, &spectrum, &options)?;
    for (view, degrees) in degrees.iter().enumerate() {
        let samples = scatter.view(0, view);
        let sum = samples.iter().sum::<f64>() * 0.64 * 0.64;
        let largest = samples.iter().fold(0.0, |a: f64, b| a.max(*b));
        println!("{degrees:3} degrees: largest sample {largest:.3} cm, sum {sum:.2} cm^3");
    }
    println!("largest error {:.4} cm", scatter.largest_error());
    println!("{:#?}", scatter.report());
    Ok(())
}
