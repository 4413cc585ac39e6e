//! Tangents of springs: by element, and by node in the parts of elastic force, pressure and total force.

use crate::band::BandMatrix;
use crate::chebyshev::local_index;
use crate::differences::{FiniteDifferences, NodeMaterial};
use crate::discrete::DiscreteMembrane;
use crate::error::MembraneError;
use crate::material::{ElementSprings, NodeSprings};
use crate::spectral::SpectralElements;

impl SpectralElements {
    /// `out` = derivative of the forces that element `e` contributes by its own nodes, as [`Tangent`] has it.
    pub(crate) fn element_tangent_into(
        &self,
        springs: &ElementSprings,
        e: usize,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        let p = self.degree();
        let (n, size) = (p + 1, 2 * (p + 1));
        let this = &self.elements[e];
        let per_s = 1.0 / (this.to - this.from);
        for i in 0..n {
            let derivative = &self.reference.derivative[i * n..(i + 1) * n];
            let elastic = &springs.matrix[i * n..(i + 1) * n];
            // the pressure force by c', row by row
            let mut by = [[0.0; 2]; 2];
            if i > 0 && i < p {
                let (d, scale) = self.direction(nodes, e, i)?;
                by = self.law().derivative(intensity * per_s, d, scale);
            }
            let first = 2 * local_index(i, p) * size;
            let (x_row, y_row) = out[first..first + 2 * size].split_at_mut(size);
            for j in 0..n {
                let column = 2 * local_index(j, p);
                x_row[column] = elastic[j] + by[0][0] * derivative[j];
                x_row[column + 1] = by[0][1] * derivative[j];
                y_row[column] = by[1][0] * derivative[j];
                y_row[column + 1] = elastic[j] + by[1][1] * derivative[j];
            }
        }
        Ok(())
    }

    /// Returns c' at node `i` of element `e`, and its factor in the pressure law.
    #[inline]
    pub(crate) fn direction(
        &self,
        nodes: &[f64],
        e: usize,
        i: usize,
    ) -> Result<([f64; 2], f64), MembraneError> {
        let p = self.degree();
        let row = &self.reference.derivative[i * (p + 1)..(i + 1) * (p + 1)];
        let local = nodes[self.window(e)].as_chunks::<2>().0;
        let mut d = [0.0; 2];
        for (a, c) in row.iter().zip(local) {
            d[0] += a * c[0];
            d[1] += a * c[1];
        }
        let per_s = 1.0 / (self.elements[e].to - self.elements[e].from);
        d = [d[0] * per_s, d[1] * per_s];
        // d is c' itself: the change per unit s
        Ok((d, self.law().factor(d, 1.0, e * p + i)?))
    }
}

impl FiniteDifferences {
    /// `band` += `scale` dF_e/dc. Block tridiagonal with diagonal blocks; pentadiagonal with
    /// second neighbours; independent of the state; symmetric among interior nodes.
    ///
    /// # Errors
    /// [`MembraneError::WrongLength`] if `band` has not the rows, [`MembraneError::TooFew`] if it has not the diagonals, of
    /// [`FiniteDifferences::band`]; [`MembraneError::OtherMaterial`].
    pub fn add_elastic_tangent_into(
        &self,
        scale: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        self.check_band(band)?;
        self.springs("elastic tangent of no state")?
            .add_tangent_into(scale, band);
        Ok(())
    }

    /// `band` += `scale` dF_p/dc at fixed intensity: the exact derivative (Eq. 14 with its signs
    /// corrected). Under the total-force law, f = F / S, the full derivative also has the rank-one part -(F / S^2) n (x) grad S, with n
    /// the [pressure force](DiscreteMembrane::pressure_force_into) at intensity 1.
    ///
    /// # Errors
    /// The neighbours of a node coincide; [`MembraneError::WrongLength`] of `nodes`; `band` as in
    /// [`FiniteDifferences::add_elastic_tangent_into`].
    pub fn add_pressure_tangent_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        scale: f64,
        band: &mut BandMatrix,
    ) -> Result<(), MembraneError> {
        self.setting.check_state(nodes)?;
        self.check_band(band)?;
        self.springs("pressure tangent of its own")?;
        let f = intensity * scale;
        for n in self.nodes.moving() {
            let (d, per_length) = self.normal(nodes, n)?;
            let (next, sign) = self.nodes.place(n + 1);
            let by = self.setting.law.derivative(f, d, per_length);
            for row in 0..2 {
                if self.nodes.is_fixed(n, row) {
                    continue;
                }
                band.add_inside(2 * n + row, 2 * next, by[row][0]);
                band.add_inside(2 * n + row, 2 * next + 1, sign * by[row][1]);
                band.add_inside(2 * n + row, 2 * n - 2, -by[row][0]);
                band.add_inside(2 * n + row, 2 * n - 1, -by[row][1]);
            }
        }
        Ok(())
    }

    fn springs(&self, what: &'static str) -> Result<&NodeSprings, MembraneError> {
        match &self.material {
            NodeMaterial::Springs(springs) => Ok(springs),
            NodeMaterial::Rubber(_) => Err(MembraneError::OtherMaterial { what }),
        }
    }
}
