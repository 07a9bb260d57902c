//! Textures and read-back buffers, grown when a larger area needs them and then kept.

use wgpu::TextureFormat as Format;

/// Sizes are rounded up to this many pixels, so that a moving garment does not reallocate at every step.
const ROUND: u32 = 128;
/// wgpu's alignment of texture rows in buffers, bytes.
const ROW_ALIGN: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// Everything of the size of the drawn area.
#[derive(Debug)]
pub(super) struct Targets {
    size: [u32; 2],
    samples: u32,
    pub(super) faces: wgpu::Texture,
    pub(super) depths: wgpu::Texture,
    pub(super) pixels: wgpu::Texture,
    pub(super) marks: wgpu::Texture,
    pub(super) around: wgpu::Texture,
    pub(super) picture: wgpu::Texture,
    pub(super) pixels_out: wgpu::Buffer,
    pub(super) picture_out: wgpu::Buffer,
}

impl Targets {
    /// Targets for an area of `width × height` pixels, sizes rounded up.
    pub(super) fn new(device: &wgpu::Device, width: u32, height: u32, samples: u32) -> Self {
        use wgpu::TextureUsages as U;
        let size = [width, height].map(|s| s.div_ceil(ROUND) * ROUND);
        let texture = |label, scale: [u32; 2], format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: size[0] * scale[0] / scale[1],
                    height: size[1] * scale[0] / scale[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let buffer = |label, bytes: u32| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: u64::from((size[0] * bytes).div_ceil(ROW_ALIGN) * ROW_ALIGN)
                    * u64::from(size[1]),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            })
        };
        let drawn = U::RENDER_ATTACHMENT | U::TEXTURE_BINDING;
        let given = U::COPY_DST | U::TEXTURE_BINDING;
        Self {
            size,
            samples,
            faces: texture("faces", [samples, 1], Format::R32Uint, drawn),
            depths: texture("depths", [samples, 1], Format::Depth32Float, drawn),
            pixels: texture("pixels", [1, 1], Format::Rgba32Uint, drawn | U::COPY_SRC),
            marks: texture("marks", [1, 1], Format::Rg32Float, given),
            around: texture("around", [1, 2], Format::Rgba32Float, given),
            picture: texture(
                "picture",
                [1, 1],
                Format::Rgba8Unorm,
                U::RENDER_ATTACHMENT | U::COPY_DST | U::COPY_SRC,
            ),
            pixels_out: buffer("pixels out", 16),
            picture_out: buffer("picture out", 4),
        }
    }

    /// Large enough for an area, with the same samples a pixel.
    pub(super) fn fits(&self, width: u32, height: u32, samples: u32) -> bool {
        width <= self.size[0] && height <= self.size[1] && samples == self.samples
    }
}

/// Bytes of a texture row in a read-back buffer.
pub(super) fn padded_row(width: u32, bytes: u32) -> u32 {
    (width * bytes).div_ceil(ROW_ALIGN) * ROW_ALIGN
}

/// Writes the upper left `width × height` texels of `bytes` each.
pub(super) fn write(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    [width, height]: [u32; 2],
    bytes: u32,
    data: &[u8],
) {
    queue.write_texture(
        texture.as_image_copy(),
        data,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(width * bytes),
            rows_per_image: None,
        },
        wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
    );
}

/// Copies the upper left `width × height` texels of `bytes` each into a read-back buffer.
pub(super) fn read(
    encoder: &mut wgpu::CommandEncoder,
    texture: &wgpu::Texture,
    buffer: &wgpu::Buffer,
    [width, height]: [u32; 2],
    bytes: u32,
) {
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded_row(width, bytes)),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
    );
}
