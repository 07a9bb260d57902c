//! The pipeline on the processor: captured picture, rasterisation, vertex shading, visibility, blending.

use super::blend::Blender;
use super::composition::Composition;
use super::config::Model;
use super::coverage::reduce_samples;
use super::input::{Input, RenderError};
use super::report::RenderReport;
use super::shading::Shader;
use super::state::State;
use super::workspace::Workspace;
use tryon_geometry::camera::ColorImage;

/// Renders one picture: the captured image with the garments on. `state` is one person's in front of one camera.
///
/// # Errors
/// [`RenderError`] when the input cannot be drawn; it names the fault.
pub fn render(
    model: &Model,
    state: &mut State,
    input: &Input<'_>,
    work: &mut Workspace,
) -> Result<(ColorImage, RenderReport), RenderError> {
    let config = &model.config;
    state.keep_if(input.body.is_some());
    let mut picture = Composition::begin(model, state, input, work)?;
    let Some(area) = picture.area else {
        return Ok(picture.end(work));
    };
    picture.see_body(model, state, input, work, &area);
    let (n, surface) = (picture.samples, &mut work.surface);
    picture.report.faces_hidden = surface.rasterise(config, &picture.viewport, &area, n);
    (surface.visible).reset(surface.faces.len(), !config.skip_unseen);
    reduce_samples(config.par, surface, &area, n, &mut work.pixels);
    picture.report.garments_hidden = surface.garments_hidden();
    picture.lap("garments");
    picture.report.normals_skipped = surface.shade_vertices(&config.lights);
    picture.lap("normals");

    let depth = picture.resolve_visibility(model, state, input, work, &area);
    let blender = Blender {
        shader: Shader::new(
            &work.surface,
            picture.viewport.camera,
            &model.to_srgb,
            &config.lights,
            state.room_light.as_ref(),
            picture.report.brightness,
        ),
        work,
        area: &area,
        samples: n as usize,
        depth: &depth,
        grain: state.grain_of(input.frame.sequence),
    };
    blender.blend(config.par, &mut picture.image);
    picture.lap("shading");
    picture.soften_outlines(config.par, state.blur, work, &area);
    Ok(picture.end(work))
}
