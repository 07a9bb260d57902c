//! Scans of one subject, aligned and segmented in order.

use super::CaptureError;
use super::align::{Aligner, Alignment, Start};
use super::camera_gains::without_gains;
use super::multi::grow;
use super::scan::BodyScan;
use super::segment::{
    LabelConfig, Labelling, NodeColors, ScanLabeller, label_nodes, relabel_nodes, seen_slices,
};
use super::settings::AlignmentSettings;
use super::topology::ClothTemplate;
use std::sync::Arc;
use tryon_body::Template;
use tryon_geometry::mesh::Csr;

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

    /// Vertex of the clothed template nearest to each scan point on the single mesh, shape `[points]`.
    pub(super) fn nearest_vertices(&self, cloth: &ClothTemplate) -> Vec<u32> {
        let faces = cloth.template().mesh().faces();
        let matches = self.alignment.matches.iter();
        matches.map(|m| m.nearest_vertex(faces)).collect()
    }

    /// Membership in a garment of each scan point, shape `[points]`.
    pub fn covered(&self) -> Vec<bool> {
        let is_garment = |l: &u8| self.labelling.slots[usize::from(*l)].is_garment();
        self.labels.iter().map(is_garment).collect()
    }
}

/// Aligns and segments scans; the first one gives the clothed template and the appearances of the garments.
#[derive(Debug)]
pub struct ScanSegmenter {
    pub(super) aligner: Aligner,
    config: LabelConfig,
    first: Option<Labelling>,
}

impl ScanSegmenter {
    /// Segmenter before the first scan.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a template too large.
    pub fn new(template: Arc<Template>, config: LabelConfig) -> Result<Self, CaptureError> {
        let aligner = Aligner::new(template, AlignmentSettings::default())?;
        Ok(Self::with_aligner(aligner, config, None))
    }

    /// Segmenter on an aligner; `first` is the labelling of a first scan that the aligner continues after.
    pub(super) fn with_aligner(
        aligner: Aligner,
        config: LabelConfig,
        first: Option<Labelling>,
    ) -> Self {
        Self {
            aligner,
            config,
            first,
        }
    }

    /// Starts the first scan at a person found before.
    pub fn start_at(&mut self, start: Start) {
        self.aligner.start_at(start);
    }

    /// Template of the surface, with or without legs joined.
    pub fn cloth(&self) -> &ClothTemplate {
        self.aligner.cloth()
    }

    /// Aligns and segments the next scan.
    ///
    /// # Errors
    /// [`CaptureError::NoPerson`], or [`CaptureError::NoGarment`] if the first scan shows none.
    pub fn step(&mut self, scan: &BodyScan) -> Result<SegmentedScan, CaptureError> {
        let settings = &self.config.settings;
        let alignment = self.aligner.align(scan)?;
        let cloth = self.aligner.cloth();
        let template = cloth.template();
        let evened = without_gains(scan, &alignment, template, settings);
        let scan = evened.as_ref().unwrap_or(scan);
        let nodes = NodeColors::new(scan, &alignment, template, settings);
        let mut labelling = match &self.first {
            None => label_nodes(cloth, &nodes, &self.config)?,
            Some(first) => relabel_nodes(cloth, &nodes, first, &self.config)?,
        };
        let around = template.topology().vertex_neighbours();
        labelling.join_islands(around, &settings.islands);
        let is_near = near_boundaries(&labelling, around, settings.boundary_rings);
        let (matches, faces) = (&alignment.matches, template.mesh().faces());
        let edges = scan.edges(|i| is_near[matches[i].nearest_vertex(faces) as usize]);
        let labeller = ScanLabeller {
            scan,
            edges: &edges,
            matches,
            template,
            settings,
        };
        let mut labels = labeller.run(&labelling)?;
        // Walls and things beside are no garments.
        let far = matches.iter().map(|m| m.distance > settings.farthest);
        let far = labels.iter_mut().zip(far).filter(|(_, far)| *far);
        far.for_each(|(label, _)| *label = 0);
        labelling.adopt(&nodes, &labels);
        labelling.leave_unseen(&seen_slices(template, &nodes));
        let is_garment = |l: &u8| labelling.slots[usize::from(*l)].is_garment();
        if !labelling.labels.iter().any(is_garment) {
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

/// Nodes within so many rings of one with another label, shape `[nodes]`.
fn near_boundaries(labelling: &Labelling, around: &Csr, rings: usize) -> Vec<bool> {
    let other = |v: usize, w: usize| labelling.labels[v] != labelling.labels[w];
    let beside = |v: usize| around.row(v).iter().any(|w| other(v, *w as usize));
    let mut near: Vec<bool> = (0..labelling.labels.len()).map(beside).collect();
    (1..rings).for_each(|_| grow(around, &mut near));
    near
}
