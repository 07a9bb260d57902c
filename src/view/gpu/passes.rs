//! Recording of the three render passes.

use super::pipelines::Pipelines;
use super::readback::COVERAGE_BYTES;
use super::targets::{Targets, read};
use crate::area::Area;

/// Resources of the passes over one area.
pub(super) struct Passes<'a> {
    pub(super) pipelines: &'a Pipelines,
    pub(super) targets: &'a Targets,
    pub(super) groups: [wgpu::BindGroup; 3],
    pub(super) area: Area,
    /// Samples along each side of a pixel.
    pub(super) samples: u32,
}

impl Passes<'_> {
    /// Rasterises `faces` into samples.
    pub(super) fn draw(&self, encoder: &mut wgpu::CommandEncoder, faces: u32) {
        let none = wgpu::Color {
            r: f64::from(u32::MAX),
            g: 0.0,
            b: 0.0,
            a: 0.0,
        };
        let depth = self.targets.depths.create_view(&Default::default());
        let clear = wgpu::LoadOp::Clear(none);
        let mut pass = pass(encoder, &self.targets.faces, clear, Some(&depth));
        let [width, height] = [self.area.width, self.area.height].map(|s| s * self.samples);
        pass.set_viewport(0.0, 0.0, width as f32, height as f32, 0.0, 1.0);
        pass.set_scissor_rect(0, 0, width, height);
        pass.set_pipeline(&self.pipelines.draw);
        pass.set_bind_group(0, &self.groups[0], &[]);
        pass.draw(0..3 * faces, 0..1);
    }

    /// Reduces the samples to the coverage of pixels and copies it to its read-back buffer.
    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        let (pixels, size) = (&self.targets.pixels, [self.area.width, self.area.height]);
        self.cover(encoder, pixels, &self.pipelines.resolve, &self.groups[..2]);
        let out = &self.targets.pixels_out;
        read(encoder, pixels, out, size, COVERAGE_BYTES);
    }

    /// Shades the garments over the captured picture and copies the result to its read-back buffer.
    pub(super) fn compose(&self, encoder: &mut wgpu::CommandEncoder) {
        let (picture, size) = (&self.targets.picture, [self.area.width, self.area.height]);
        self.cover(encoder, picture, &self.pipelines.compose, &self.groups);
        let out = &self.targets.picture_out;
        read(encoder, picture, out, size, 4);
    }

    /// Runs a fragment shader on every pixel of the area.
    fn cover(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::Texture,
        pipeline: &wgpu::RenderPipeline,
        groups: &[wgpu::BindGroup],
    ) {
        let mut pass = pass(encoder, target, wgpu::LoadOp::Load, None);
        pass.set_scissor_rect(0, 0, self.area.width, self.area.height);
        pass.set_pipeline(pipeline);
        for (k, group) in (0..).zip(groups) {
            pass.set_bind_group(k, group, &[]);
        }
        pass.draw(0..3, 0..1);
    }
}

fn pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    target: &wgpu::Texture,
    load: wgpu::LoadOp<wgpu::Color>,
    depth: Option<&wgpu::TextureView>,
) -> wgpu::RenderPass<'e> {
    let view = target.create_view(&Default::default());
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: None,
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load,
                store: wgpu::StoreOp::Store,
            },
        })],
        depth_stencil_attachment: depth.map(|view| wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}
