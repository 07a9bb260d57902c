//! The dance of `../shared/data/garments/cipc_apache2` (Apache-2.0): 121 bodies of 12,811 vertices.

use super::EvaluateError;
use std::io::Read;
use std::path::Path;
use tryon_formats::obj::read_obj;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::TriMesh;

const BODIES: &str = "rumba_dancing_121x12811x3_f32le.bin.gz";
const FACES: &str = "wm2_15k.obj";
/// Time between two bodies (s).
fn interval() -> f64 {
    1.0 / 25.0
}

/// A dancing body without a known template.
#[derive(Clone, Debug)]
pub(super) struct DanceBodies {
    /// The first one (world, metres).
    pub(super) mesh: TriMesh,
    /// Vertices of each, world, metres, shape `(bodies, vertices)`.
    bodies: Vec<Vec<P3>>,
}

pub(super) fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::new("dance", why)
}

impl DanceBodies {
    /// Reads the dance.
    ///
    /// # Errors
    /// A file that is missing or does not fit the others.
    pub(super) fn read(folder: &Path) -> Result<Self, EvaluateError> {
        let faces = read_obj(&folder.join(FACES)).map_err(fault)?.mesh;
        let mut bytes = Vec::new();
        std::fs::File::open(folder.join(BODIES))
            .and_then(|f| flate2::read::GzDecoder::new(f).read_to_end(&mut bytes))
            .map_err(|e| fault(format!("{BODIES}: {e}")))?;
        let n = faces.vertices().len();
        let numbers: Vec<f32> = bytes
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        let is_whole = n > 0 && numbers.len().is_multiple_of(3 * n);
        if !is_whole || numbers.iter().any(|x| !x.is_finite()) {
            return Err(fault(format!(
                "{BODIES}: {} numbers are no bodies of {n} vertices",
                numbers.len()
            )));
        }
        let bodies: Vec<Vec<P3>> = numbers
            .chunks_exact(3 * n)
            .map(|b| {
                b.chunks_exact(3)
                    .map(|p| P3::new(p[0], p[1], p[2]))
                    .collect()
            })
            .collect();
        let first = bodies
            .first()
            .ok_or_else(|| fault(format!("{BODIES}: empty")))?;
        let mesh = faces.with_vertices(first.clone()).map_err(fault)?;
        Ok(Self { mesh, bodies })
    }

    /// Body at a time (s), interpolated between its two neighbours (m).
    pub(super) fn at(&self, time: f64) -> Vec<P3> {
        let at = (time / interval()).clamp(0.0, (self.bodies.len() - 1) as f64);
        let (i, share) = (at as usize, at.fract() as f32);
        let next = &self.bodies[(i + 1).min(self.bodies.len() - 1)];
        let between = self.bodies[i].iter().zip(next);
        between.map(|(a, b)| a + (b - a) * share).collect()
    }

    /// Length of the dance (s).
    pub(super) fn seconds(&self) -> f64 {
        (self.bodies.len() - 1) as f64 * interval()
    }
}
