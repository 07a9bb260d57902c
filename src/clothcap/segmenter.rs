//! Scans of one subject, aligned and segmented in order.

use super::CaptureError;
use super::align::{AlignedBody, Aligner, Alignment, ClothedTemplate, Start};
use super::camera_gains::without_gains;
use super::scan::BodyScan;
use super::segment::{
    LabelConfig, Labelling, NodeColors, label_nodes, label_scan, relabel_nodes, seen_slices,
};
use super::topology::ClothTemplate;
use std::sync::Arc;
use tryon_body::Template;
use tryon_geometry::mesh::Csr;

/// Farthest that a point of a garment lies off the surface, metres: the surface follows cloth to a few millimetres.
const FARTHEST: f32 = 0.10;

/// Aligned and labelled scan.
#[derive(Clone, Debug)]
pub struct SegmentedScan {
    /// Single-mesh alignment.
    pub alignment: Alignment,
    /// Scan points and their colours at the template's nodes.
    pub nodes: NodeColors,
    /// Labels of the nodes.
    pub labelling: Labelling,
    /// Label of each scan point, shape `[points]`.
    pub labels: Vec<u8>,
    /// Edges of the scan, see [`BodyScan::edges`]; of a cloud those near boundaries of labels.
    pub edges: Vec<[u32; 2]>,
    /// Cloud of several cameras without their gains.
    evened: Option<BodyScan>,
}

impl SegmentedScan {
    /// The scan, if it is a cloud of several cameras without their gains.
    pub(super) fn evened<'a>(&'a self, scan: &'a BodyScan) -> &'a BodyScan {
        self.evened.as_ref().unwrap_or(scan)
    }

    /// Part of each scan point, shape `[points]`: 0 for skin and hair, then one a garment.
    pub fn parts(&self) -> Vec<u8> {
        let parts = self.labelling.parts();
        self.labels.iter().map(|l| parts[usize::from(*l)]).collect()
    }

    /// Membership in a garment of each scan point, shape `[points]`.
    pub fn covered(&self) -> Vec<bool> {
        let is_garment = |l: &u8| self.labelling.slots[usize::from(*l)].is_garment();
        self.labels.iter().map(is_garment).collect()
    }
}

/// Rings of nodes about a boundary of labels within which points may change theirs, their neighbours included.
const NEAR: usize = 5;

/// Aligns and segments scans; the first one gives the clothed template and the appearances of the garments.
#[derive(Debug)]
pub struct ScanSegmenter {
    config: LabelConfig,
    aligner: Aligner,
    first: Option<Labelling>,
}

impl ScanSegmenter {
    /// Segmenter before the first scan.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template too large.
    pub fn new(template: Arc<Template>, config: LabelConfig) -> Result<Self, CaptureError> {
        Ok(Self {
            aligner: Aligner::new(template)?,
            config,
            first: None,
        })
    }

    /// Segmenter that continues after a first scan with this labelling; `last` is the body of the scan before.
    ///
    /// # Errors
    /// As [`ScanSegmenter::new`].
    pub fn resume(
        template: Arc<Template>,
        config: LabelConfig,
        first: Labelling,
        (clothed, last): (ClothedTemplate, AlignedBody),
    ) -> Result<Self, CaptureError> {
        Ok(Self {
            aligner: Aligner::resume(template, clothed, last)?,
            config,
            first: Some(first),
        })
    }

    /// Skips nothing from now on.
    pub fn skip_nothing(&mut self) {
        self.aligner.skip_nothing();
    }

    /// Starts the first scan at a person found before.
    pub fn start_at(&mut self, start: Start) {
        self.aligner.start_at(start);
    }

    /// Starts the next scan in the pose of a body, that of the last scan under its cloth.
    pub(super) fn follow(&mut self, body: &AlignedBody) {
        self.aligner.follow(body);
    }

    /// Template of the surface, with or without legs joined.
    pub fn cloth(&self) -> &ClothTemplate {
        self.aligner.cloth()
    }

    /// Clothed template, once a scan is aligned.
    pub fn clothed(&self) -> Option<&ClothedTemplate> {
        self.aligner.clothed()
    }

    /// Aligns and segments the next scan.
    ///
    /// # Errors
    /// [`CaptureError::NoPerson`], or [`CaptureError::NoGarment`] if the first scan shows none.
    pub fn step(&mut self, scan: &BodyScan) -> Result<SegmentedScan, CaptureError> {
        let alignment = self.aligner.align(scan)?;
        let cloth = self.aligner.cloth();
        let template = cloth.template();
        let evened = without_gains(scan, &alignment, template);
        let scan = evened.as_ref().unwrap_or(scan);
        let nodes = NodeColors::new(scan, &alignment, template);
        let mut labelling = match &self.first {
            None => label_nodes(cloth, &nodes, &self.config)?,
            Some(first) => relabel_nodes(cloth, &nodes, first, &self.config)?,
        };
        let around = (
            template.mesh().faces(),
            template.topology().vertex_neighbours(),
        );
        labelling.join_islands(around.1);
        let is_near = near_boundaries(&labelling, around.1);
        let node_of = |i: usize| {
            let m = &alignment.matches[i];
            around.0[m.face as usize][m.nearest_corner()]
        };
        let edges = scan.edges(|i| is_near[node_of(i) as usize]);
        let mut labels = label_scan((scan, &edges), &alignment.matches, around, &labelling)?;
        // Walls and things beside are no garments.
        let far = alignment.matches.iter().map(|m| m.distance > FARTHEST);
        let far = labels.iter_mut().zip(far).filter(|(_, far)| *far);
        far.for_each(|(label, _)| *label = 0);
        labelling.adopt(&nodes, &labels);
        labelling.leave_unseen(&seen_slices(template, &nodes));
        if !labelling
            .labels
            .iter()
            .any(|l| labelling.slots[usize::from(*l)].is_garment())
        {
            return Err(CaptureError::NoGarment);
        }
        self.first.get_or_insert_with(|| labelling.clone());
        Ok(SegmentedScan {
            alignment,
            nodes,
            labelling,
            labels,
            edges,
            evened,
        })
    }
}

/// Nodes within [`NEAR`] rings of one with another label, shape `[nodes]`.
fn near_boundaries(labelling: &Labelling, around: &Csr) -> Vec<bool> {
    let other = |v: usize, w: usize| labelling.labels[v] != labelling.labels[w];
    let beside = |v: usize| around.row(v).iter().any(|w| other(v, *w as usize));
    let mut near: Vec<bool> = (0..labelling.labels.len()).map(beside).collect();
    for _ in 1..NEAR {
        let before = near.clone();
        for (v, near) in near.iter_mut().enumerate() {
            *near = *near || around.row(v).iter().any(|w| before[*w as usize]);
        }
    }
    near
}
