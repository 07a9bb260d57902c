//! Shaders, bind group layouts and render pipelines, compiled once.

use super::targets::Targets;
use wgpu::{BindingType, BufferBindingType, ShaderStages, TextureSampleType};

/// Source of the shaders.
pub(super) const SHADERS: &str = include_str!("garments.wgsl");
/// Storage buffers of the geometry group: vertices, faces, owners, attributes, fabrics, texels, reliefs.
pub(super) const STORAGE_BUFFERS: u32 = 7;
/// Those of them that are kept from picture to picture.
pub(super) const TEXELS: usize = 5;
pub(super) const RELIEFS: usize = 6;

/// Compiled passes and the layouts of their bind groups.
#[derive(Debug)]
pub(super) struct Pipelines {
    /// Faces of the garments into samples.
    pub(super) draw: wgpu::RenderPipeline,
    /// Samples into the coverage of pixels.
    pub(super) resolve: wgpu::RenderPipeline,
    /// Shaded garments over the captured picture.
    pub(super) compose: wgpu::RenderPipeline,
    /// Layouts of geometry, samples and marks.
    layouts: [wgpu::BindGroupLayout; 3],
}

/// Description of one pipeline.
struct PassSpec<'a> {
    label: &'a str,
    vertex: &'a str,
    fragment: &'a str,
    /// Number of bind groups, in the order of the layouts.
    groups: usize,
    target: wgpu::ColorTargetState,
    has_depth: bool,
}

impl Pipelines {
    /// Compiles all shaders.
    pub(super) fn compile(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("garments"),
            source: wgpu::ShaderSource::Wgsl(SHADERS.into()),
        });
        let layouts = layouts(device);
        let compile = |spec| pipeline(device, &module, &layouts, spec);
        let draw = compile(PassSpec {
            label: "draw",
            vertex: "garment_vertex",
            fragment: "garment_face",
            groups: 1,
            target: wgpu::TextureFormat::R32Uint.into(),
            has_depth: true,
        });
        let resolve = compile(PassSpec {
            label: "resolve",
            vertex: "everywhere",
            fragment: "resolve",
            groups: 2,
            target: wgpu::TextureFormat::Rgba32Uint.into(),
            has_depth: false,
        });
        let compose = compile(PassSpec {
            label: "compose",
            vertex: "everywhere",
            fragment: "compose",
            groups: 3,
            target: blended_target(),
            has_depth: false,
        });
        Self {
            draw,
            resolve,
            compose,
            layouts,
        }
    }

    /// Bind groups of geometry, samples and marks.
    pub(super) fn bind(
        &self,
        device: &wgpu::Device,
        scene: &wgpu::Buffer,
        storage: &[wgpu::Buffer],
        targets: &Targets,
    ) -> [wgpu::BindGroup; 3] {
        let group = |layout, resources: Vec<wgpu::BindingResource<'_>>| {
            let entries: Vec<_> = (0..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout,
                entries: &entries,
            })
        };
        let textures = |layout, textures: &[&wgpu::Texture]| {
            let views: Vec<_> = textures
                .iter()
                .map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()))
                .collect();
            let resources = views.iter().map(wgpu::BindingResource::TextureView);
            group(layout, resources.collect())
        };
        let mut geometry = vec![scene.as_entire_binding()];
        geometry.extend(storage.iter().map(|b| b.as_entire_binding()));
        let [of_geometry, of_samples, of_marks] = &self.layouts;
        [
            group(of_geometry, geometry),
            textures(of_samples, &[&targets.faces, &targets.depths]),
            textures(
                of_marks,
                &[&targets.pixels, &targets.marks, &targets.around],
            ),
        ]
    }
}

/// Layouts of the bind groups of geometry, samples and marks.
fn layouts(device: &wgpu::Device) -> [wgpu::BindGroupLayout; 3] {
    let layout = |label, visibility, types: &[BindingType]| {
        let entries: Vec<_> = (0..)
            .zip(types)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility,
                ty: *ty,
                count: None,
            })
            .collect();
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        })
    };
    let buffer = |ty| BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = |sample_type| BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let read_only = buffer(BufferBindingType::Storage { read_only: true });
    let mut geometry = vec![buffer(BufferBindingType::Uniform)];
    geometry.extend((0..STORAGE_BUFFERS).map(|_| read_only));
    let float = texture(TextureSampleType::Float { filterable: false });
    let integer = texture(TextureSampleType::Uint);
    let depth = texture(TextureSampleType::Depth);
    [
        layout("geometry", ShaderStages::VERTEX_FRAGMENT, &geometry),
        layout("samples", ShaderStages::FRAGMENT, &[integer, depth]),
        layout("marks", ShaderStages::FRAGMENT, &[integer, float, float]),
    ]
}

/// A colour target blended as colour + target · alpha.
fn blended_target() -> wgpu::ColorTargetState {
    let over = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::SrcAlpha,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::ColorTargetState {
        format: wgpu::TextureFormat::Rgba8Unorm,
        blend: Some(wgpu::BlendState {
            color: over,
            alpha: over,
        }),
        write_mask: wgpu::ColorWrites::COLOR,
    }
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layouts: &[wgpu::BindGroupLayout; 3],
    spec: PassSpec<'_>,
) -> wgpu::RenderPipeline {
    let bound: Vec<Option<&wgpu::BindGroupLayout>> =
        layouts[..spec.groups].iter().map(Some).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(spec.label),
        bind_group_layouts: &bound,
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(spec.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(spec.vertex),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        // Reversed depth: nearer is greater.
        depth_stencil: spec.has_depth.then(|| wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(spec.fragment),
            compilation_options: Default::default(),
            targets: &[Some(spec.target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shaders_are_valid() {
        use wgpu::naga::{front::wgsl, valid};
        let check = |source: &str| {
            let module = wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
            valid::Validator::new(
                valid::ValidationFlags::all(),
                valid::Capabilities::default(),
            )
            .validate(&module)
            .map(|_| module)
            .map_err(|e| e.emit_to_string(source))
        };
        let module = check(SHADERS).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(module.entry_points.len(), 5);
        // The check can fail.
        assert!(check(&SHADERS.replace("scene.size.w", "scene.size")).is_err());
    }
}
