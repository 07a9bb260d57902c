//! Data uploaded for each picture. Layouts are those of `garments.wgsl`; padding has a name.

use crate::appearance::{Fabric, Print};
use crate::area::{Area, NEAR};
use crate::cloth_tile::ClothTexel;
use crate::contact_shadow::{ContactShadows, NO_SHADOW};
use crate::coverage::FOLD_GAP;
use crate::grain::Grain;
use crate::shading::Shader;
use crate::surface::Surface;
use crate::viewport::Viewport;
use crate::{DrawnTrims, ImagePyramid, ShadedCloth};
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// `Scene` of the shader.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct SceneData {
    lens: [f32; 4],
    size: [f32; 4],
    camera: [f32; 4],
    area: [f32; 4],
    up: [f32; 4],
    key: [f32; 4],
    light: [f32; 4],
    limits: [f32; 4],
    room: [[f32; 4]; 3],
    brightness: [f32; 4],
    picture: [u32; 4],
}

impl SceneData {
    pub(super) fn new(
        viewport: &Viewport,
        area: &Area,
        samples: u32,
        behind: f32,
        shader: &Shader<'_>,
        grain: Grain,
    ) -> Self {
        let k = viewport.sample_camera(area, samples);
        let lens = [k.fx, k.fy, k.cx + 0.5, k.cy + 0.5].map(|v| v as f32);
        let (k, l) = (&viewport.camera, &shader.lights);
        let around = [area.width.div_ceil(2), area.height.div_ceil(2)];
        Self {
            lens,
            size: [
                (area.width * samples) as f32,
                (area.height * samples) as f32,
                NEAR,
                samples as f32,
            ],
            camera: [k.fx, k.fy, k.cx, k.cy].map(|v| v as f32),
            area: [
                area.left as f32,
                area.top as f32,
                around[0] as f32,
                around[1] as f32,
            ],
            up: [shader.up.x, shader.up.y, shader.up.z, l.sky],
            key: [shader.key.x, shader.key.y, shader.key.z, l.key],
            light: [l.ground, l.inside, l.contact, grain.sigma / 255.0],
            limits: [FOLD_GAP, l.contact_depth, NO_SHADOW, behind],
            room: shader.room_rows(),
            brightness: [
                shader.brightness[0],
                shader.brightness[1],
                shader.brightness[2],
                0.0,
            ],
            picture: [grain.picture, 0, 0, 0],
        }
    }
}

/// `Fabric` of the shader.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct FabricData {
    base: [f32; 4],
    other: [f32; 4],
    pattern: [f32; 4],
    /// First texel, columns, rows and levels of an image.
    image: [u32; 4],
    cloth: [u32; 4],
    sizes: [f32; 4],
    look: [f32; 4],
    pucker: [f32; 4],
    wrinkle: [f32; 4],
}

impl FabricData {
    /// A fabric whose image, if it has one, starts at texel `first`, and whose relief at `relief`.
    fn new(f: &Fabric, first: u32, relief: u32) -> Self {
        let mut image = [0; 4];
        let numbers = f.cloth.as_ref().map(|c| c.numbers());
        let mut numbers = numbers.unwrap_or_default();
        numbers.counts[0] = relief;
        if let (Some(cloth), Some(trims)) = (&f.cloth, &f.trims) {
            let first = relief + cloth.texels().count() as u32;
            numbers.wrinkle[1..3].copy_from_slice(&[first as f32, trims.count() as f32]);
        }
        let pattern = match &f.print {
            Print::Solid => [0.0, 1.0, 0.0, 0.0],
            &Print::Stripes { period, .. } => [1.0, period, 0.0, 0.0],
            &Print::Check { period, .. } => [2.0, period, 0.0, 0.0],
            &Print::Knit { period } => [3.0, period, 0.0, 0.0],
            Print::Scale { .. } => [4.0, f.low[0], f.low[1], f.low[2]],
            Print::Image(pyramid) => {
                let [width, height, levels] = pyramid.shape();
                image = [first, width, height, levels];
                [5.0, pyramid.metres_per_texel(), 0.0, 0.0]
            }
        };
        Self {
            base: [f.base[0], f.base[1], f.base[2], f.gloss],
            other: [f.other[0], f.other[1], f.other[2], f.metres_per_uv],
            pattern,
            image,
            cloth: numbers.counts,
            sizes: numbers.sizes,
            look: numbers.look,
            pucker: numbers.pucker,
            wrinkle: numbers.wrinkle,
        }
    }
}

/// Images of the fabrics of a surface.
pub(super) fn images(surface: &Surface) -> impl Iterator<Item = &Arc<ImagePyramid>> {
    surface.fabrics.iter().filter_map(|f| match &f.print {
        Print::Image(pyramid) => Some(pyramid),
        _ => None,
    })
}

/// Cloth of a fabric and the trims on it.
#[derive(Clone, Debug)]
pub(super) struct FabricReliefs {
    cloth: Option<Arc<ShadedCloth>>,
    trims: Option<Arc<DrawnTrims>>,
}

impl FabricReliefs {
    /// Both are the same ones.
    pub(super) fn is(&self, other: &Self) -> bool {
        fn same<T>(a: &Option<Arc<T>>, b: &Option<Arc<T>>) -> bool {
            match (a, b) {
                (Some(a), Some(b)) => Arc::ptr_eq(a, b),
                (None, None) => true,
                _ => false,
            }
        }
        same(&self.cloth, &other.cloth) && same(&self.trims, &other.trims)
    }
}

impl Fabric {
    /// Texels of its cloth, then of the trims on it.
    pub(super) fn reliefs(&self) -> impl Iterator<Item = ClothTexel> + '_ {
        let trims = self.trims.iter().filter(|_| self.cloth.is_some());
        (self.cloth.iter().flat_map(|c| c.texels())).chain(trims.flat_map(|t| t.texels()))
    }
}

/// Cloths and trims of the fabrics of a surface.
pub(super) fn fabric_reliefs(surface: &Surface) -> impl Iterator<Item = FabricReliefs> {
    surface.fabrics.iter().map(|f| FabricReliefs {
        cloth: f.cloth.clone(),
        trims: f.trims.clone(),
    })
}

/// Flag of an owner seen from inside, above the garment's number.
const INNER: u32 = 256;

/// Bytes of the storage buffers of the geometry, in the order of their bindings.
pub(super) fn geometry(surface: &Surface) -> [Vec<u8>; 5] {
    let points: Vec<[f32; 4]> = surface
        .vertices
        .iter()
        .map(|p| [p.x, p.y, p.z, 1.0])
        .collect();
    let owners: Vec<u32> = surface
        .garment
        .iter()
        .zip(&surface.inner)
        .map(|(g, i)| u32::from(*g) + u32::from(*i) * INNER)
        .collect();
    let (mut first, mut relief) = (0, 0);
    let fabrics: Vec<FabricData> = surface
        .fabrics
        .iter()
        .map(|f| {
            let data = FabricData::new(f, first, relief);
            relief += f.reliefs().count() as u32;
            if let Print::Image(pyramid) = &f.print {
                first += pyramid.texels().len() as u32;
            }
            data
        })
        .collect();
    [
        bytemuck::cast_slice(&points).to_vec(),
        bytemuck::cast_slice(&surface.faces).to_vec(),
        bytemuck::cast_slice(&owners).to_vec(),
        bytemuck::cast_slice(&surface.attributes).to_vec(),
        bytemuck::cast_slice(&fabrics).to_vec(),
    ]
}

/// Bytes of the shadow image.
pub(super) fn shadow_texels(shadows: &ContactShadows) -> &[u8] {
    bytemuck::cast_slice(&shadows.around)
}
