//! Which graphics card, if any.

use super::Renderer;

/// What the caller wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Prefer {
    /// A real card if there is one, else the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// Any adapter, software included.
    Gpu,
}

/// An adapter found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterReport {
    /// As the driver calls itself.
    pub name: String,
    /// Vulkan, Metal or Dx12.
    pub backend: String,
    /// Emulated on the processor.
    pub software: bool,
}

/// No usable card.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// Nothing found.
    #[error("no graphics adapter found")]
    NoAdapter,
    /// The driver refused.
    #[error("{adapter}: {why}")]
    Device {
        /// Which adapter.
        adapter: String,
        /// What it said.
        why: String,
    },
}

/// The GL backend cannot write the depth textures used here, so it is left out.
const BACKENDS: wgpu::Backends = wgpu::Backends::VULKAN
    .union(wgpu::Backends::METAL)
    .union(wgpu::Backends::DX12);

/// All adapters, the best first: real before software, discrete before integrated.
pub(super) fn found() -> Vec<wgpu::Adapter> {
    let mut desc = wgpu::InstanceDescriptor::new_without_display_handle();
    desc.backends = BACKENDS;
    // Validation layers of distributions lag behind the drivers and report errors that are none.
    desc.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(desc);
    let mut all = pollster::block_on(instance.enumerate_adapters(BACKENDS));
    all.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    all
}

pub(super) fn report(adapter: &wgpu::Adapter) -> AdapterReport {
    let info = adapter.get_info();
    AdapterReport {
        name: info.name.clone(),
        backend: format!("{:?}", info.backend),
        software: info.device_type == wgpu::DeviceType::Cpu,
    }
}

/// What there is, best first.
pub fn adapters() -> Vec<AdapterReport> {
    found().iter().map(report).collect()
}

/// The renderer to use, warmed up; `None` = the processor (asked for, or nothing better than software was found:
/// lavapipe takes 3 to 4 times as long as [`crate::composite::render`]).
///
/// # Errors
/// With [`Prefer::Gpu`], when there is no adapter or it fails. With [`Prefer::Auto`] a failing card means `None`.
pub fn choose(prefer: Prefer) -> Result<Option<Renderer>, GpuError> {
    match prefer {
        Prefer::Cpu => Ok(None),
        Prefer::Gpu => Renderer::new(true).map(Some),
        Prefer::Auto => Ok(Renderer::new(false).ok()),
    }
}
