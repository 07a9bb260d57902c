//! New colours of own clothes and of the antialiased pixels around them.
//!
//! A pixel beside own cloth shows some of it: c = α k + (1 − α) s with cloth k and scene s, of which α follows. The cloth's
//! share becomes skin or scene.

use super::DressedPicture;
use super::field::{BodyField, NearBody};
use super::skin_light::SkinLight;
use super::worn::OwnWorn;
use crate::area::Area;

/// Difference of cloth and scene (grey levels, squared) below which a share cannot be told.
const LEAST_CONTRAST: f32 = 400.0;

/// New state of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    None,
    Scene([u8; 3]),
    Skin([u8; 3]),
}

/// Own cloth of a picture and what takes its place.
pub(super) struct Replacement<'a> {
    pub(super) picture: &'a DressedPicture<'a>,
    pub(super) worn: &'a OwnWorn,
    pub(super) field: &'a BodyField,
    pub(super) skin: Option<SkinLight<'a>>,
    /// Own cloth by pixel, shape `[window]`.
    pub(super) is_own: &'a [bool],
    pub(super) window: Area,
    /// Share of a pixel that a garment takes.
    pub(super) cover: &'a (dyn Fn([u32; 2]) -> f32 + Sync),
}

impl Replacement<'_> {
    /// Change of pixel `i` of the window; `None` for one without own cloth.
    pub(super) fn of(&self, i: usize) -> Option<Change> {
        let pixel @ [u, v] = self.window.pixel(i);
        let Around { cloth, beside } = self.around(i);
        let (cloth, near) = (cloth?, self.field.at(pixel)?);
        let scene = self.picture.plate.at(&self.picture.captured, pixel);
        let scene = scene.map(|c| c.map(f32::from));
        // Before a scene that was never seen the outline of close clothes is that of the body.
        let on_body = match scene {
            Some(_) => self.field.coverage(pixel),
            None => f32::from(u8::from(self.is_close(&near, pixel))),
        };
        let is_bare = on_body > 0.0 && !self.is_beside_garment(pixel, near.depth);
        let skin = is_bare.then(|| self.skin_at(&near, pixel, cloth));
        let (new, is_skin) = match (skin.flatten(), scene) {
            (Some(skin), Some(scene)) => (mix(scene, skin, on_body), on_body >= 0.5),
            (Some(skin), None) => (skin, true),
            (None, Some(scene)) if on_body < 0.5 => (scene, false),
            (None, _) => return Some(Change::None),
        };
        let captured = self.picture.captured.image.at(u, v).map(f32::from);
        let color = match scene.or(beside) {
            _ if self.is_own[i] => new,
            Some(scene) => {
                let share = share(captured, cloth, scene);
                mix(mix(captured, scene, share), new, share)
            }
            None => return Some(Change::None),
        };
        let color = rounded(color);
        Some(if is_skin {
            Change::Skin(color)
        } else {
            Change::Scene(color)
        })
    }

    /// True between the outline of the body and a garment on it: the limb there is dressed, and own cloth that sticks out is no
    /// bare skin.
    fn is_beside_garment(&self, [u, v]: [u32; 2], depth: f32) -> bool {
        let captured = &self.picture.captured;
        let reach = self.picture.config.own_clothes.sliver * captured.viewport.camera.fx as f32;
        let reach = (reach / depth).round().max(1.0) as i32;
        let [width, height] = [captured.image.width(), captured.image.height()];
        let at = |dx: i32, dy: i32| {
            let (x, y) = (u.checked_add_signed(dx)?, v.checked_add_signed(dy)?);
            (x < width && y < height).then_some([x, y])
        };
        let directions = [(1, 0), (0, 1)];
        directions.into_iter().any(|(x, y)| {
            [reach, -reach].into_iter().any(|r| {
                let [out, inner] = [at(x * r, y * r), at(-x * r, -y * r)];
                out.is_none_or(|p| self.field.coverage(p) < 0.5)
                    && inner.is_some_and(|p| (self.cover)(p) > 0.5)
            })
        })
    }

    /// True at and close to the body, beside it only where the person is measured next to the pixel.
    fn is_close(&self, near: &NearBody, [u, v]: [u32; 2]) -> bool {
        let settings = &self.picture.config.own_clothes;
        let captured = &self.picture.captured;
        let reach = self.edge_width() as u32;
        let [right, bottom] = [captured.image.width() - 1, captured.image.height() - 1];
        let around = [
            [u, v],
            [u.saturating_sub(reach), v],
            [(u + reach).min(right), v],
            [u, v.saturating_sub(reach)],
            [u, (v + reach).min(bottom)],
        ];
        let is_person = |[u, v]: [u32; 2]| {
            let metres = captured.metres(u, v);
            metres > 0.0 && (metres - near.depth).abs() < settings.off_body
        };
        near.is_on
            || self.field.beside([u, v]) <= settings.close && around.into_iter().any(is_person)
    }

    /// Colours on both sides of an antialiased edge at pixel `i` of the window.
    fn around(&self, i: usize) -> Around {
        let image = self.picture.captured.image;
        let [width, reach] = [self.window.width as isize, self.edge_width() as isize];
        let at = [i as isize % width, i as isize / width];
        let index = |x: isize, y: isize| {
            let is_inside =
                (0..width).contains(&x) && (0..self.window.height as isize).contains(&y);
            is_inside.then_some((y * width + x) as usize)
        };
        let (mut sum, mut towards, mut count) = ([0.0; 3], [0.0; 2], 0.0);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let Some(k) = index(at[0] + dx, at[1] + dy).filter(|k| self.is_own[*k]) else {
                    continue;
                };
                let [u, v] = self.window.pixel(k);
                let color = image.at(u, v);
                (0..3).for_each(|c| sum[c] += f32::from(color[c]));
                (towards[0], towards[1]) = (towards[0] + dx as f32, towards[1] + dy as f32);
                count += 1.0;
            }
        }
        // Away from the cloth, past the edge.
        let length = f32::hypot(towards[0], towards[1]).max(f32::MIN_POSITIVE);
        let away = towards.map(|t| (-t / length * (reach + 1) as f32).round() as isize);
        let beyond = index(at[0] + away[0], at[1] + away[1]).filter(|k| !self.is_own[*k]);
        Around {
            cloth: (count > 0.0).then(|| sum.map(|s| s / count)),
            beside: beyond.map(|k| {
                let [u, v] = self.window.pixel(k);
                image.at(u, v).map(f32::from)
            }),
        }
    }

    /// Reach of an edge, pixels of the picture: it is antialiased, and readings of depth end up to a pixel of theirs beside it.
    pub(super) fn edge_width(&self) -> usize {
        let viewport = self.picture.captured.viewport;
        let reading = f64::from(viewport.camera.height) / f64::from(viewport.depth[1]);
        (2.0 * viewport.scale.max(reading)).ceil().max(1.0) as usize
    }

    /// Colour of skin in the place of cloth of this colour.
    fn skin_at(&self, near: &NearBody, pixel: [u32; 2], cloth: [f32; 3]) -> Option<[f32; 3]> {
        let shade = self.worn.shade(self.picture.segment(near.face)?, cloth);
        self.skin.as_ref()?.at(near.face, pixel, shade)
    }
}

/// Mean colour of own cloth around a pixel, and the colour beyond its edge.
struct Around {
    cloth: Option<[f32; 3]>,
    beside: Option<[f32; 3]>,
}

/// Share of cloth in a pixel between cloth and scene.
fn share(captured: [f32; 3], cloth: [f32; 3], scene: [f32; 3]) -> f32 {
    let (mut dot, mut squared) = (0.0, 0.0);
    for c in 0..3 {
        let contrast = cloth[c] - scene[c];
        dot += (captured[c] - scene[c]) * contrast;
        squared += contrast * contrast;
    }
    if squared < LEAST_CONTRAST {
        return 0.0;
    }
    (dot / squared).clamp(0.0, 1.0)
}

fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * share)
}

fn rounded(color: [f32; 3]) -> [u8; 3] {
    color.map(|c| c.clamp(0.0, 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_cloth_is_that_of_the_mixture() {
        let (cloth, scene) = ([40.0, 60.0, 80.0], [200.0, 180.0, 190.0]);
        for alpha in [0.0, 0.25, 0.7, 1.0] {
            let told = share(mix(scene, cloth, alpha), cloth, scene);
            assert!((told - alpha).abs() < 1e-5, "{told} {alpha}");
        }
        assert_eq!(share([90.0; 3], cloth, cloth), 0.0, "nothing to tell from");
    }
}
