//! Watertight triangle meshes, and their STL and PLY files.

use std::f64::consts::PI;
use std::io::{self, Write};

use nalgebra::{Point3, Vector3};

use crate::error::{positive, room, within};
use crate::solid::meridian::Meridian;
use crate::solid::segment::on_chord;
use crate::{Body, RevolveError};

/// A closed triangle mesh: every edge belongs to two triangles, oriented counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Mesh {
    /// Vertices; those of [`Body::mesh`] are in the lab frame.
    pub vertices: Vec<Point3<f64>>,
    /// Outward unit normal at each vertex (the average of both sides on a crease).
    pub normals: Vec<Vector3<f64>>,
    /// Indices of the three vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Body {
    /// Returns a mesh of the surface of one layer in the lab frame, with vertices on it and distances of at most `tolerance`. The number of
    /// triangles scales as 1 / `tolerance`. A mesh encloses a volume for any valid tolerance: it has at least three facets around the axis, and
    /// every part of the meridian at least one point off its chord.
    ///
    /// A layer is the filled solid; a wall has the meshes of its layer and of the next inner one. The volume of the mesh is less than that of
    /// the solid: by the fraction `2/3 tolerance / r_max` from the n facets around the axis (exactly `1 - sin(2 pi / n) / (2 pi / n)`), and
    /// by at most half the tolerance times the area from the chords of convex meridians (concave ones add as much).
    ///
    /// ```
    /// use revolve_voxel::{Body, Meridian, Pose};
    /// let rod = Meridian::new(&[[0.0, 2.0], [3.0, 2.0]])?;
    /// let volume = rod.mass_properties().volume;
    /// let mesh = Body::new(vec![rod], Pose::identity())?.mesh(0, 0.01)?;
    /// let (error, expected) = (mesh.volume() / volume - 1.0, -2.0 / 3.0 * 0.01 / 2.0);
    /// assert!((error / expected - 1.0).abs() < 0.1);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::NotPositive`] for the tolerance, [`RevolveError::OutOfRange`] above the largest radius; [`RevolveError::NoSuchLayer`]; [`RevolveError::TooFine`] above 2^31
    /// vertices; [`RevolveError::TooLarge`] if memory cannot be allocated.
    pub fn mesh(&self, layer: usize, tolerance: f64) -> Result<Mesh, RevolveError> {
        positive("tolerance", tolerance)?;
        let meridian = self.layer(layer)?;
        within("tolerance", tolerance, [0.0, meridian.r_max()])?;
        // Half the tolerance along the meridian, half around it: r (1 - cos(pi / n)) <= tolerance / 2.
        let bend = (1.0 - 0.5 * tolerance / meridian.r_max())
            .clamp(-1.0, 1.0)
            .acos();
        let n_around = ((PI / bend).ceil()).max(3.0);
        let outlines = outlines(meridian, 0.5 * tolerance);
        let n_rings: usize = outlines.iter().map(|s| s.points.len()).sum();
        if n_around * n_rings as f64 > f64::from(i32::MAX) {
            return Err(RevolveError::TooFine {
                tolerance,
                most: i32::MAX as usize,
            });
        }
        let n = n_around as usize;
        // At most one ring per point, and two triangles from each vertex of a ring to the next ring.
        let mut mesh = Mesh {
            vertices: room("points of a mesh", n * n_rings)?,
            normals: room("normals of a mesh", n * n_rings)?,
            triangles: room("triangles of a mesh", 2 * n * n_rings)?,
        };
        for outline in &outlines {
            let first = mesh.vertices.len() as u32;
            let mut rings: Vec<Ring> = Vec::new();
            for (p, normal) in outline.points.iter().zip(&outline.normals) {
                simd_set::unit(n_rings);
                let start = mesh.vertices.len() as u32;
                let on_axis = p[1] == 0.0;
                for k in 0..if on_axis { 1 } else { n } {
                    let (sin, cos) = (2.0 * PI * k as f64 / n as f64).sin_cos();
                    let at = Point3::new(p[0], p[1] * cos, p[1] * sin);
                    let out = Vector3::new(normal[0], normal[1] * cos, normal[1] * sin);
                    mesh.vertices.push(self.pose().to_lab(&at));
                    mesh.normals.push(self.pose().isometry().rotation * out);
                }
                rings.push(Ring { start, on_axis });
            }
            for pair in rings.windows(2) {
                simd_set::checkpoint();
                mesh.join(pair[0], pair[1], n as u32);
            }
            if outline.closed {
                let last = rings[rings.len() - 1];
                mesh.join(
                    last,
                    Ring {
                        start: first,
                        on_axis: false,
                    },
                    n as u32,
                );
            }
        }
        Ok(mesh)
    }
}

#[derive(Clone, Copy)]
struct Ring {
    start: u32,
    on_axis: bool,
}

/// A part of the meridian from axis to axis, or closed.
struct Outline {
    points: Vec<[f64; 2]>,
    normals: Vec<[f64; 2]>,
    closed: bool,
}

/// Returns the meridian simplified to a tolerance.
fn outlines(meridian: &Meridian, tolerance: f64) -> Vec<Outline> {
    let mut outlines = Vec::new();
    let segments = meridian.segments();
    let mut first = 0;
    for k in 0..segments.len() {
        let ends = k + 1 == segments.len() || segments[k].r1 == 0.0;
        if !ends {
            continue;
        }
        let run = &segments[first..=k];
        first = k + 1;
        let mut points: Vec<[f64; 2]> = run.iter().map(|s| s.start()).collect();
        points.push(run[run.len() - 1].end());
        let closed = points[0] == points[points.len() - 1] && points[0][1] > 0.0;
        let middle = points.len() / 2;
        let end = if closed { middle } else { points.len() - 1 };
        // A coarser tolerance would keep nothing but a chord.
        let height = (0..points.len()).map(|k| off_chord(&points, 0, end, k));
        let tolerance = tolerance.min(0.5 * height.fold(0.0, f64::max));
        let mut kept = vec![0];
        if closed {
            // Simplified in two halves, because a closed curve has no chord from end to end.
            thin(&points, 0, middle, tolerance, &mut kept);
            thin(&points, middle, points.len() - 1, tolerance, &mut kept);
            kept.pop();
        } else {
            thin(&points, 0, points.len() - 1, tolerance, &mut kept);
        }
        let normal = |i: usize| {
            let v = run
                .get(i)
                .map_or(run[run.len() - 1].end_normal, |s| s.start_normal);
            let n = v[0].hypot(v[1]);
            [v[0] / n, v[1] / n]
        };
        outlines.push(Outline {
            normals: kept.iter().map(|&i| normal(i)).collect(),
            points: kept.iter().map(|&i| points[i]).collect(),
            closed,
        });
    }
    outlines
}

/// Distance of point k from the chord between a and b.
fn off_chord(points: &[[f64; 2]], a: usize, b: usize, k: usize) -> f64 {
    on_chord(points[k], [points[a], points[b]])[1].sqrt()
}

/// Keeps points farther than the tolerance from the chords (Ramer, Douglas & Peucker), including the end.
fn thin(points: &[[f64; 2]], a: usize, b: usize, tolerance: f64, kept: &mut Vec<usize>) {
    let mut stack = vec![(a, b)];
    while let Some((a, b)) = stack.pop() {
        let mut worst = (0.0, a);
        for k in a + 1..b {
            let off = off_chord(points, a, b, k);
            // The first of equal distances, independent of rounding: an arc has two.
            if off > worst.0 * (1.0 + 1e-9) {
                worst = (off, k);
            }
        }
        if worst.0 > tolerance {
            stack.push((worst.1, b));
            stack.push((a, worst.1));
        } else {
            kept.push(b);
        }
    }
}

impl Mesh {
    /// Creates a mesh from its lists, which are not checked: see [`Mesh::volume`], [`Mesh::write_stl`] and [`Mesh::write_ply`].
    #[must_use]
    pub fn new(
        vertices: Vec<Point3<f64>>,
        normals: Vec<Vector3<f64>>,
        triangles: Vec<[u32; 3]>,
    ) -> Self {
        Self {
            vertices,
            normals,
            triangles,
        }
    }

    /// Two neighbouring rings; the meridian runs from the first to the second with the solid on its right.
    fn join(&mut self, a: Ring, b: Ring, n: u32) {
        for k in 0..n {
            let next = (k + 1) % n;
            let at = |ring: Ring, k: u32| {
                if ring.on_axis {
                    ring.start
                } else {
                    ring.start + k
                }
            };
            if !a.on_axis {
                self.triangles.push([at(a, k), at(a, next), at(b, k)]);
            }
            if !b.on_axis {
                self.triangles.push([at(a, next), at(b, next), at(b, k)]);
            }
        }
    }

    /// Returns the vertices of a triangle, if its indices are valid.
    fn corners(&self, triangle: &[u32; 3]) -> Option<[&Point3<f64>; 3]> {
        let [a, b, c] = triangle.map(|k| self.vertices.get(k as usize));
        Some([a?, b?, c?])
    }

    /// Returns the enclosed volume by the divergence theorem; NaN for an invalid index.
    #[must_use]
    pub fn volume(&self) -> f64 {
        // Relative to one of its vertices, which avoids cancellation far from the origin.
        let about = self.vertices.first().copied().unwrap_or_default();
        self.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = self.corners(t)?.map(|p| p - about);
                Some(a.dot(&b.cross(&c)) / 6.0)
            })
            .sum::<Option<f64>>()
            .unwrap_or(f64::NAN)
    }

    /// Writes a binary STL file (32-bit floats, facet normals). The first 80 bytes of `comment`, for example the unit of the
    /// vertices, are its header, which readers ignore. It must not begin with `solid`, the header of a text file.
    ///
    /// # Errors
    /// Errors of the writer; `InvalidInput` for an invalid index and for such a comment.
    pub fn write_stl(&self, comment: &str, mut to: impl Write) -> io::Result<()> {
        if comment.starts_with("solid") {
            let what = "the header of a binary STL file must not begin with `solid`";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
        let mut header = [0; 80];
        (header.iter_mut().zip(comment.bytes())).for_each(|(to, byte)| *to = byte);
        to.write_all(&header)?;
        to.write_all(&(self.triangles.len() as u32).to_le_bytes())?;
        for t in &self.triangles {
            let [a, b, c] = self.corners(t).ok_or_else(|| unknown_point(t))?;
            let normal = (b - a)
                .cross(&(c - a))
                .try_normalize(0.0)
                .unwrap_or_default();
            for v in [normal, a.coords, b.coords, c.coords] {
                write_f32(&mut to, &v)?;
            }
            to.write_all(&[0; 2])?;
        }
        Ok(())
    }

    /// Writes a binary PLY file (little-endian, 32-bit floats, with point normals).
    ///
    /// # Errors
    /// Errors of the writer; `InvalidInput` for an invalid index or a different number of normals and vertices.
    pub fn write_ply(&self, mut to: impl Write) -> io::Result<()> {
        if let Some(t) = self.triangles.iter().find(|t| self.corners(t).is_none()) {
            return Err(unknown_point(t));
        }
        let (points, normals) = (self.vertices.len(), self.normals.len());
        if points != normals {
            let message = format!("{normals} normals of {points} points");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        write!(
            to,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\n",
            self.vertices.len()
        )?;
        for name in ["x", "y", "z", "nx", "ny", "nz"] {
            writeln!(to, "property float {name}")?;
        }
        write!(
            to,
            "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.triangles.len()
        )?;
        for (v, n) in self.vertices.iter().zip(&self.normals) {
            write_f32(&mut to, &v.coords)?;
            write_f32(&mut to, n)?;
        }
        for t in &self.triangles {
            to.write_all(&[3])?;
            for k in t {
                to.write_all(&(*k as i32).to_le_bytes())?;
            }
        }
        Ok(())
    }
}

fn unknown_point(triangle: &[u32; 3]) -> io::Error {
    let message = format!("triangle {triangle:?} names a point that does not exist");
    io::Error::new(io::ErrorKind::InvalidInput, message)
}

fn write_f32(to: &mut impl Write, v: &Vector3<f64>) -> io::Result<()> {
    for c in v.iter() {
        to.write_all(&(*c as f32).to_le_bytes())?;
    }
    Ok(())
}
