//! The network itself: weights, one run, its output.

use super::crop::{CROP_CHANNELS, CROP_SIDE};
use rten::{Model, ModelOptions, NodeId, RunOptions, ThreadPool};
use rten_tensor::NdTensorView;
use rten_tensor::prelude::*;
use std::sync::{Arc, OnceLock};

/// Number of classes; `tracking::part_classes` says which they are.
pub const CLASSES: usize = 27;
/// Cells of a side of the maps.
pub(super) const MAP_SIDE: usize = CROP_SIDE / 4;
/// Cells of a map.
pub(super) const MAP_CELLS: usize = MAP_SIDE * MAP_SIDE;
/// Sectors of yaw; the first is centred on a person who faces the camera.
pub(super) const YAW_SECTORS: usize = 16;
/// Names of the outputs and their numbers.
const OUTPUTS: [(&str, usize); 4] = [
    ("classes", (CLASSES + 1) * MAP_CELLS),
    ("heat", CLASSES * MAP_CELLS),
    ("depth", CLASSES * MAP_CELLS),
    ("yaw", YAW_SECTORS),
];

/// Fault in the bytes of a network.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PartNetworkError {
    /// Not a network that can be run.
    #[error("not a network: {0}")]
    Format(String),
    /// An input or output is missing.
    #[error("the network has no \"{0}\"")]
    Missing(&'static str),
    /// An output of another shape.
    #[error("\"{name}\" has {got} numbers, {expected} expected")]
    Shape {
        /// The output.
        name: &'static str,
        /// Its numbers.
        got: usize,
        /// Those of the maps of all classes.
        expected: usize,
    },
}

/// Bytes of the embedded network, by `tools/part_network/train.py`.
static EMBEDDED: &[u8] = include_bytes!("parts.onnx");

/// Network from a person's picture to maps of classes and joints, and the yaw.
pub struct PartNetwork {
    model: Model,
    input: NodeId,
    outputs: [NodeId; 4],
}

/// Maps of one picture, row-major, rows from the top.
#[derive(Clone, Debug, Default)]
pub(super) struct NetworkOutput {
    /// Logits of the classes and of what isn't the person, shape `[classes + 1, side, side]`.
    pub(super) classes: Vec<f32>,
    /// Logits of each class's anchor, shape `[classes, side, side]`.
    pub(super) heat: Vec<f32>,
    /// Distance of each anchor from the window's middle in units of its side, shape `[classes, side, side]`.
    pub(super) depth: Vec<f32>,
    /// Logits of the sectors of yaw.
    pub(super) yaw: Vec<f32>,
}

/// The one thread that all networks run on: a frame's budget is that of one core.
fn thread() -> Arc<ThreadPool> {
    static POOL: OnceLock<Arc<ThreadPool>> = OnceLock::new();
    POOL.get_or_init(|| Arc::new(ThreadPool::with_num_threads(1)))
        .clone()
}

impl PartNetwork {
    /// The network of the classes of `tracking::part_classes`, read on first use and shared.
    ///
    /// # Panics
    /// Never in a build that passes its tests: the bytes are part of the build.
    pub fn embedded() -> Arc<Self> {
        static NETWORK: OnceLock<Arc<PartNetwork>> = OnceLock::new();
        #[expect(
            clippy::expect_used,
            reason = "the bytes are part of the build; a test reads them"
        )]
        NETWORK
            .get_or_init(|| Arc::new(Self::from_bytes(EMBEDDED).expect("the embedded network")))
            .clone()
    }

    /// Reads a network and tries it once.
    ///
    /// # Errors
    /// Names the fault in the bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, PartNetworkError> {
        let format = |e: &dyn std::fmt::Display| PartNetworkError::Format(e.to_string());
        let mut options = ModelOptions::with_all_ops();
        let model = options.prepack_weights(true).load(bytes.to_vec());
        let model = model.map_err(|e| format(&e))?;
        let id = |name: &'static str| model.find_node(name).ok_or(PartNetworkError::Missing(name));
        let input = id("picture")?;
        let [a, b, c, d] = OUTPUTS.map(|(name, _)| id(name));
        let outputs = [a?, b?, c?, d?];
        let network = Self {
            model,
            input,
            outputs,
        };
        network.run(&vec![0.0; CROP_CHANNELS * CROP_SIDE * CROP_SIDE])?;
        Ok(network)
    }

    /// Runs the network on a picture of shape `[channels, side, side]`.
    pub(super) fn run(&self, picture: &[f32]) -> Result<NetworkOutput, PartNetworkError> {
        let format = |e: &dyn std::fmt::Display| PartNetworkError::Format(e.to_string());
        let shape = [1, CROP_CHANNELS, CROP_SIDE, CROP_SIDE];
        let picture = NdTensorView::try_from_data(shape, picture).map_err(|e| format(&e))?;
        let options = RunOptions::default().with_thread_pool(Some(thread()));
        let input = vec![(self.input, picture.into())];
        let found = self.model.run(input, &self.outputs, Some(options));
        let mut found = found.map_err(|e| format(&e))?.into_iter();
        let mut next = |(name, expected): (&'static str, usize)| {
            let value = found.next().ok_or(PartNetworkError::Missing(name))?;
            let tensor: rten_tensor::Tensor<f32> = value
                .try_into()
                .map_err(|e: rten::TryFromValueError| format(&e))?;
            let data = tensor.to_vec();
            let got = data.len();
            if got == expected {
                Ok(data)
            } else {
                Err(PartNetworkError::Shape {
                    name,
                    got,
                    expected,
                })
            }
        };
        Ok(NetworkOutput {
            classes: next(OUTPUTS[0])?,
            heat: next(OUTPUTS[1])?,
            depth: next(OUTPUTS[2])?,
            yaw: next(OUTPUTS[3])?,
        })
    }
}

impl std::fmt::Debug for PartNetwork {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let weights = self.model.total_params();
        f.debug_struct("PartNetwork")
            .field("weights", &weights)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_network_is_whole_and_small() {
        let network = PartNetwork::from_bytes(EMBEDDED).expect("the embedded bytes");
        assert!(network.model.total_params() > 100_000 && EMBEDDED.len() <= 4 << 20);
    }

    #[test]
    fn bytes_that_are_no_network_are_refused() {
        for bytes in [&b""[..], b"not a network", &EMBEDDED[..EMBEDDED.len() / 2]] {
            assert!(PartNetwork::from_bytes(bytes).is_err());
        }
    }
}
