//! Garments of a benchmark and the solver that simulates them.

use tryon_body::{Pose, RestBody, Template};
use tryon_cloth::Config;
use tryon_dressing::{DressOptions, Dressed, dress};
use tryon_garment::{Size, library};
use tryon_geometry::math::World;

/// Outfit of a benchmark.
#[derive(Clone, Debug, PartialEq)]
pub struct OutfitSpec {
    /// Names of the library's garments, innermost first.
    pub garments: Vec<String>,
    /// Edge length of the triangles (m).
    pub edge: f64,
    /// Solver.
    pub config: Config,
}

impl OutfitSpec {
    /// Puts the garments on a standing body, each in the size that `size` returns for its name.
    pub(super) fn dress(
        &self,
        template: &Template,
        rest: &RestBody,
        standing: &Pose<World>,
        size: impl Fn(&str) -> Result<Size, String>,
    ) -> Result<Dressed, String> {
        let pattern = |g: &String| library::pattern(g, size(g)?).map_err(|e| e.to_string());
        let patterns = self.garments.iter().map(pattern);
        let patterns = patterns.collect::<Result<Vec<_>, _>>()?;
        let mut options = DressOptions {
            config: self.config,
            ..DressOptions::default()
        };
        options.triangulation.edge_length = self.edge;
        dress(template, rest, standing, &patterns, &options).map_err(|e| e.to_string())
    }
}
