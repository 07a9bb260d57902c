//! Graphics adapters and their faults.

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
        /// Name of the adapter.
        adapter: String,
        /// Message of the driver.
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

/// Name, backend and kind of an adapter.
pub(super) fn report(adapter: &wgpu::Adapter) -> AdapterReport {
    let info = adapter.get_info();
    AdapterReport {
        name: info.name.clone(),
        backend: format!("{:?}", info.backend),
        software: info.device_type == wgpu::DeviceType::Cpu,
    }
}

/// Reports of all adapters, the best first.
pub fn adapters() -> Vec<AdapterReport> {
    found().iter().map(report).collect()
}
