//! Closest-point correspondences in both directions between model and readings, pruned as in Table 1 of the paper.

use super::{Association, IndexImage, ModelPoints, Observation, Pair, PairingConfig, PairingStats};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::{Label, PointTree};

/// Scratch of pairing.
#[derive(Default)]
pub struct PairingScratch {
    /// The model drawn into the grid.
    pub image: IndexImage,
    facing: Vec<u32>,
    facing_points: Vec<P3>,
    /// Per model point: position at its last tree query, and the cell found ([`NO_ANSWER`] without one).
    reading_cache: Vec<(P3, u32)>,
    point_cache: PointCache,
}

/// Last answers of the tree over the model's points.
#[derive(Default)]
struct PointCache {
    /// Positions of all model points when the tree was built.
    positions: Vec<P3>,
    /// Model point found for each reading, in the order of the queries.
    points: Vec<u32>,
}

impl PairingScratch {
    /// Drops all cached answers: readings have changed.
    pub fn forget(&mut self) {
        self.reading_cache.clear();
        self.point_cache.positions.clear();
    }
}

/// Absent answer of a tree query.
const NO_ANSWER: u32 = u32::MAX;
/// True for the same bone or neighbours in the tree: eq. 9 relaxed at joints, whose points belong to either side.
fn is_consistent(parents: &[Option<usize>], a: u8, b: u8) -> bool {
    let (a, b) = (usize::from(a), usize::from(b));
    a == b || parents[a] == Some(b) || parents[b] == Some(a)
}

/// Finds pairs between the model and the observation in both directions, into `pairs`.
pub fn pair_surfaces(
    model: &ModelPoints<'_>,
    observation: &Observation<'_>,
    config: &PairingConfig,
    scratch: &mut PairingScratch,
    pairs: &mut Vec<Pair>,
) -> PairingStats {
    pairs.clear();
    let grid = observation.grid;
    scratch
        .image
        .draw(grid, model.positions, model.normals, model.spacing);
    let search = PairSearch {
        model,
        observation,
        config,
        tree: observation
            .tree
            .filter(|_| config.association == Association::KdTree),
        focal: grid.focal()[0].max(grid.focal()[1]),
    };
    let mut stats = PairingStats::default();
    search.model_to_data(scratch, pairs, &mut stats);
    search.data_to_model(scratch, pairs, &mut stats);
    stats
}

struct PairSearch<'a> {
    model: &'a ModelPoints<'a>,
    observation: &'a Observation<'a>,
    config: &'a PairingConfig,
    /// Tree over the readings when the search is exact.
    tree: Option<&'a PointTree>,
    /// Larger focal length, cells.
    focal: f32,
}

impl PairSearch<'_> {
    /// Pairs each visible model point with its closest compatible reading.
    fn model_to_data(
        &self,
        scratch: &mut PairingScratch,
        pairs: &mut Vec<Pair>,
        stats: &mut PairingStats,
    ) {
        let settings = &self.config.settings;
        let (model, grid) = (self.model, self.observation.grid);
        scratch
            .reading_cache
            .resize(model.positions.len(), (P3::origin(), NO_ANSWER));
        scratch.facing.clear();
        scratch.facing_points.clear();
        for (i, (p, n)) in model.positions.iter().zip(model.normals).enumerate() {
            if n.dot(&p.coords) > -settings.least_facing * p.coords.norm() {
                continue;
            }
            scratch.facing.push(i as u32);
            scratch.facing_points.push(*p);
            let Some((u, v)) = grid.cell_of(p) else {
                continue;
            };
            let Some(home) = grid.cell(u, v) else {
                continue;
            };
            if p.z > scratch.image.depth[home] + settings.relaxed_visibility {
                continue;
            }
            stats.visible += 1;
            let best = match self.tree {
                Some(tree) => {
                    let cache = &mut scratch.reading_cache[i];
                    self.nearest_reading(tree, p, n, cache, &mut stats.reused)
                }
                None => self.reading_in_window(u, v, p, n),
            };
            let Some(cell) = best else {
                stats.unknown += usize::from(grid.labels[home] == Label::Unknown);
                continue;
            };
            let back = scratch.image.index[cell];
            let bones = model.bones;
            if back != IndexImage::NONE
                && !is_consistent(model.parents, bones[i], bones[back as usize])
            {
                stats.inconsistent += 1;
                continue;
            }
            stats.from_model += 1;
            pairs.push(Pair {
                model: i as u32,
                cell: cell as u32,
                from_data: false,
            });
        }
        stats.hidden = model.positions.len() - stats.visible;
    }

    /// Pairs each reading with its closest compatible model point; readings without one may pull.
    fn data_to_model(
        &self,
        scratch: &mut PairingScratch,
        pairs: &mut Vec<Pair>,
        stats: &mut PairingStats,
    ) {
        let settings = &self.config.settings;
        let (model, grid) = (self.model, self.observation.grid);
        let mut cache = std::mem::take(&mut scratch.point_cache);
        let tree = self.refresh_point_tree(&scratch.facing_points, &mut cache);
        let columns = grid.size().0;
        let cells = self.observation.cells;
        let mut unexplained = 0usize;
        for &cell in cells.iter().step_by(self.config.data_step.max(1)) {
            let k = cell as usize;
            let (c, n) = (grid.points[k], grid.normals[k]);
            if grid.depth[k] <= 0.0 {
                continue;
            }
            stats.readings += 1;
            let best = if self.tree.is_some() {
                let i = match &tree {
                    Some(tree) => {
                        let i = tree
                            .nearest(&c, f32::INFINITY)
                            .map_or(NO_ANSWER, |(i, _)| scratch.facing[i]);
                        cache.points.push(i);
                        i
                    }
                    None => {
                        stats.reused += 1;
                        let query = stats.readings - 1;
                        cache.points.get(query).copied().unwrap_or(NO_ANSWER)
                    }
                };
                self.compatible_point(i, &c, &n)
            } else {
                let (u, v) = ((k % columns) as i32, (k / columns) as i32);
                self.point_in_window(u, v, &scratch.image, &c, &n)
            };
            let pulled = if best.is_some() {
                stats.explained += 1;
                best.filter(|_| !self.observation.false_edges[k])
            } else if self.config.pull > 0.0 {
                unexplained += 1;
                unexplained
                    .is_multiple_of(settings.pull_stride)
                    .then(|| pull_target(model, scratch, &c, &n, self.config.pull))
                    .flatten()
            } else {
                None
            };
            pairs.extend(pulled.map(|model| Pair {
                model,
                cell,
                from_data: true,
            }));
        }
        scratch.point_cache = cache;
    }

    /// True within the displacement that keeps an earlier answer.
    fn is_near(&self, a: &P3, b: &P3) -> bool {
        (a - b).norm_squared() <= self.config.settings.reuse * self.config.settings.reuse
    }

    fn is_short(&self, a: &P3, b: &P3) -> bool {
        (a - b).norm_squared() < self.config.distance * self.config.distance
    }

    /// Half width of a search window at depth `z`, cells.
    fn window(&self, z: f32) -> i32 {
        let settings = &self.config.settings;
        let cells =
            (self.config.distance * self.focal / z.max(settings.nearest_depth)).ceil() as i32;
        cells.clamp(1, settings.max_window[0])
    }

    /// Nearest reading by tree, or the cached one, when it passes distance, edge and normal.
    fn nearest_reading(
        &self,
        tree: &PointTree,
        p: &P3,
        n: &V3,
        cache: &mut (P3, u32),
        reused: &mut usize,
    ) -> Option<usize> {
        let (grid, observation) = (self.observation.grid, self.observation);
        let (at, mut cell) = *cache;
        if cell != NO_ANSWER && self.is_near(&at, p) {
            *reused += 1;
        } else {
            cell = tree
                .nearest(p, f32::INFINITY)
                .map_or(NO_ANSWER, |(k, _)| observation.cells[k]);
            *cache = (*p, cell);
        }
        (cell != NO_ANSWER)
            .then_some(cell as usize)
            .filter(|&k| self.is_short(&grid.points[k], p))
            .filter(|&k| {
                !observation.false_edges[k]
                    && grid.normals[k].dot(n) >= self.config.settings.cos_normal
            })
    }

    fn reading_in_window(&self, u: i32, v: i32, p: &P3, n: &V3) -> Option<usize> {
        let (grid, observation) = (self.observation.grid, self.observation);
        let radius = self.window(p.z);
        let stride = if radius > self.config.settings.thinned_window[0] {
            2
        } else {
            1
        };
        self.closest_in_window(u, v, radius, stride, |k, bound| {
            if grid.labels[k] != Label::Person {
                return None;
            }
            let d = (grid.points[k] - p).norm_squared();
            let fits = d < bound
                && grid.normals[k].dot(n) >= self.config.settings.cos_normal
                && !observation.false_edges[k];
            fits.then_some((d, k))
        })
    }

    fn point_in_window(&self, u: i32, v: i32, image: &IndexImage, c: &P3, n: &V3) -> Option<u32> {
        let settings = &self.config.settings;
        let radius = self.window(c.z).min(settings.max_window[1]);
        let stride = if radius > settings.thinned_window[1] {
            2
        } else {
            1
        };
        self.closest_in_window(u, v, radius, stride, |k, bound| {
            let i = image.index[k];
            if i == IndexImage::NONE {
                return None;
            }
            let d = (self.model.positions[i as usize] - c).norm_squared();
            let fits = d < bound
                && self.model.normals[i as usize].dot(n) >= self.config.settings.cos_normal;
            fits.then_some((d, i))
        })
    }

    /// Closest candidate in a square window of cells around `home`. `candidate` receives a cell and the squared bound,
    /// m², and returns a squared distance below it with its answer.
    #[inline]
    fn closest_in_window<T>(
        &self,
        u: i32,
        v: i32,
        radius: i32,
        stride: i32,
        candidate: impl Fn(usize, f32) -> Option<(f32, T)>,
    ) -> Option<T> {
        let (columns, rows) = self.observation.grid.size();
        let mut best = None;
        let mut bound = self.config.distance * self.config.distance;
        let mut y = (v - radius).max(0);
        while y <= (v + radius).min(rows as i32 - 1) {
            let row = y as usize * columns;
            let mut x = (u - radius).max(0);
            while x <= (u + radius).min(columns as i32 - 1) {
                if let Some((d, found)) = candidate(row + x as usize, bound) {
                    bound = d;
                    best = Some(found);
                }
                x += stride;
            }
            y += stride;
        }
        best
    }

    /// Builds a tree over the facing points and empties the cache, unless all cached answers still hold.
    fn refresh_point_tree(&self, facing: &[P3], cache: &mut PointCache) -> Option<PointTree> {
        let positions = self.model.positions;
        let holds = self.config.settings.reuse > 0.0
            && cache.positions.len() == positions.len()
            && cache
                .positions
                .iter()
                .zip(positions)
                .all(|(a, b)| self.is_near(a, b));
        if self.tree.is_none() || holds {
            return None;
        }
        cache.points.clear();
        cache.positions.clear();
        cache.positions.extend_from_slice(positions);
        Some(PointTree::new(facing))
    }

    /// The answer `i` of a tree query when it passes distance and normal.
    fn compatible_point(&self, i: u32, c: &P3, n: &V3) -> Option<u32> {
        let (positions, normals) = (self.model.positions, self.model.normals);
        (i != NO_ANSWER)
            .then_some(i)
            .filter(|&i| self.is_short(&positions[i as usize], c))
            .filter(|&i| normals[i as usize].dot(n) >= self.config.settings.cos_normal)
    }
}

/// Nearest facing model point within `reach` metres whose normal is within 90° of the reading's.
fn pull_target(
    model: &ModelPoints<'_>,
    scratch: &PairingScratch,
    c: &P3,
    n: &V3,
    reach: f32,
) -> Option<u32> {
    let mut best = None;
    let mut bound = reach * reach;
    for (p, &i) in scratch.facing_points.iter().zip(&scratch.facing) {
        let d = (p - c).norm_squared();
        if d < bound && model.normals[i as usize].dot(n) >= 0.0 {
            bound = d;
            best = Some(i);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::RegistrationSettings;
    use tryon_geometry::camera::{DepthImage, Intrinsics};
    use tryon_geometry::spatial::OrganisedCloud;

    /// Readings of a sphere of 0.3 m at 2 m, and model points of it displaced by `shift`.
    fn sphere(shift: V3) -> Scanned {
        let k = Intrinsics {
            width: 320,
            height: 240,
            fx: 262.5,
            fy: 262.5,
            cx: 159.5,
            cy: 119.5,
        };
        let centre = V3::new(0.0, 0.0, 2.0);
        let data = (0..k.pixels()).map(|i| {
            let d = k.unproject((i % 320) as f32, (i / 320) as f32, 1.0).coords;
            let (a, b, c) = (
                d.norm_squared(),
                d.dot(&centre),
                centre.norm_squared() - 0.09,
            );
            let disc = b * b - a * c;
            if disc < 0.0 {
                0
            } else {
                ((b - disc.sqrt()) / a * 1000.0).round() as u16
            }
        });
        let image = DepthImage::new(320, 240, data.collect()).expect("sizes agree");
        let mut cloud = OrganisedCloud::new(&k, Some(2));
        cloud.sample(&image, 8.0);
        let cells: Vec<u32> = (0..cloud.depth.len())
            .filter(|&i| cloud.depth[i] > 0.0)
            .map(|i| i as u32)
            .collect();
        cells
            .iter()
            .for_each(|&c| cloud.labels[c as usize] = Label::Person);
        cloud.refine(&image, &cells);
        let (mut positions, mut normals) = (vec![], vec![]);
        for i in 0..1500 {
            // Fibonacci sphere.
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 1500.0;
            let (r, t) = ((1.0 - y * y).sqrt(), i as f32 * 2.399_963);
            let n = V3::new(r * t.cos(), y, r * t.sin());
            positions.push(P3::from(centre + n * 0.3 + shift));
            normals.push(n);
        }
        let points: Vec<P3> = cells.iter().map(|&c| cloud.points[c as usize]).collect();
        Scanned {
            tree: PointTree::new(&points),
            no_edges: vec![false; cloud.depth.len()],
            bones: vec![0; positions.len()],
            cloud,
            cells,
            positions,
            normals,
        }
    }

    struct Scanned {
        cloud: OrganisedCloud,
        cells: Vec<u32>,
        tree: PointTree,
        no_edges: Vec<bool>,
        positions: Vec<P3>,
        normals: Vec<V3>,
        bones: Vec<u8>,
    }

    impl Scanned {
        fn pair(
            &self,
            positions: &[P3],
            config: &PairingConfig,
            scratch: &mut PairingScratch,
        ) -> (PairingStats, Vec<Pair>) {
            let model = ModelPoints {
                positions,
                normals: &self.normals,
                bones: &self.bones,
                parents: &[None],
                spacing: 0.028,
            };
            let observation = Observation {
                grid: &self.cloud,
                cells: &self.cells,
                false_edges: &self.no_edges,
                true_edges: &[],
                tree: Some(&self.tree),
            };
            let mut pairs = vec![];
            let stats = pair_surfaces(&model, &observation, config, scratch, &mut pairs);
            (stats, pairs)
        }
        fn length(&self, pair: &Pair, positions: &[P3]) -> f32 {
            (self.cloud.points[pair.cell as usize] - positions[pair.model as usize]).norm()
        }
    }

    fn config() -> PairingConfig {
        PairingConfig {
            association: Association::KdTree,
            distance: 0.1,
            pull: 0.0,
            data_step: 1,
            settings: RegistrationSettings {
                reuse: 0.0,
                ..RegistrationSettings::default()
            },
        }
    }

    #[test]
    fn pairs_of_both_searches_respect_table_1() {
        let s = sphere(V3::new(0.03, -0.02, 0.02));
        for association in [Association::Projective, Association::KdTree] {
            let config = PairingConfig {
                association,
                ..config()
            };
            let (stats, pairs) = s.pair(&s.positions, &config, &mut PairingScratch::default());
            assert!(
                stats.visible > 500 && stats.from_model * 10 > stats.visible * 8,
                "{association:?} {stats:?}"
            );
            assert!(
                stats.explained * 10 > stats.readings * 8,
                "{association:?} {stats:?}"
            );
            for p in &pairs {
                assert!(s.length(p, &s.positions) < config.distance);
                let (ours, theirs) = (p.model as usize, p.cell as usize);
                assert!(
                    s.cloud.normals[theirs].dot(&s.normals[ours]) >= config.settings.cos_normal
                );
            }
        }
    }

    #[test]
    fn window_pairs_are_as_short_as_tree_pairs() {
        let s = sphere(V3::new(0.01, 0.0, 0.0));
        let mean = |association| {
            let config = PairingConfig {
                association,
                distance: 0.05,
                ..config()
            };
            let (_, pairs) = s.pair(&s.positions, &config, &mut PairingScratch::default());
            let sum: f32 = pairs.iter().map(|p| s.length(p, &s.positions)).sum();
            sum / pairs.len() as f32
        };
        let (window, exact) = (mean(Association::Projective), mean(Association::KdTree));
        assert!(
            window < exact + 0.005,
            "mean pair length {window} against {exact}"
        );
    }

    #[test]
    fn cached_answers_hold_within_their_bound_until_forgotten() {
        const REUSE: f32 = 2e-3;
        let s = sphere(V3::new(0.01, 0.0, 0.0));
        let (exact, mut config) = (config(), config());
        config.settings.reuse = REUSE;
        let mut scratch = PairingScratch::default();
        let (stats, first) = s.pair(&s.positions, &config, &mut scratch);
        assert_eq!(stats.reused, 0, "an empty cache");
        let (stats, again) = s.pair(&s.positions, &config, &mut scratch);
        assert_eq!(
            (stats.reused, &again),
            (stats.visible + stats.readings, &first),
            "the same positions"
        );
        let shifted = |x: f32| -> Vec<P3> {
            let shift = V3::new(x, 0.0, 0.0);
            s.positions.iter().map(|p| p + shift).collect()
        };
        let near = shifted(0.8 * REUSE);
        let (stats, kept) = s.pair(&near, &config, &mut scratch);
        assert!(stats.reused > stats.visible, "{stats:?}");
        let (_, shortest) = s.pair(&near, &exact, &mut PairingScratch::default());
        let of_model = |pairs: &[Pair]| {
            let own = pairs.iter().filter(|p| !p.from_data);
            own.map(|p| (p.model, s.length(p, &near)))
                .collect::<Vec<_>>()
        };
        let best: std::collections::BTreeMap<u32, f32> = of_model(&shortest).into_iter().collect();
        let worst = of_model(&kept)
            .iter()
            .filter_map(|(i, d)| Some(d - best.get(i)?))
            .fold(0.0, f32::max);
        assert!(worst <= 2.0 * REUSE, "{worst} m longer than the shortest");
        let far = shifted(3.0 * REUSE);
        assert_eq!(s.pair(&far, &config, &mut scratch).0.reused, 0, "too far");
        scratch.forget();
        let (stats, _) = s.pair(&far, &config, &mut scratch);
        assert_eq!(stats.reused, 0, "readings changed");
    }

    #[test]
    fn no_readings_and_non_finite_points_give_no_pairs() {
        let mut s = sphere(V3::zeros());
        (s.cells, s.tree) = (vec![], PointTree::new(&[]));
        let config = PairingConfig {
            pull: 0.3,
            ..config()
        };
        let mut scratch = PairingScratch::default();
        let (stats, pairs) = s.pair(&s.positions, &config, &mut scratch);
        assert_eq!((stats.readings, pairs.len()), (0, 0));
        let nan = vec![P3::new(f32::NAN, f32::NAN, f32::NAN); s.positions.len()];
        assert_eq!(s.pair(&nan, &config, &mut scratch).1.len(), 0);
    }
}
