//! Read-back of the card's results.

use super::targets::padded_row;
use crate::RenderError;
use crate::area::Area;
use crate::coverage::PixelCoverage;
use std::sync::{Arc, Mutex};

/// Bytes of a texel of the resolve pass.
pub(super) const COVERAGE_BYTES: u32 = 16;

/// Waits for the card and passes `rows` rows of `row` bytes to `then`.
///
/// # Errors
/// [`RenderError::Graphics`] when the card fails.
pub(super) fn fetch(
    device: &wgpu::Device,
    buffer: &wgpu::Buffer,
    row: u32,
    rows: u32,
    then: impl FnOnce(&[u8]),
) -> Result<(), RenderError> {
    let failed = |why: String| RenderError::Graphics(format!("read back: {why}"));
    let slice = buffer.slice(..u64::from(row) * u64::from(rows));
    let done = Arc::new(Mutex::new(None));
    let slot = done.clone();
    slice.map_async(wgpu::MapMode::Read, move |result| {
        if let Ok(mut slot) = slot.lock() {
            *slot = Some(result);
        }
    });
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|e| RenderError::Graphics(format!("waiting for the card: {e}")))?;
    match done.lock().ok().and_then(|mut d| d.take()) {
        Some(Ok(())) => {}
        Some(Err(e)) => return Err(failed(e.to_string())),
        None => return Err(failed("no answer".into())),
    }
    {
        let view = slice
            .get_mapped_range()
            .map_err(|e| failed(e.to_string()))?;
        then(&view);
    }
    buffer.unmap();
    Ok(())
}

/// Texels of the resolve pass to the coverage of the area's pixels.
pub(super) fn unpack(bytes: &[u8], area: &Area, out: &mut Vec<PixelCoverage>) {
    out.clear();
    for row in bytes.chunks_exact(padded_row(area.width, COVERAGE_BYTES) as usize) {
        out.extend(
            row.chunks_exact(COVERAGE_BYTES as usize)
                .take(area.width as usize)
                .map(|t| {
                    let at = |k: usize| {
                        u32::from_le_bytes([t[4 * k], t[4 * k + 1], t[4 * k + 2], t[4 * k + 3]])
                    };
                    let covered = at(2) as u8;
                    let depth = if covered == 0 {
                        f32::INFINITY
                    } else {
                        f32::from_bits(at(0))
                    };
                    PixelCoverage {
                        depth,
                        face: at(1),
                        covered,
                        is_simple: at(3) == 1,
                    }
                }),
        );
    }
}
