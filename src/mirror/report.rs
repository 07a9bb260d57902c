//! Result of one frame and the time of its stages.

use std::time::Instant;
use tryon_geometry::camera::ColorImage;
use tryon_view::RenderReport;

/// Result of one frame.
#[derive(Debug)]
pub struct MirrorFrame {
    /// Picture; the captured one while nobody is dressed.
    pub picture: ColorImage,
    /// Garments are in the picture.
    pub is_dressed: bool,
    /// Sizes of the garments may change once more: that of the body hasn't settled.
    pub is_size_provisional: bool,
    /// Milliseconds by stage: `tracking`, `dressing`, `cloth`, `composite`, those that ran.
    pub stages_ms: Vec<(&'static str, f64)>,
    /// Report of the tracker.
    pub tracking: tryon_tracking::StepReport,
    /// Report of the cloth; `None` without a dressed body.
    pub cloth: Option<tryon_cloth::StepReport>,
    /// Report of the compositor.
    pub render: RenderReport,
}

/// Milliseconds of consecutive stages.
#[derive(Debug)]
pub(super) struct StageTimer {
    last: Instant,
    pub(super) stages_ms: Vec<(&'static str, f64)>,
}

impl StageTimer {
    pub(super) fn start() -> Self {
        Self {
            last: Instant::now(),
            stages_ms: Vec::new(),
        }
    }

    /// Ends a stage; the next one begins.
    pub(super) fn lap(&mut self, stage: &'static str) {
        let now = Instant::now();
        let ms = now.duration_since(self.last).as_secs_f64() * 1e3;
        self.stages_ms.push((stage, ms));
        self.last = now;
    }
}
